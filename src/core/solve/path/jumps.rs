//! Jumps from one branch of equilibria to another: when they begin and end, and the energy that they release.
//!
//! A sub-step loses energy under the conditions at its end. Along a branch next to nothing of it is dissipated, in a
//! jump all. A minimisation without viscosity that follows sub-steps makes up for what these lag behind, which is no more
//! than the viscosity can hold back; one that loses far more has jumped. What a jump releases is
//! what its sub-steps and the minimisation lose.

use super::super::equilibrium::distance;
use super::super::route::Route;
use super::super::{Result, Workspace};
use super::rest::energy;
use crate::model::State;
use crate::parallel;

/// A jump dissipates at least this share of what it loses; some 1e-3 and 1 were seen along branches and in jumps.
const SHARE: f64 = 0.3;
/// And without viscosity it loses so many times what that would dissipate.
const BEYOND: f64 = 30.0;
/// What moves no vertex further, in mean edges, is no jump.
const STILL: f64 = 0.1;

/// The jumps of a step.
#[derive(Default)]
pub(super) struct Jumps {
    /// Whether one is under way.
    open: bool,
    pub(super) count: usize,
    pub(super) released: f64,
}

impl Jumps {
    /// A part of a jump releases so much.
    pub(super) fn go_on(&mut self, released: f64) {
        self.count += usize::from(!self.open);
        self.open = true;
        self.released += released;
    }

    /// The shape is on a branch.
    pub(super) fn end(&mut self) {
        self.open = false;
    }
}

/// What becomes of the energy of a motion.
pub(super) struct Loss {
    /// What it loses under the conditions at its end.
    pub(super) lost: f64,
    /// What the viscosity dissipates.
    dissipated: f64,
}

impl Loss {
    /// Of the motion between two shapes at a time `t` of the clock of `route`, with a viscosity of `drag` times that of
    /// the scene; none where it is too short to be a jump.
    ///
    /// # Errors
    /// If the model has no value at one of its ends.
    pub(super) fn of(
        workspace: &mut Workspace,
        route: &Route<'_>,
        (t, drag): (f64, f64),
        (before, after): (&State, &State),
    ) -> Result<Option<Self>> {
        let model = workspace.model.clone();
        if distance(&before.x, &after.x) < STILL * model.mechanics().reference().mean_edge() {
            return Ok(None);
        }
        let weights = model.drag().weights(model.sheet(), &before.x, drag);
        let dissipated = parallel::sum(before.x.len(), |i| {
            let moved = after.x[i] - before.x[i];
            moved.dot(&weights.apply(i, moved))
        });
        let lost = energy(workspace, route, t, before)? - energy(workspace, route, t, after)?;
        Ok(Some(Self { lost, dissipated }))
    }

    /// Whether a sub-step with this viscosity is a part of a jump.
    pub(super) fn is_part_of_jump(&self) -> bool {
        self.lost > 0.0 && self.dissipated > SHARE * self.lost
    }

    /// Whether a minimisation without viscosity, where there was one before, has jumped.
    pub(super) fn is_jump(&self) -> bool {
        self.lost > BEYOND * self.dissipated
    }
}
