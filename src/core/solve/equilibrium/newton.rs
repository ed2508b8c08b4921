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
use super::preconditioner::Preconditioner;
use super::stop::{FORCE_FLOOR, iterated, reached, same_energy, stalled};
use super::{Equilibrium, ForceTolerance, Goal, Relaxation, is_flat};
use crate::Vec3;
use crate::effects::{HessianPart, RankOneTerm};
use crate::linear::{BlockCholesky, BlockMatrix, BlockPattern, LinearError, LinearSolver};
use crate::model::{Mechanics, Potential};

use crate::num::checked::{AtLeast, Fraction, Positive};
use crate::num::real;
use crate::parallel;
use crate::reduction::Reduction;
use crate::solve::{EquilibriumSpec, SolveError};

/// Settings of [`Newton`]; parameters of `equilibrium.method = "newton"` in a scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NewtonSpec {
    /// Largest force on a vertex that counts as rest.
    pub tolerance: ForceTolerance,
    /// Steps after which a relaxation has failed.
    pub max_iterations: AtLeast<1>,
    /// Largest distance of a vertex from the overdamped path in one step, in mean edge lengths.
    pub path_error: Positive,
    /// No triangle's area may fall below this share in one step.
    pub area_share: Fraction,
    /// How linear systems are solved: `factor`, or a registered solver that detects matrices that are not positive.
    pub linear_solver: Preconditioner,
}

impl Default for NewtonSpec {
    fn default() -> Self {
        Self {
            tolerance: ForceTolerance::Auto,
            max_iterations: const { AtLeast::constant(1000) },
            path_error: const { Positive::constant(0.1) },
            area_share: const { Fraction::constant(0.4) },
            linear_solver: Preconditioner::Factor,
        }
    }
}

impl NewtonSpec {
    /// As it takes over from another method: the path does not matter, the energy falls.
    pub(super) fn for_fallback(area_share: Fraction) -> Self {
        Self { area_share, path_error: Positive::ONE, ..Self::default() }
    }
}

#[typetag::serialize(name = "newton")]
impl EquilibriumSpec for NewtonSpec {
    fn name(&self) -> String {
        "linearly implicit overdamped motion, ending as Newton's method".into()
    }

    fn tolerance(&self) -> ForceTolerance {
        self.tolerance
    }

    fn max_iterations(&self) -> usize {
        self.max_iterations.get()
    }

    fn build(&self, mechanics: &Mechanics) -> Result<Box<dyn Equilibrium>, SolveError> {
        Ok(Box::new(Newton::new(mechanics, *self)?))
    }
}

crate::register_kind!(dyn EquilibriumSpec, "newton", NewtonSpec);

/// σ of the first step of a relaxation.
const INITIAL_SHIFT: f64 = 1e-3;
/// Below this σ is taken as zero: what remains keeps rigid motions harmless.
const MIN_SHIFT: f64 = 1e-10;
/// Above this no step is short enough.
const MAX_SHIFT: f64 = 1e12;
/// Most iterations within a trust region: convergence near a minimum is quadratic.
const MAX_NEAR_ITERATIONS: usize = 100;
/// Most iterations at forces below the tolerance where displacements are bounded as well.
const MAX_AT_REST_ITERATIONS: usize = 20;
/// Iterations for the soft modes of a saddle.
const INVERSE_ITERATIONS: usize = 12;
/// A share of a step as small as this leaves the trust region.
const BLOCKED_STEP_SHARE: f64 = 0.02;

/// The solver of this name for `pattern`.
fn analysed(
    solver: Preconditioner,
    pattern: &Arc<BlockPattern>,
) -> Result<Box<dyn LinearSolver>, LinearError> {
    let solver: Box<dyn LinearSolver> = match solver {
        Preconditioner::Factor | Preconditioner::Auto => {
            Box::new(BlockCholesky::new(Arc::clone(pattern))?)
        }
        other => other.registered(pattern)?,
    };
    match solver.detects_indefinite() {
        true => Ok(solver),
        false => Err(LinearError::new(
            "newton needs a linear solver that detects matrices that are not positive \
             (LinearSolver::detects_indefinite), such as `factor`",
        )),
    }
}

