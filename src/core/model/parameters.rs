//! Parameters that differ from place to place, as columns.

use crate::kinetics::{Column, Location};

/// Parameters of a law on a sheet: none of its own if all are as the law has them.
#[derive(Debug, Clone, Default)]
pub struct ParameterFields {
    /// One a parameter: a single value, or one a point where species live.
    pub at_points: Vec<Vec<f64>>,
    /// The same at edges, where length factors are taken.
    pub(super) at_edges: Vec<Vec<f64>>,
}

impl ParameterFields {
    /// These values: one for all points, or one a point.
    #[must_use]
    pub fn new(at_points: Vec<Vec<f64>>) -> Self {
        Self { at_points, at_edges: Vec::new() }
    }

    pub(super) fn columns(&self, location: Location, count: usize) -> Vec<Column<'_>> {
        let all = if location == Location::Edge { &self.at_edges } else { &self.at_points };
        all.iter().map(|values| column(values, count)).collect()
    }
}

pub(super) fn column(values: &[f64], count: usize) -> Column<'_> {
    match values {
        [single] if count != 1 => Column::uniform(single),
        _ => values.into(),
    }
}
