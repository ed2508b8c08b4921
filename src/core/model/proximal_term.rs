//! A pull towards an earlier shape: what one step under drag adds to the energy.
//!
//! ```text
//! U(x) + ½ Σ_i (x_i - a_i) · W_i (x_i - a_i),     W_i = γ_i/(a Δt)
//! ```
//!
//! The minimum obeys `W (x - a) = -∂U/∂x`: a stage of an implicit integration of `drag dx/dt = -∂U/∂x`.
//! Reference: Jordan, Kinderlehrer & Otto, SIAM J. Math. Anal. 29 (1998), doi:10.1137/S0036141096303359
//! (minimising movements).

use super::drag::Weights;
use super::mechanics::Mechanics;
use crate::Vec3;
use crate::linear::BlockMatrix;
use crate::parallel;
use crate::reduction::Reduction;

/// The shape that a potential pulls to, and how strongly.
#[derive(Debug, Clone, PartialEq)]
pub struct Anchor {
    /// a.
    pub x: Vec<Vec3>,
    /// W.
    pub weights: Weights,
    /// Distance of the vertices from the minimum that does not matter.
    pub slack: f64,
}

impl Anchor {
    /// Lets fixed directions be where `x` has them: nothing pulls there.
    pub(crate) fn follow_pins(&mut self, mechanics: &Mechanics, x: &[Vec3]) {
        mechanics.keep_pins(x, &mut self.x);
    }

    /// Least force on a vertex at the distance `slack` from the minimum, `slack · min W`.
    #[must_use]
    pub fn slack_force(&self, reduction: &Reduction) -> f64 {
        self.slack * self.weights.least(reduction)
    }

    /// `Σ_i (x_i - a_i) · W_i (x_i - a_i)` without the fixed directions: the work that the drag takes up while free vertices
    /// move from a to x in a Δt.
    pub(crate) fn dissipation(&self, mechanics: &Mechanics, x: &[Vec3]) -> f64 {
        let pins = mechanics.pins();
        mechanics.sheet().reduction().sum(x.len(), |i| {
            let mut d = x[i] - self.x[i];
            (0..3).filter(|a| pins[i][*a]).for_each(|a| d[a] = 0.0);
            d.dot(&self.weights.apply(i, d))
        })
    }

    /// Adds W (x - a), its gradient at `x`.
    pub(super) fn add_gradient(&self, x: &[Vec3], gradient: &mut [Vec3]) {
        parallel::update(gradient, |i, g| *g += self.weights.apply(i, x[i] - self.x[i]));
    }

    /// The energy at `x` of what is owned here.
    pub(super) fn energy_here(&self, x: &[Vec3], reduction: &Reduction) -> f64 {
        let pull = |i: usize| {
            let d = x[i] - self.x[i];
            0.5 * d.dot(&self.weights.apply(i, d))
        };
        reduction.sum_here(x.len(), pull)
    }

    /// Adds W, its Hessian.
    pub(super) fn add_hessian(&self, into: &mut BlockMatrix) {
        into.update_rows(|i, row| row.add(i, &self.weights.block(i)));
    }
}
