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
use crate::effects::{HessianPart, RankOneTerm, Work};
use crate::geometry::Shape;
use crate::linear::BlockMatrix;
use crate::reduction::Reduction;
use crate::tally::Meter;
use crate::{Vec3, parallel};

/// μ in units of the stiffness of the sheet at rest along ∂g.
pub(super) const PENALTY_FACTOR: f64 = 100.0;

/// The constraints of one potential; empty, and nothing allocated, in a scene without.
#[derive(Default)]
pub(super) struct Constraints {
    pub work: Vec<Work>,
    /// λ.
    pub(super) multipliers: Vec<f64>,
    /// μ.
    pub(super) stiffness: Vec<f64>,
    /// ∂g at the last shape, with the fixed directions set to zero.
    pub(super) gradients: Vec<Vec<Vec3>>,
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
                .map(|name| mechanics.tally().meter("effect", &counters::constraint_meter(name)))
                .collect(),
        }
    }

    pub(super) fn count(&self) -> usize {
        self.multipliers.len()
    }

    /// Every g at `shape`; leaves ∂g in `gradients`.
    pub(super) fn evaluate(&mut self, mechanics: &Mechanics, shape: &Shape<'_>) -> Vec<f64> {
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
    pub(super) fn shares(&self, reduction: &Reduction, right: &[f64]) -> Vec<f64> {
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
