//! A sheet does not pass through itself.

use std::sync::Arc;

use super::{Law, Said, Step};
use crate::geometry::Crossings;
use crate::model::State;
use crate::num::real;
use crate::run::{Result, self_intersection};
use crate::sheet::Sheet;
use crate::solve::Workspace;

/// The law, with the tree of boxes that it looks with.
pub(super) struct NoCrossings {
    sheet: Arc<Sheet>,
    crossings: Crossings,
}

impl NoCrossings {
    /// For the shapes of `sheet`.
    pub(super) fn of(sheet: &Arc<Sheet>) -> Self {
        Self { sheet: Arc::clone(sheet), crossings: Crossings::new(sheet) }
    }

    fn said(&mut self, state: &State) -> Said {
        let found = self.crossings.find(&self.sheet, &state.x);
        let place = self_intersection::place(&self.sheet, &state.x, &found);
        let pairs = found.pairs;
        Said { row: vec![real(pairs)], value: real(pairs), place, memory: Vec::new() }
    }
}

impl Law for NoCrossings {
    fn name(&self) -> String {
        "the rule that a sheet does not pass through itself (pairs of triangles that cross)".into()
    }

    fn advice(&self) -> &'static str {
        "there is no contact of a sheet with itself: end the run before, or change what folds it"
    }

    fn columns(&self) -> Vec<String> {
        vec!["crossings [pairs of triangles]".into()]
    }

    fn begin(&mut self, _: &mut Workspace, state: &State) -> Result<Said> {
        Ok(self.said(state))
    }

    fn look(&mut self, step: &mut Step<'_>, _: &[f64]) -> Result<Said> {
        Ok(self.said(step.after))
    }
}
