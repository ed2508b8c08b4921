//! Parameters that differ from place to place, as columns.

use crate::geometry::FaceVertexAverage;
use crate::kinetics::{Capabilities, Column, Location};
use crate::parallel;
use crate::sheet::Sheet;

/// Parameters of a law on a sheet: none of its own if all are as the law has them.
#[derive(Debug, Clone, Default)]
pub struct ParameterFields {
    /// One a parameter: a single value, or one a point where species live.
    pub at_points: Vec<Vec<f64>>,
    /// The same at edges, where length factors are taken.
    pub(super) at_edges: Vec<Vec<f64>>,
    /// The same of species on faces at vertices, where spontaneous curvatures are taken.
    pub(super) at_vertices: Vec<Vec<f64>>,
}

impl ParameterFields {
    /// These values: one for all points, or one a point.
    #[must_use]
    pub fn new(at_points: Vec<Vec<f64>>) -> Self {
        Self { at_points, ..Self::default() }
    }

    /// Carries them from where species live to where a law of these capabilities is evaluated as well.
    pub(super) fn carry(&mut self, sheet: &Sheet, location: Location, given: &Capabilities) {
        if !given.length_factor && !given.curvature {
            return;
        }
        let average = (location == Location::Face).then(|| FaceVertexAverage::new(sheet));
        let carry = |values: &Vec<f64>, to: &dyn Fn(Vec<f64>) -> Vec<f64>| match values.len() {
            1 => values.clone(),
            _ => to(at_vertices(sheet, average.as_ref(), values)),
        };
        let all = |to: &dyn Fn(Vec<f64>) -> Vec<f64>| {
            self.at_points.iter().map(|values| carry(values, to)).collect::<Vec<_>>()
        };
        let at_edges = all(&|values| edge_means(sheet, &values));
        let at_vertices = if average.is_some() { all(&|values| values) } else { Vec::new() };
        (self.at_edges, self.at_vertices) = (at_edges, at_vertices);
    }

    pub(super) fn columns(&self, location: Location, count: usize) -> Vec<Column<'_>> {
        let all = match location {
            Location::Edge => &self.at_edges,
            Location::Vertex if !self.at_vertices.is_empty() => &self.at_vertices,
            _ => &self.at_points,
        };
        all.iter().map(|values| column(values, count)).collect()
    }
}

pub(super) fn column(values: &[f64], count: usize) -> Column<'_> {
    match values {
        [single] if count != 1 => Column::uniform(single),
        _ => values.into(),
    }
}

/// Values at vertices, of values where species live.
pub(in crate::model) fn at_vertices(
    sheet: &Sheet,
    average: Option<&FaceVertexAverage>,
    values: &[f64],
) -> Vec<f64> {
    let Some(average) = average else { return values.to_vec() };
    let mut out = vec![0.0; sheet.vertex_count()];
    average.apply(sheet, values, &mut out);
    out
}

/// Means of the two ends of every edge.
pub(in crate::model) fn edge_means(sheet: &Sheet, at_vertices: &[f64]) -> Vec<f64> {
    let edges = sheet.edges();
    let mut mean = vec![0.0; edges.len()];
    parallel::fill(&mut mean, |e| {
        let [a, b] = edges[e].vertices;
        0.5 * (at_vertices[a as usize] + at_vertices[b as usize])
    });
    mean
}
