//! Newton's system of a branch, by mixed block elimination.
//!
//! ```text
//! [ H   b ] [ x ]   [ f ]        H = ∂²U/∂x²,  b = ∂²U/∂x∂λ,  c, d: the form of the arc length
//! [ cᵀ  d ] [ y ] = [ g ]
//! ```
//!
//! At a fold H is singular and this matrix is not. Elimination with H alone loses all digits there; done once with Hᵀ and
//! once with H, as Govaerts and Pryce do, it keeps them for as long as the factor of H is backward stable:
//!
//! ```text
//! H v* = c,  δ* = d - v*·b,   y₁ = (g - v*·f)/δ*
//! H v  = b,  δ  = d - c·v,    H w = f - b y₁,   y₂ = (g - d y₁ - c·w)/δ
//! x = w - v y₂,  y = y₁ + y₂
//! ```
//!
//! Rigid motions that nothing hinders are taken out by the gauge of relaxations (`equilibrium/gauge.rs`); terms of low
//! rank are on top of the sparse factor (`low_rank.rs`).
//!
//! Reference: Govaerts & Pryce, BIT 33 (1993) 490; Govaerts, Numerical Methods for Bifurcations of Dynamical
//! Equilibria (SIAM 2000), section 3.6, doi:10.1137/1.9780898719543.

use std::sync::Arc;

use crate::Vec3;
use crate::effects::HessianPart;
use crate::linear::{BlockLdlt, BlockMatrix, LinearError};
use crate::model::{Mechanics, Potential};
use crate::parallel;
use crate::reduction::Reduction;
use crate::solve::SolveError;
use crate::solve::equilibrium::Gauge;
use crate::solve::low_rank::LowRankUpdate;
use crate::tally::Tally;

/// The factor of H at one shape, with its terms of low rank and its gauge.
pub(super) struct Bordered {
    matrix: BlockMatrix,
    solver: BlockLdlt,
    update: LowRankUpdate,
    gauge: Gauge,
    tally: Tally,
    reduction: Reduction,
}

impl Bordered {
    /// Prepares the factorisation for the effects of `mechanics`.
    ///
    /// # Errors
    /// [`SolveError::Linear`] if the sheet is too large for one.
    pub(super) fn new(mechanics: &Mechanics) -> Result<Self, SolveError> {
        let pattern = mechanics.pattern();
        Ok(Self {
            matrix: BlockMatrix::zeros(Arc::clone(pattern)),
            solver: BlockLdlt::new(Arc::clone(pattern))?,
            update: LowRankUpdate::default(),
            gauge: Gauge::default(),
            tally: mechanics.tally().clone(),
            reduction: mechanics.sheet().reduction().clone(),
        })
    }

    /// Where its work is counted.
    pub(super) fn tally(&self) -> &Tally {
        &self.tally
    }

    /// Takes over H at `x`, where the gradient is `gradient` and counts as 0 below `tolerance`.
    ///
    /// # Errors
    /// [`SolveError::Linear`] if H is not finite, or a pivot vanishes.
    pub(super) fn factorise(
        &mut self,
        potential: &mut Potential,
        x: &[Vec3],
        (gradient, tolerance): (&[Vec3], f64),
    ) -> Result<(), SolveError> {
        self.tally.count(|work| work.factorisations += 1);
        potential.hessian(x, HessianPart::Full, &mut self.matrix)?;
        self.gauge = Gauge::new(potential, x, gradient, tolerance);
        let stiffness = self.matrix.mean_diagonal();
        self.gauge.support(&mut self.matrix, stiffness);
        self.solver.factorise(&self.matrix)?;
        let terms = potential.low_rank(x, HessianPart::Full);
        let solver = &mut self.solver;
        self.update = LowRankUpdate::new(terms, &self.reduction, |rhs| solver.solve(rhs));
        if self.update.more_negative().is_none() {
            return Err(
                LinearError::new("the Hessian with its terms of low rank is singular").into()
            );
        }
        Ok(())
    }

    /// Replaces `rhs` by the solution with H on the complement of the free rigid motions.
    fn solve(&mut self, rhs: &mut [Vec3]) {
        self.tally.count(|work| work.solves += 1);
        self.gauge.project(rhs);
        self.solver.solve(rhs);
        self.update.correct(rhs);
        self.gauge.project(rhs);
    }

    /// Solves with the border of the column `b` and the row `form`, for the right-hand side (`f`, `g`).
    pub(super) fn solve_bordered(
        &mut self,
        (b, (form, d)): (&[Vec3], (&[Vec3], f64)),
        (f, g): (&[Vec3], f64),
    ) -> (Vec<Vec3>, f64) {
        let mut c = form.to_vec();
        self.gauge.project(&mut c);
        let mut adjoint = c.clone();
        self.solve(&mut adjoint);
        let first = (g - self.reduction.dot(&adjoint, f)) / (d - self.reduction.dot(&adjoint, b));
        let mut v = b.to_vec();
        self.solve(&mut v);
        let delta = d - self.reduction.dot(&c, &v);
        let mut x = f.to_vec();
        parallel::update(&mut x, |i, x| *x -= first * b[i]);
        self.solve(&mut x);
        let second = (g - d * first - self.reduction.dot(&c, &x)) / delta;
        parallel::update(&mut x, |i, x| *x -= second * v[i]);
        (x, first + second)
    }
}
