//! Constraints of a potential: what must be zero at every shape, by an augmented Lagrangian.
//!
//! ```text
//! g_k(x, t) = 0            L(x) = U(x) - Σ λ_k g_k(x) + ½ Σ μ_k g_k(x)²
//! ∂L = ∂U + Σ w_k ∂g_k     ∂²L = ∂²U + Σ w_k ∂²g_k + Σ μ_k ∂g_k ⊗ ∂g_k,     w_k = μ_k g_k - λ_k
//! ```
//!
//! g has no unit; λ is an energy, and `λ ∂g` the force by which the constraint is kept. Where g = 0 and
//! ∂L = 0 the energy is stationary among all shapes that obey the constraints, whatever μ is. μ only
//! says how hard a relaxation is driven there: [`PENALTY_FACTOR`] times what the sheet at rest resists with
//! along ∂g.
//!
//! At a given shape λ minimises the residual force,
//! `min_λ |∂U - Σ λ_k ∂g_k|`, fixed directions left out: nothing is remembered from an earlier shape.
//! Reference: Nocedal & Wright, Numerical Optimization (2006), section 17.3.

use nalgebra::{DMatrix, DVector};

use super::counters::{self, energy};
use super::error::ModelError;
use super::mechanics::Mechanics;
use super::potential::Potential;
use crate::Vec3;
use crate::effects::{HessianPart, RankOneTerm, Work};
use crate::geometry::Shape;
use crate::linear::BlockMatrix;
use crate::parallel;
use crate::reduction::Reduction;
use crate::tally::Meter;

/// μ in units of the stiffness of the sheet at rest along ∂g.
const PENALTY_FACTOR: f64 = 100.0;
/// Corrections after which a projection has not converged.
const MAX_CORRECTIONS: usize = 20;
/// Below this g counts as zero in a projection: what round-off leaves of it.
const ROUND_OFF: f64 = 1e-14;

/// The constraints of one potential; empty, and nothing allocated, in a scene without.
#[derive(Default)]
pub(super) struct Constraints {
    pub work: Vec<Work>,
    /// λ.
    multipliers: Vec<f64>,
    /// μ.
    stiffness: Vec<f64>,
    /// ∂g at the last shape, with the fixed directions set to zero.
    gradients: Vec<Vec<Vec3>>,
    /// ∂²g.
    matrix: Option<BlockMatrix>,
    meters: Vec<Meter>,
}

impl Constraints {
    pub(super) fn new(mechanics: &Mechanics) -> Self {
        let all = mechanics.constraints();
        let zeros = || vec![Vec3::zeros(); mechanics.sheet().vertex_count()];
        Self {
            work: all.iter().map(|_| Work::from(Box::new(()))).collect(),
            multipliers: vec![0.0; all.len()],
            stiffness: vec![0.0; all.len()],
            gradients: all.iter().map(|_| zeros()).collect(),
            matrix: None,
            meters: mechanics
                .constraint_names()
                .map(|name| counters::of_constraint(mechanics.tally(), name))
                .collect(),
        }
    }

    fn count(&self) -> usize {
        self.multipliers.len()
    }

    /// Every g at `shape`; leaves ∂g in `gradients`.
    fn evaluate(&mut self, mechanics: &Mechanics, shape: &Shape<'_>) -> Vec<f64> {
        let terms = mechanics.constraints().iter().zip(&mut self.work).zip(&mut self.gradients);
        let one = |(((term, work), gradient), meter): (((_, _), &mut Vec<Vec3>), &Meter)| {
            let term: &crate::effects::EnergyTerm = term;
            let _scope = meter.scope(energy::GRADIENT);
            parallel::update(gradient, |_, g| *g = Vec3::zeros());
            let value = term.energy.evaluate(shape, work, Some(&mut *gradient));
            mechanics.fix(gradient);
            value
        };
        let mut values: Vec<f64> = terms.zip(&self.meters).map(one).collect();
        mechanics.sheet().reduction().sum_over_ranks(&mut values);
        values
    }

    /// The shares s with `Σ_l (∂g_k·∂g_l) s_l = right_k`; zero for constraints that depend on one another.
    fn shares(&self, reduction: &Reduction, right: &[f64]) -> Vec<f64> {
        let count = self.count();
        let gram = DMatrix::from_fn(count, count, |k, l| {
            reduction.dot(&self.gradients[k], &self.gradients[l])
        });
        let solved = gram.cholesky().map(|gram| gram.solve(&DVector::from_column_slice(right)));
        match solved {
            Some(solved) if solved.iter().all(|s| s.is_finite()) => solved.as_slice().to_vec(),
            _ => vec![0.0; count],
        }
    }

    /// Adds what the constraints add to the energy and its gradient at `shape`.
    pub(super) fn add(
        &mut self,
        mechanics: &Mechanics,
        shape: &Shape<'_>,
        gradient: &mut [Vec3],
    ) -> f64 {
        let values = self.evaluate(mechanics, shape);
        let mut energy = 0.0;
        for (k, g) in values.iter().enumerate() {
            let (multiplier, stiffness) = (self.multipliers[k], self.stiffness[k]);
            energy += g * (0.5 * stiffness * g - multiplier);
            let (weight, by) = (stiffness * g - multiplier, &self.gradients[k]);
            parallel::update(gradient, |i, out| *out += weight * by[i]);
        }
        energy
    }

    /// Adds `Σ w ∂²g` to `into`; the positive part has nothing of it, since w has either sign.
    pub(super) fn add_hessian(
        &mut self,
        mechanics: &Mechanics,
        shape: &Shape<'_>,
        part: HessianPart,
        into: &mut BlockMatrix,
    ) -> Result<(), ModelError> {
        if part == HessianPart::Positive {
            return Ok(());
        }
        let values = self.evaluate(mechanics, shape);
        let pattern = into.pattern();
        let matrix = match &mut self.matrix {
            Some(matrix) if matrix.pattern() == pattern => matrix,
            other => other.insert(BlockMatrix::zeros(std::sync::Arc::clone(pattern))),
        };
        let terms =
            mechanics.constraints().iter().zip(&mut self.work).zip(mechanics.constraint_names());
        for (k, ((term, work), name)) in terms.enumerate() {
            let _scope = self.meters[k].scope(energy::HESSIAN);
            matrix.clear();
            term.energy.add_hessian(shape, work, part, matrix);
            if let Some(pair) = matrix.outside() {
                return Err(ModelError::Coupling { effect: name.to_owned(), pair });
            }
            into.add_scaled(self.stiffness[k] * values[k] - self.multipliers[k], matrix);
        }
        Ok(())
    }

    /// Adds `μ ∂g ⊗ ∂g`.
    pub(super) fn add_low_rank(
        &mut self,
        mechanics: &Mechanics,
        shape: &Shape<'_>,
        terms: &mut Vec<RankOneTerm>,
    ) {
        self.evaluate(mechanics, shape);
        for (stiffness, direction) in self.stiffness.iter().zip(&self.gradients) {
            terms.push(RankOneTerm { stiffness: *stiffness, direction: direction.clone() });
        }
    }
}

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

    /// g of every constraint at `x`, by [`Mechanics::constraint_names`].
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