/// Linearly implicit steps for one sheet.
pub struct Newton {
    options: NewtonSpec,
    matrix: BlockMatrix,
    solver: Box<dyn LinearSolver>,
    meters: Linear,
}

impl Newton {
    /// Prepares the sparse factorisation for the effects of `mechanics`.
    ///
    /// # Errors
    /// [`SolveError::Linear`] if the sheet is too large for one.
    pub fn new(mechanics: &Mechanics, options: NewtonSpec) -> Result<Self, SolveError> {
        let meters = Linear::from_tally(mechanics.tally());
        let scope = meters.matrix.uncounted_scope();
        let pattern = mechanics.pattern();
        drop(scope);
        let _scope = meters.factors.uncounted_scope();
        Ok(Self {
            meters: meters.clone(),
            options,
            matrix: BlockMatrix::zeros(Arc::clone(pattern)),
            solver: analysed(options.linear_solver, pattern)?,
        })
    }

    /// Ends it: memory is freed where it is counted.
    pub(super) fn free(self) {
        let meters = self.meters.clone();
        let _scope = meters.factors.uncounted_scope();
        drop(self);
    }

    fn solve(&mut self, rhs: &mut [Vec3], update: &LowRankUpdate) {
        let _scope = self.meters.solve();
        self.solver.solve(rhs);
        update.correct(rhs);
    }

    /// The same with what `gauge` fixes taken out before and after.
    fn solve_in(&mut self, gauge: &Gauge, rhs: &mut [Vec3], update: &LowRankUpdate) {
        gauge.project(rhs);
        self.solve(rhs, update);
        gauge.project(rhs);
    }

    /// The whole Hessian at `x` and its terms of low rank; returns the mean diagonal.
    fn set_hessian(
        &mut self,
        potential: &mut Potential,
        x: &[Vec3],
    ) -> Result<(f64, Vec<RankOneTerm>), SolveError> {
        self.fit(potential, x)?;
        potential.hessian(x, HessianPart::Full, &mut self.matrix)?;
        Ok((self.matrix.mean_diagonal(), potential.low_rank(x, HessianPart::Full)))
    }

    /// The factor of the matrix with `terms`, if it is positive.
    fn factorise(&mut self, reduction: &Reduction, terms: &[RankOneTerm]) -> Option<LowRankUpdate> {
        let _scope = self.meters.factorise();
        let made = self.solver.factorise(&self.matrix, &[], false);
        if !reduction.all(made.is_ok()) {
            return None;
        }
        let update = LowRankUpdate::new(terms.to_vec(), reduction, |rhs| self.solver.solve(rhs));
        update.is_positive().then_some(update)
    }

    /// Makes room for what is coupled at `x`.
    fn fit(&mut self, potential: &mut Potential, x: &[Vec3]) -> Result<(), SolveError> {
        let pattern = potential.pattern(x);
        if pattern != *self.matrix.pattern() {
            self.solver = analysed(self.options.linear_solver, &pattern)?;
            self.matrix = BlockMatrix::zeros(pattern);
        }
        Ok(())
    }
}

/// The shape of a relaxation and its gradient, with room for a trial step.
struct Iterate<'a> {
    x: &'a mut [Vec3],
    energy: f64,
    gradient: Vec<Vec3>,
    step: Vec<Vec3>,
    trial: Vec<Vec3>,
    after: Vec<Vec3>,
    defect: Vec<Vec3>,
}

/// What became of one linearly implicit step.
enum Tried {
    /// It is taken.
    Taken,
    /// It is taken, and leads to a minimum.
    Last,
    /// The shape is at rest already.
    AtRest,
}

impl<'a> Iterate<'a> {
    fn new(potential: &mut Potential, x: &'a mut [Vec3]) -> Self {
        let none = vec![Vec3::zeros(); x.len()];
        let mut gradient = none.clone();
        let energy = potential.energy_gradient(x, &mut gradient);
        let [step, trial, after, defect] = [none.clone(), none.clone(), none.clone(), none];
        Self { x, energy, gradient, step, trial, after, defect }
    }

