//! A sheet does not pass through itself.

use super::{Invariant, InvariantValue, Step};
use crate::geometry::Crossings;
use crate::model::State;
use crate::num::real;
use crate::run::Result;
use crate::sheet::Sheet;
use crate::solve::Workspace;

/// The law, with the tree of boxes.
pub(super) struct NoCrossings(Crossings);

impl NoCrossings {
    /// For the shapes of `sheet`.
    pub(super) fn of(sheet: &Sheet) -> Self {
        Self(Crossings::new(sheet))
    }

    fn reading(&mut self, sheet: &Sheet, state: &State) -> InvariantValue {
        let found = self.0.find(sheet, &state.x);
        let value = real(found.pairs);
        let place = if found.pairs > 0 { found.place(sheet, &state.x) } else { String::new() };
        InvariantValue { row: vec![value], value, place, memory: Vec::new() }
    }
}

impl Invariant for NoCrossings {
    fn name(&self) -> String {
        "the rule that a sheet does not pass through itself (pairs of triangles that cross)".into()
    }

    fn advice(&self) -> &'static str {
        "list the effect `contact`, end the run before, or change what folds it"
    }

    fn columns(&self) -> Vec<String> {
        vec!["crossings [pairs of triangles]".into()]
    }

    fn begin(&mut self, workspace: &mut Workspace, state: &State) -> Result<InvariantValue> {
        Ok(self.reading(workspace.model.sheet(), state))
    }

    fn inspect(&mut self, step: &mut Step<'_>, _: &[f64]) -> Result<InvariantValue> {
        Ok(self.reading(step.workspace.model.sheet(), step.after))
    }
}
