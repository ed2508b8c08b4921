//! Lengths of the steps of [`Staggered`]: the first, those after an accepted and after a rejected one.

use super::spec::Staggered;
use crate::model::State;
use crate::solve::{Result, Workspace};

/// Growth of the step is limited to this factor, shrinking to its inverse squared.
pub(super) const MAX_STEP_GROWTH: f64 = 2.0;
/// Steps are proposed a little shorter than the estimate allows.
pub(super) const SAFETY: f64 = 0.9;
/// An error above this shortens a step as much as any: stages that have gone so far are given up.
pub(super) const HOPELESS_ERROR: f64 =
    SAFETY * SAFETY * MAX_STEP_GROWTH * MAX_STEP_GROWTH * MAX_STEP_GROWTH * MAX_STEP_GROWTH;
/// Part of its typical magnitude that the fastest species changes by in the first step, relative to √rtol.
const FIRST_CHANGE: f64 = 0.2;
/// The first step is not longer than this share of the way to the first output.
const SHARE_OF_WAY: f64 = 0.1;

impl Staggered {
    /// Step-size controller: the length of the step after an accepted one of length `step` and this error. Only a
    /// first attempt may be followed by a longer step.
    pub(super) fn propose(&mut self, step: f64, proposed: f64, error: f64, first: bool) {
        self.error = error;
        let limit = if first { MAX_STEP_GROWTH } else { 1.0 };
        let factor = (SAFETY / error.sqrt()).min(limit);
        // A step cut short by an output time does not limit the next one.
        self.step = Some((step * factor).max(if factor >= 1.0 { proposed } else { 0.0 }));
    }

    /// A first step from the rates: small against the time in which the fastest species changes by its typical
    /// magnitude, whatever the unit of time is.
    pub(super) fn first_step(
        &self,
        workspace: &mut Workspace,
        state: &State,
        until: f64,
    ) -> Result<f64> {
        let rate = workspace.at(state).fastest_rate()?;
        // What is steady says nothing of how fast it is led along.
        let steady = self.policy.chemistry == 0.0;
        let rate = rate.max(if steady { workspace.at(state).fastest_motion()? } else { 0.0 });
        let share = FIRST_CHANGE * self.spec.rtol.get().sqrt();
        Ok((share / rate).min(SHARE_OF_WAY * (until - state.time)))
    }
}

/// The share of a step that is tried after an attempt with this error.
pub(super) fn shortening(error: f64) -> f64 {
    (SAFETY / error.sqrt()).clamp(1.0 / (MAX_STEP_GROWTH * MAX_STEP_GROWTH), SAFETY)
}