    /// The share of the step δ that the trust region and the effects allow; none where it leaves the region at once.
    fn longest(&self, potential: &mut Potential, goal: &Goal<'_>, balanced: bool) -> Option<f64> {
        let mut length = 1.0;
        if let Some(trust) = goal.trust.filter(|_| balanced) {
            length = trust.longest(self.x, &self.step, length, potential.reduction());
            if length < BLOCKED_STEP_SHARE {
                return None;
            }
        }
        if potential.mechanics().limits_steps() {
            let whole: Vec<Vec3> = self.step.iter().map(|d| length * d).collect();
            length *= potential.largest_step(self.x, &whole);
        }
        Some(length)
    }

    /// The defect of the share s = `length` of δ: since H δ = -∂U - σ D δ it is ∂U(x + sδ) + s σ D δ - (1 - s) ∂U, with
    /// s σ D = `drag`.
    fn set_defect(&mut self, length: f64, drag: f64) {
        let Self { step, after, gradient, defect, .. } = self;
        parallel::fill(defect, |i| after[i] + drag * step[i] - (1.0 - length) * gradient[i]);
    }

    /// Takes over the trial shape, of energy `energy`.
    fn accept(&mut self, energy: f64) {
        self.x.copy_from_slice(&self.trial);
        std::mem::swap(&mut self.gradient, &mut self.after);
        self.energy = energy;
    }
}

