//! Where a sheet that floats comes to lie.
//!
//! Rigid motions that neither pins nor effects hinder change no energy, so that a minimum has none of its own: forces
//! below the tolerance would let the sheet drift. Under a viscosity W a minimiser about a has no net motion,
//!
//! ```text
//! Σ_i v_i · W_i (x_i - a_i) = 0             for every free rigid motion v
//! ```
//!
//! nor does the limit of vanishing drag. A shape that a minimisation has found is moved rigidly to where this holds.

use crate::Vec3;
use crate::model::{Anchor, Drag, Potential, align, floats};

/// Whether the sheet floats in this step, once that is known.
#[derive(Default)]
pub(super) struct Floating(Option<bool>);

impl Floating {
    /// A step begins.
    pub(super) fn forget(&mut self) {
        self.0 = None;
    }

    /// Whether the sheet floats, as found at the shape `x` of the first search of a step, without a viscosity.
    pub(super) fn found(&mut self, potential: &mut Potential, x: &[Vec3], tolerance: f64) -> bool {
        *self.0.get_or_insert_with(|| floats(potential, x, tolerance))
    }

    /// Moves `x`, a minimum found from `start`, rigidly to where it has no net motion from `anchor` under its weights, or
    /// without one from `start` under the `drag` of the scene; nothing unless the sheet floats.
    pub(super) fn settle(
        &mut self,
        potential: &mut Potential,
        (x, start): (&mut [Vec3], &[Vec3]),
        anchor: Option<Anchor>,
        (drag, tolerance): (&Drag, f64),
    ) {
        if self.found(potential, x, tolerance) {
            let from_start = || Anchor {
                x: start.to_vec(),
                weights: drag.weights(potential.sheet(), start, 1.0),
                slack: 0.0,
            };
            let Anchor { x: about, weights, .. } = anchor.unwrap_or_else(from_start);
            let apply = |i: usize, v| weights.apply(i, v);
            align(x, &about, apply, potential.pins(), potential.reduction());
        }
    }
}
