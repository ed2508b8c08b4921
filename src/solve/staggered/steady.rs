//! A step of chemistry-fast: the chemistry is in steady state at every time.

use super::Staggered;
use crate::model::State;
use crate::solve::{Result, StepReport, Workspace};

impl Staggered {
    /// The same where the chemistry is in steady state at every time: shape, chemistry, and both once more.
    pub(super) fn try_steady(
        &mut self,
        workspace: &mut Workspace,
        state: &State,
        mut next: State,
        report: &mut StepReport,
    ) -> Result<(State, f64)> {
        let tolerance = self.tolerance();
        let inner = self.inner();
        let done = &mut report.relaxation;
        self.follow_shape(workspace, state, &mut next, done)?;
        self.steady.solve(workspace, &mut next, inner)?;
        let mut predicted = next.clone();
        let coarse = self.follow_shape(workspace, state, &mut next, done)?;
        self.steady.solve(workspace, &mut next, inner)?;
        let model = &workspace.model;
        let error = model.species_misfit(state, (&predicted, &next), tolerance);
        let shape = self.shape_error(workspace, state, &predicted, &next);
        let Some(coarse) = coarse else { return Ok((next, error.max(shape))) };
        predicted.x = coarse.into();
        let order = self.shape_error(workspace, state, &predicted, &next);
        Ok((next, error.max(shape).max(order)))
    }
}
