//! A step of chemistry-fast: the chemistry is in steady state at every time.

use super::spec::Staggered;
use crate::model::State;
use crate::solve::chemistry::Leap;
use crate::solve::{Result, StepReport, Workspace};

/// In a step that moves the shape by less than this share of the tolerance the chemistry may leave the steady state that
/// it was in for another one: at a fold, where no shorter step keeps it there.
const AT_REST: f64 = 0.1;

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
        next.internal = self.flow(workspace, state, &next)?;
        self.follow_shape(workspace, state, &mut next, done)?;
        let still = self.shape_error(workspace, state, state, &next) < AT_REST;
        let leap = if still { Leap::Allowed } else { Leap::Refused };
        self.steady.solve(workspace, &mut next, inner, leap)?;
        let mut predicted = next.clone();
        next.internal = self.flow(workspace, state, &predicted)?;
        let coarse = self.follow_shape(workspace, state, &mut next, done)?;
        self.steady.solve(workspace, &mut next, inner, leap)?;
        let model = &workspace.model;
        let error = model.species_misfit(state, (&predicted, &next), tolerance);
        let error = error.max(model.internal_misfit(state, (&predicted, &next), tolerance));
        let shape = self.shape_error(workspace, state, &predicted, &next);
        let Some(coarse) = coarse else { return Ok((next, error.max(shape))) };
        predicted.x = coarse.into();
        let order = self.shape_error(workspace, state, &predicted, &next);
        Ok((next, error.max(shape).max(order)))
    }
}
