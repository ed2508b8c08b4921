//! The overdamped motion by linearly implicit steps, ending as Newton's method.
//!
//! ```text
//! drag · dx/dτ = -∂U/∂x      →      (H + σ D) δ = -∂U/∂x,   x ← x + δ,   σ = 1/Δτ
//! ```
//!
//! with the whole second derivatives H at x and D the mean diagonal of H times the identity, so that
//! σ is a number. The defect `∂U/∂x(x + δ) - ∂U/∂x - H δ`, through the same factor, is how far the
//! step left the path; it sets the next σ. A failed Cholesky factorisation says that H + σD is not
//! positive: Δτ is too long for an unstable direction, and σ grows. Near the equilibrium σ shrinks to
//! nothing and convergence is quadratic.
//!
//! Follows the path more closely than quasi-Newton methods, at one factorisation or more a step, which
//! makes it much slower than `lbfgs` from far away. References: Deuflhard, Newton Methods for Nonlinear Problems
//! (2004), section 6.4 (pseudo-transient continuation), doi:10.1007/978-3-642-23899-4.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::super::counters::Linear;
use super::super::low_rank::LowRankUpdate;
use super::gauge::Gauge;
use super::stop::{iterated, largest, level, reached, stalled};
use super::{Equilibrium, Goal, Relaxation};
use crate::Vec3;
use crate::effects::HessianPart;
use crate::linear::{BlockCholesky, BlockMatrix};
use crate::model::{Mechanics, Potential};
use crate::num::checked::{AtLeast, Fraction, Positive};
use crate::parallel;
use crate::solve::{EquilibriumSpec, SolveError};

/// Settings of [`Newton`]; parameters of `equilibrium.method = "newton"` in a scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NewtonSpec {
    /// Largest force on a vertex that counts as rest, in units of the force at unit strain
    /// (Y times the edge length).
    pub tolerance: Positive,
    /// Steps after which a relaxation has failed.
    pub max_iterations: AtLeast<1>,
    /// Largest distance of a vertex from the overdamped path in one step, in mean edge lengths.
    pub path_error: Positive,
    /// No triangle's area may fall below this share in one step.
    pub area_share: Fraction,
}

impl Default for NewtonSpec {
    fn default() -> Self {
        Self {
            tolerance: const { Positive::constant(1e-6) },
            max_iterations: const { AtLeast::constant(1000) },
            path_error: const { Positive::constant(0.1) },
            area_share: const { Fraction::constant(0.4) },
        }
    }
}

impl NewtonSpec {
    /// As it takes over from another method: the path does not matter, the energy falls.
    pub(super) fn hasty(area_share: Fraction) -> Self {
        Self { area_share, path_error: Positive::ONE, ..Self::default() }
    }
}

#[typetag::serialize(name = "newton")]
impl EquilibriumSpec for NewtonSpec {
    fn name(&self) -> String {
        "linearly implicit overdamped motion, ending as Newton's method".into()
    }

    fn tolerance(&self) -> f64 {
        self.tolerance.get()
    }

    fn max_iterations(&self) -> usize {
        self.max_iterations.get()
    }

    fn linear(&self, _: &Mechanics, _: bool) -> Vec<String> {
        vec![
            "Cholesky factor of the whole Hessian in double precision, a new one every step".into(),
        ]
    }

    fn build(&self, mechanics: &Mechanics) -> Result<Box<dyn Equilibrium>, SolveError> {
        Ok(Box::new(Newton::new(mechanics, *self)?))
    }
}

crate::register_kind!(dyn EquilibriumSpec, "newton", NewtonSpec);

/// σ of the first step of a relaxation.
const FIRST: f64 = 1e-3;
/// Below this σ is taken as zero: what remains keeps rigid motions harmless.
const LEAST: f64 = 1e-10;
/// Above this no step is short enough.
const LARGEST: f64 = 1e12;
/// Most iterations within a trust region: convergence near a minimum is quadratic.
const NEAR: usize = 100;

/// Linearly implicit steps for one sheet.
pub struct Newton {
    options: NewtonSpec,
    matrix: BlockMatrix,
    cholesky: BlockCholesky,
    meters: Linear,
}

impl Newton {
    /// Prepares the sparse factorisation for the effects of `mechanics`.
    ///
    /// # Errors
    /// [`SolveError::Linear`] if the sheet is too large for one.
    pub fn new(mechanics: &Mechanics, options: NewtonSpec) -> Result<Self, SolveError> {
        let meters = Linear::of(mechanics.tally());
        let scope = meters.matrix.kept();
        let pattern = mechanics.pattern();
        drop(scope);
        let _scope = meters.factors.kept();
        Ok(Self {
            meters: meters.clone(),
            options,
            matrix: BlockMatrix::zeros(Arc::clone(pattern)),
            cholesky: BlockCholesky::new(Arc::clone(pattern))?,
        })
    }

