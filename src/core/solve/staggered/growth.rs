//! Perturbations that grow faster under drag than steps are short.
//!
//! A shape whose perturbations have died down shows no error where it loses its stability: L-stable steps that are long
//! compared with the time in which a perturbation grows damp it. Where one is found, the shape is displaced along it by a
//! share of the tolerance, and until the next check steps are no longer than the time in which it grows by e.

use super::spec::{Growth, Staggered};
use crate::model::State;
use crate::solve::{Result, Workspace};

/// Iterations of the motion between two checks: a check costs as much as ten to forty.
const CHECK_INTERVAL: usize = 300;
/// What a step counts for at least: every tenth is checked.
const LEAST_ITERATIONS: usize = 30;
/// The displacement in units of the tolerance of a step.
const DISPLACEMENT: f64 = 0.1;

impl Growth {
    /// The longest step that follows it.
    pub(super) fn longest_step(&self) -> f64 {
        self.rate.map_or(f64::INFINITY, |rate| 1.0 / rate)
    }
}

impl Staggered {
    /// Checks the shape of `state`, after so many iterations in a step of this length, for perturbations that it damps.
    pub(super) fn watch_growth(
        &mut self,
        workspace: &mut Workspace,
        state: &mut State,
        (step, iterations): (f64, usize),
    ) -> Result<()> {
        if self.policy.mechanics == 0.0 || !workspace.model.moves() {
            return Ok(());
        }
        self.growth.unchecked += iterations.max(LEAST_ITERATIONS);
        if self.growth.unchecked < CHECK_INTERVAL {
            return Ok(());
        }
        let by = DISPLACEMENT * workspace.model.shape_unit(state, self.tolerance());
        let rate = workspace.leave_damped_saddle(state, step, by)?;
        self.growth = Growth { unchecked: 0, rate };
        Ok(())
    }
}
