//! Jumps from one branch of equilibria to another: when they begin and end, and the energy that they release.
//!
//! A sub-step from x to x' while conditions change from q to q' loses, less the work of these on it (trapezoidal rule),
//!
//! ```text
//! D = ½ [U(x; q) - U(x'; q)] + ½ [U(x; q') - U(x'; q')]
//! ```
//!
//! Along a branch the two brackets cancel up to the third order, however stiff the load; in a jump neither does. Positions
//! that are prescribed and constraints do work that this does not see: there the share that the viscosity dissipates
//! tells, next to nothing along a branch and all in a jump. A minimisation without viscosity at fixed conditions that
//! follows sub-steps makes up for what these lag behind, at most what the viscosity can hold back; one that
//! loses far more has jumped. What a jump releases is what its sub-steps and the minimisation lose.

use super::super::route::Route;
use super::super::{Result, Workspace};
use super::rest::energy;
use crate::model::State;

/// In a jump D is at least this share of U(x; q') - U(x'; q'). Along branches 0.04 and less was seen, where a sub-step is
/// one snap 0.28 to 1; in between lie small snaps in sub-steps that move further, which go unrecorded.
const NET_RELEASE_SHARE: f64 = 0.2;
/// Where D is unknown: a jump dissipates at least this share of what it loses; some 1e-3 and 1 were seen along branches
/// and in jumps.
const DISSIPATED_SHARE: f64 = 0.3;
/// And without viscosity it loses so many times what that would dissipate.
const UNDAMPED_LOSS_FACTOR: f64 = 30.0;
/// Displacement of every vertex, in mean edges, up to which a change is not a jump.
const STATIONARY_DISPLACEMENT: f64 = 0.1;

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
    /// D, where it is known.
    net: Option<f64>,
    /// What the viscosity dissipates.
    dissipated: f64,
}

impl Loss {
    /// Of the motion between two shapes from one time of the clock of `route` to another, with a viscosity of `drag` times
    /// that of the scene; none where it is too short to be a jump.
    ///
    /// # Errors
    /// If the model has no value at one of its ends.
    pub(super) fn of(
        workspace: &mut Workspace,
        route: &Route<'_>,
        ((start, end), drag): ((f64, f64), f64),
        (before, after): (&State, &State),
    ) -> Result<Option<Self>> {
        let model = workspace.model.clone();
        let mechanics = model.mechanics();
        let reduction = model.sheet().reduction();
        if reduction.distance(&before.x, &after.x)
            < STATIONARY_DISPLACEMENT * mechanics.reference().mean_edge()
        {
            return Ok(None);
        }
        let weights = model.drag().weights(model.sheet(), &before.x, drag);
        let dissipated = reduction.sum(before.x.len(), |i| {
            let moved = after.x[i] - before.x[i];
            moved.dot(&weights.apply(i, moved))
        });
        let mut lost_at = |t| -> Result<f64> {
            Ok(energy(workspace, route, t, before)? - energy(workspace, route, t, after)?)
        };
        let lost = lost_at(end)?;
        let net = match start == end {
            true => Some(lost),
            false if mechanics.has_prescribed() || mechanics.is_constrained() => None,
            false => Some(0.5 * (lost + lost_at(start)?)),
        };
        Ok(Some(Self { lost, net, dissipated }))
    }

    /// What is released if this sub-step is a part of a jump.
    pub(super) fn in_jump(&self) -> Option<f64> {
        let jumps = match self.net {
            Some(net) => net > NET_RELEASE_SHARE * self.lost,
            None => self.dissipated > DISSIPATED_SHARE * self.lost,
        };
        (self.lost > 0.0 && jumps).then_some(self.net.unwrap_or(self.lost))
    }

    /// Whether a minimisation without viscosity, where there was one before, has jumped.
    pub(super) fn is_jump(&self) -> bool {
        self.lost > UNDAMPED_LOSS_FACTOR * self.dissipated
    }
}