    /// Ends it: memory is freed where it is counted.
    pub(super) fn free(self) {
        let meters = self.meters.clone();
        let _scope = meters.factors.kept();
        drop(self);
    }

    fn solve(&mut self, rhs: &mut [Vec3], update: &LowRankUpdate) {
        let _scope = self.meters.solve();
        self.cholesky.solve(rhs);
        update.correct(rhs);
    }

    /// Makes room for what is coupled at `x`.
    fn fit(&mut self, potential: &mut Potential, x: &[Vec3]) -> Result<(), SolveError> {
        let pattern = potential.pattern(x);
        if pattern != *self.matrix.pattern() {
            self.cholesky = BlockCholesky::new(Arc::clone(&pattern))?;
            self.matrix = BlockMatrix::zeros(pattern);
        }
        Ok(())
    }
}

impl Equilibrium for Newton {
    fn relax(
        &mut self,
        potential: &mut Potential,
        x: &mut [Vec3],
        goal: &Goal<'_>,
    ) -> Result<Relaxation, SolveError> {
        let n = x.len();
        let most = if goal.trust.is_some() { NEAR } else { usize::MAX };
        let goal = &Goal { max_iterations: goal.max_iterations.min(most), ..*goal };
        let mut done = Relaxation::default();
        let mut gradient = vec![Vec3::zeros(); n];
        let (mut step, mut trial) = (vec![Vec3::zeros(); n], vec![Vec3::zeros(); n]);
        let (mut after, mut defect) = (vec![Vec3::zeros(); n], vec![Vec3::zeros(); n]);
        let mut energy = potential.energy_gradient(x, &mut gradient);
        let allowed = self.options.path_error.get() * potential.metric().mean_edge();
        let mut sigma = FIRST;
        loop {
            done.residual = potential.residual(&gradient);
            done.energy = energy;
            if reached(&done, goal, x)? {
                return Ok(done);
            }
            let gauge = Gauge::new(potential, x, &gradient, goal.tolerance);
            self.fit(potential, x)?;
            potential.hessian(x, HessianPart::Full, &mut self.matrix)?;
            let terms = potential.low_rank(x, HessianPart::Full);
            let unit = self.matrix.mean_diagonal();
            let mut shifted = 0.0;
            loop {
                if (goal.interrupted)() {
                    return Err(SolveError::Interrupted);
                }
                if !(sigma < LARGEST) {
                    return Err(stalled(&done, goal));
                }
                self.matrix.add_diagonal((sigma - shifted) * unit);
                shifted = sigma;
                let scope = self.meters.factorise();
                let update = self
                    .cholesky
                    .factorise(&self.matrix)
                    .map(|()| LowRankUpdate::new(terms.clone(), |rhs| self.cholesky.solve(rhs)))
                    .ok()
                    .filter(LowRankUpdate::is_positive);
                drop(scope);
                let Some(update) = update else {
                    sigma = (8.0 * sigma).max(1e-6);
                    continue;
                };
                parallel::fill(&mut step, |i| -gradient[i]);
                gauge.project(&mut step);
                self.solve(&mut step, &update);
                gauge.project(&mut step);
                parallel::fill(&mut trial, |i| x[i] + step[i]);
                if !potential.allows(x, &trial, self.options.area_share.get()) {
                    sigma *= 8.0;
                    continue;
                }
                let e = potential.energy_gradient(&trial, &mut after);
                // Since H δ = -∂U - σ D δ, the defect is ∂U(x+δ) + σ D δ.
                let drag = sigma * unit;
                parallel::fill(&mut defect, |i| after[i] + drag * step[i]);
                gauge.project(&mut defect);
                self.solve(&mut defect, &update);
                gauge.project(&mut defect);
                let error = 0.5 * largest(&defect) / allowed;
                let descends = e <= energy || level(potential, energy, e);
                if !(e.is_finite() && descends && error <= 1.0) {
                    sigma *= (2.0 * error).clamp(4.0, 64.0);
                    continue;
                }
                x.copy_from_slice(&trial);
                std::mem::swap(&mut gradient, &mut after);
                energy = e;
                // The error of a step grows with its square; near rest with the defect itself.
                sigma *= (1.2 * error.sqrt()).clamp(0.02, 1.5);
                if sigma < LEAST {
                    sigma = LEAST;
                }
                break;
            }
            iterated(&mut done, potential);
        }
    }
}
