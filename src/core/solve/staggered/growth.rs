//! Perturbations that grow faster under drag than steps are short.
//!
//! A shape whose perturbations have died down shows no error where it loses its stability: L-stable steps that are long
//! compared with the time in which a perturbation grows damp it. Where one is found, the shape is displaced along it by a
//! share of the tolerance, and until the next check steps are no longer than the time in which it grows by e.

use super::spec::{Growth, Staggered};
use crate::model::State;
use crate::num::checked::Positive;
use crate::solve::equilibrium::Relaxation;
use crate::solve::{Result, Workspace};

/// Iterations of the motion between two checks, in the long run and at first, when the interval is doubled by every check: one
/// costs as much as ten to forty, and a short run has few steps.
const CHECK_INTERVAL: usize = 300;
const FIRST_INTERVAL: usize = 60;
/// What a step counts for at least: the second is checked, the sixth, and in the long run every tenth.
const LEAST_ITERATIONS: usize = 30;
/// Doublings after which the interval is that of the long run.
const MAX_DOUBLINGS: u32 = 3;
/// The displacement in units of the tolerance of a step.
const DISPLACEMENT: f64 = 0.1;

impl Staggered {
    /// The longest step: that of the scene, and what follows the perturbation that grows fastest.
    pub(super) fn longest_step(&self) -> f64 {
        let longest = self.spec.longest_step.map_or(f64::INFINITY, Positive::get);
        longest.min(self.growth.rate.map_or(f64::INFINITY, |rate| 1.0 / rate))
    }

    /// `state` after a step of this length with this work, with its shape checked for perturbations that such steps damp.
    pub(super) fn watched(
        &mut self,
        workspace: &mut Workspace,
        mut state: State,
        (step, done): (f64, &Relaxation),
    ) -> Result<State> {
        if self.policy.mechanics == 0.0 || !workspace.model.moves() {
            return Ok(state);
        }
        self.growth.unchecked += done.iterations.max(LEAST_ITERATIONS);
        let Growth { unchecked, checks, .. } = self.growth;
        if unchecked >= CHECK_INTERVAL.min(FIRST_INTERVAL << checks.min(MAX_DOUBLINGS)) {
            let by = DISPLACEMENT * workspace.model.shape_unit(&state, self.tolerance());
            let rate = workspace.leave_damped_saddle(&mut state, step, by)?;
            self.growth = Growth { unchecked: 0, rate, checks: checks.saturating_add(1) };
        }
        Ok(state)
    }
}