impl Newton {
    /// One step from `at`, with σ as large as it needs. Where forces are `balanced` it may find that the shape is at a
    /// minimum.
    fn step(
        &mut self,
        potential: &mut Potential,
        at: &mut Iterate<'_>,
        (goal, done): (&Goal<'_>, &Relaxation),
        sigma: &mut f64,
        balanced: bool,
    ) -> Result<Tried, SolveError> {
        let gauge = Gauge::for_relaxation(potential, at.x, &at.gradient, goal);
        let (unit, terms) = self.set_hessian(potential, at.x)?;
        let (mut shifted, mut saddle) = (0.0, false);
        loop {
            if (goal.interrupted)() {
                return Err(SolveError::Interrupted);
            }
            if !(*sigma < MAX_SHIFT) {
                return Err(stalled(done, goal));
            }
            self.matrix.add_diagonal((*sigma - shifted) * unit);
            shifted = *sigma;
            let Some(update) = self.factorise(potential.reduction(), &terms) else {
                saddle |= balanced && *sigma <= MIN_SHIFT;
                *sigma = (8.0 * *sigma).max(1e-6);
                continue;
            };
            if saddle && self.leave_saddle(potential, at, goal, (&gauge, &update)) {
                return Ok(Tried::Taken);
            }
            parallel::fill(&mut at.step, |i| -at.gradient[i]);
            self.solve_in(&gauge, &mut at.step, &update);
            // The last step is taken all the same: what is left then is far less.
            let far_off = potential.reduction().largest(&at.step);
            let last = balanced && *sigma <= MIN_SHIFT && far_off <= goal.distance_tolerance;
            // Forces that lead out of the trust region and are as small as this tell no direction.
            let Some(length) = at.longest(potential, goal, balanced) else {
                return Ok(Tried::AtRest);
            };
            parallel::fill(&mut at.trial, |i| at.x[i] + length * at.step[i]);
            if !potential.keeps_triangles(at.x, &at.trial, self.options.area_share.get(), 0.0) {
                *sigma *= 8.0;
                continue;
            }
            let e = potential.energy_gradient(&at.trial, &mut at.after);
            at.set_defect(length, length * *sigma * unit);
            self.solve_in(&gauge, &mut at.defect, &update);
            let allowed = self.options.path_error.get() * potential.metric().mean_edge();
            let error = 0.5 * potential.reduction().largest(&at.defect) / allowed;
            let descends = e <= at.energy || same_energy(potential, at.energy, e);
            if e.is_finite() && descends && error <= 1.0 {
                at.accept(e);
                // The error of a step grows with its square; near rest with the defect itself.
                *sigma = (*sigma * (1.2 * error.sqrt()).clamp(0.02, 1.5)).max(MIN_SHIFT);
                return Ok(if last { Tried::Last } else { Tried::Taken });
            }
            if last {
                return Ok(Tried::AtRest);
            }
            *sigma *= (2.0 * error).clamp(4.0, 64.0);
        }
    }
}

impl Newton {
    /// Moves `at`, a saddle, along soft modes to a lower energy, by the displacement that no longer counts as rest; by
    /// inverse iteration with the factor of H + σ D. On a path only; a perfectly flat sheet stays flat.
    fn leave_saddle(
        &mut self,
        potential: &mut Potential,
        at: &mut Iterate<'_>,
        goal: &Goal<'_>,
        (gauge, update): (&Gauge, &LowRankUpdate),
    ) -> bool {
        if goal.trust.is_none() || is_flat(at.x, potential.reduction()) {
            return false;
        }
        let mode = &mut at.step;
        parallel::fill(mode, noise);
        for _ in 0..INVERSE_ITERATIONS {
            gauge.project(mode);
            self.solve(mode, update);
            let scale = 1.0 / potential.reduction().largest(mode);
            parallel::update(mode, |_, v| *v *= scale);
        }
        gauge.project(mode);
        let downhill = if potential.reduction().dot(&at.gradient, mode) > 0.0 { -1.0 } else { 1.0 };
        for sign in [downhill, -downhill] {
            let far = sign * goal.distance_tolerance;
            parallel::fill(&mut at.trial, |i| at.x[i] + far * at.step[i]);
            if potential.allows(at.x, &at.trial, self.options.area_share.get()) {
                let e = potential.energy_gradient(&at.trial, &mut at.after);
                if e < at.energy && !same_energy(potential, at.energy, e) {
                    at.accept(e);
                    return true;
                }
            }
        }
        false
    }
}

/// A vector with no symmetry of any sheet, the same for the same vertex: fractional parts of multiples of
/// irrational numbers.
fn noise(i: usize) -> Vec3 {
    let i = real(i + 1);
    Vec3::new(i * 2.0_f64.sqrt(), i * 3.0_f64.sqrt(), i * 5.0_f64.sqrt()).map(|v| v.fract() - 0.5)
}

impl Equilibrium for Newton {
    fn relax(
        &mut self,
        potential: &mut Potential,
        x: &mut [Vec3],
        goal: &Goal<'_>,
    ) -> Result<Relaxation, SolveError> {
        let most = if goal.trust.is_some() { MAX_NEAR_ITERATIONS } else { usize::MAX };
        let goal = &Goal { max_iterations: goal.max_iterations.min(most), ..*goal };
        let mut done = Relaxation::default();
        let mut at = Iterate::new(potential, x);
        let mut sigma = INITIAL_SHIFT;
        // Iterations with forces below the tolerance.
        let mut rested = 0;
        loop {
            done.residual = potential.residual(&at.gradient);
            done.energy = at.energy;
            let balanced = reached(potential, &done, goal, at.x)?;
            // Forces as small as none tell nothing about a saddle.
            let exact = rested >= MAX_AT_REST_ITERATIONS
                || rested > 0 && done.residual <= FORCE_FLOOR * goal.tolerance
                || done.iterations >= goal.max_iterations;
            if balanced && (exact || goal.distance_tolerance == f64::INFINITY) {
                return Ok(done);
            }
            if balanced && rested == 0 {
                // Whether it is a minimum, and how far that is, the Hessian alone says.
                sigma = MIN_SHIFT;
            }
            rested += usize::from(balanced);
            match self.step(potential, &mut at, (goal, &done), &mut sigma, balanced) {
                Ok(Tried::AtRest) => return Ok(done),
                Ok(Tried::Taken) => iterated(&mut done, potential),
                Ok(Tried::Last) => {
                    iterated(&mut done, potential);
                    done.residual = potential.residual(&at.gradient);
                    done.energy = at.energy;
                    return Ok(done);
                }
                // The forces are below the tolerance.
                Err(SolveError::Stalled { .. }) if balanced => return Ok(done),
                Err(error) => return Err(error),
            }
        }
    }

    fn is_minimum(&mut self, potential: &mut Potential, x: &[Vec3]) -> Option<bool> {
        let (unit, terms) = self.set_hessian(potential, x).ok()?;
        let mut gradient = vec![Vec3::zeros(); x.len()];
        potential.energy_gradient(x, &mut gradient);
        let gauge = Gauge::new(potential, x, &gradient, self.options.tolerance.on(potential));
        gauge.support(&mut self.matrix, unit);
        self.matrix.add_diagonal(MIN_SHIFT * unit);
        Some(self.factorise(potential.reduction(), &terms).is_some())
    }
}
