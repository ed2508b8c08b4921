//! A potential with constraints: multipliers, forces, and the projection to where they are met.

use nalgebra::DMatrix;

use crate::linear::BlockMatrix;
use crate::model::Potential;
use crate::model::constraint::PENALTY_FACTOR;
use crate::model::potential::{Constraints, HessianPart};
use crate::{Vec3, parallel};

/// Corrections after which a projection has not converged.
const MAX_CORRECTIONS: usize = 20;

/// Below this g counts as zero in a projection: what round-off leaves of it.
const ROUND_OFF: f64 = 1e-14;

impl Potential {
    /// Whether there are constraints.
    #[must_use]
    pub fn is_constrained(&self) -> bool {
        self.constraints.count() > 0
    }

    /// Whether the gradients of some constraints on the sheet at rest are the same, up to a factor: they cannot
    /// be met together, or say the same twice.
    pub(crate) fn constraints_depend(&mut self) -> bool {
        if !self.is_constrained() {
            return false;
        }
        let sheet = std::sync::Arc::clone(self.sheet());
        self.constraint_values(sheet.rest());
        let (all, reduction) = (&self.constraints.gradients, self.reduction());
        let gram = DMatrix::from_fn(all.len(), all.len(), |k, l| {
            let size = (reduction.dot(&all[k], &all[k]) * reduction.dot(&all[l], &all[l])).sqrt();
            if size > 0.0 { reduction.dot(&all[k], &all[l]) / size } else { 0.0 }
        });
        gram.symmetric_eigenvalues().iter().any(|value| !(*value > 1e-10))
    }

    /// g of every constraint at `x`, by [`Mechanics::constraint_names`](crate::model::Mechanics::constraint_names).
    pub fn constraint_values(&mut self, x: &[Vec3]) -> Vec<f64> {
        let (mechanics, constraints, shape) = self.constrained(x);
        constraints.evaluate(mechanics, &shape)
    }

    /// The force `λ ∂g` by which constraint number `which` is kept at `x`, before pins.
    pub fn constraint_force(&mut self, which: usize, x: &[Vec3]) -> Vec<Vec3> {
        let (mechanics, constraints, shape) = self.constrained(x);
        let mut force = vec![Vec3::zeros(); x.len()];
        let terms = mechanics.constraints().iter().zip(&mut constraints.work);
        if let Some((term, work)) = terms.into_iter().nth(which) {
            term.energy.evaluate(&shape, work, Some(&mut force));
            parallel::update(&mut force, |_, f| *f *= constraints.multipliers[which]);
        }
        force
    }

    /// λ of every constraint.
    #[must_use]
    pub fn multipliers(&self) -> &[f64] {
        &self.constraints.multipliers
    }

    /// Sets λ of every constraint.
    pub(crate) fn set_multipliers(&mut self, multipliers: Vec<f64>) {
        if multipliers.len() == self.constraints.count() {
            self.constraints.multipliers = multipliers;
        }
    }

    /// Chooses μ from the second derivatives of the energy at `rest`.
    pub(super) fn choose_stiffness(&mut self, rest: &[Vec3]) {
        if !self.is_constrained() {
            return;
        }
        let mut matrix = BlockMatrix::zeros(self.pattern(rest));
        // An effect that couples more than it declares is an error wherever the matrix is used; what is
        // in it does for a choice.
        let _ = self.hessian(rest, HessianPart::Positive, &mut matrix);
        let (mechanics, constraints, shape) = self.constrained(rest);
        constraints.evaluate(mechanics, &shape);
        for (stiffness, gradient) in constraints.stiffness.iter_mut().zip(&constraints.gradients) {
            let square = mechanics.sheet().reduction().dot(gradient, gradient);
            let resists = matrix.quadratic(gradient);
            let resists = if resists > 0.0 { resists } else { matrix.mean_diagonal() * square };
            *stiffness =
                if square > 0.0 { PENALTY_FACTOR * resists / (square * square) } else { 0.0 };
        }
    }

    /// Sets λ to what leaves the smallest force at `x`. With `driving` the constraints then draw x
    /// towards g = 0; without, they act at `x` by λ alone.
    pub fn balance(&mut self, x: &[Vec3], driving: bool) {
        if !self.is_constrained() {
            return;
        }
        let mut gradient = vec![Vec3::zeros(); x.len()];
        self.mechanics().tally().count(|work| work.gradients += 1);
        self.unconstrained_gradient(x, &mut gradient);
        let (mechanics, constraints, shape) = self.constrained(x);
        let values = constraints.evaluate(mechanics, &shape);
        let reduction = mechanics.sheet().reduction();
        let along = constraints.gradients.iter().map(|by| reduction.dot(by, &gradient));
        let along: Vec<f64> = along.collect();
        let mut multipliers = constraints.shares(reduction, &along);
        if !driving {
            let more =
                values.iter().zip(&constraints.stiffness).map(|(g, stiffness)| g * stiffness);
            multipliers.iter_mut().zip(more).for_each(|(multiplier, more)| *multiplier += more);
        }
        constraints.multipliers = multipliers;
    }

    /// The step `λ ← λ - μ g` of the augmented Lagrangian at `x`, its minimum; the largest |g| there.
    pub(crate) fn update_multipliers(&mut self, x: &[Vec3]) -> f64 {
        let values = self.constraint_values(x);
        let Constraints { multipliers, stiffness, .. } = &mut self.constraints;
        for ((multiplier, stiffness), g) in multipliers.iter_mut().zip(&*stiffness).zip(&values) {
            *multiplier -= stiffness * g;
        }
        largest(&values)
    }

    /// Moves `x` to where the constraints are met, by steps along their gradients; the largest |g| left.
    ///
    /// ```text
    /// x ← x - Σ s_k ∂g_k,     Σ_l (∂g_k·∂g_l) s_l = g_k
    /// ```
    pub fn project(&mut self, x: &mut [Vec3]) -> f64 {
        let (mut left, mut best) = (f64::INFINITY, x.to_vec());
        for _ in 0..MAX_CORRECTIONS {
            let (mechanics, constraints, shape) = self.constrained(x);
            let values = constraints.evaluate(mechanics, &shape);
            let now = largest(&values);
            if !(now < left) {
                break;
            }
            (left, best) = (now, x.to_vec());
            if left <= ROUND_OFF {
                break;
            }
            let shares = constraints.shares(mechanics.sheet().reduction(), &values);
            for (share, by) in shares.iter().zip(&self.constraints.gradients) {
                parallel::update(x, |i, x| *x -= *share * by[i]);
            }
        }
        x.copy_from_slice(&best);
        left
    }
}

fn largest(values: &[f64]) -> f64 {
    // A NaN stays one.
    values.iter().fold(0.0, |a: f64, g| if g.is_nan() { *g } else { a.max(g.abs()) })
}
