//! Staggered coupling: one after the other, each with what the other last gave.
//!
//! One step from `(c_n, x_n)` with signals `s_n = s(x_n)`:
//!
//! ```text
//! euler (the paper's)   c_{n+1} = c_n + Δt F(c_n, s_n);   x_{n+1} = X(c_{n+1})
//! heun                  c*      = C(c_n; s ≡ s_n)                       predict
//!                       s*      = s(X(c*))
//!                       c_{n+1} = C(c_n; s from s_n to s* linearly)     correct
//!                       x_{n+1} = X(c_{n+1})
//! ```
//!
//! What X and C are is up to the policy:
//!
//! ```text
//!                   X(c), the shape                               C, the chemistry
//! quasi-static      in equilibrium with c                         φ, integrated over Δt
//! simultaneous      drag dx/dt = -∂U/∂x over Δt at (c_n + c)/2    φ, integrated over Δt
//! chemistry-fast    as simultaneous                               steady at the last shape
//! ```
//!
//! X sees the species go from c_n to c along a straight line, as C sees the signals; diffusion has
//! the shape half way. Under `chemistry-fast` c* is c_n, and a second correction gives the error
//! estimate. A shape with storage moves by TR-BDF2 under error control (`monolithic`), the
//! chemistry is solved for its steady state as in `chemistry::steady`.
//!
//! φ integrates the chemistry over Δt by a method of [`chemistry`](super::chemistry), to a tolerance
//! such that its error is a small share of the coupling tolerance, whatever that is: unless the scene
//! chooses another, the stabilised explicit one, so that diffusion does not limit Δt. What the second round changes estimates the error that lagging
//! signals cause, in the species and, where the shape has storage, in the shape; heun keeps the
//! better values and so is of second order in the coupling. The step follows from
//!
//! ```text
//! err = RMS_k |c_{n+1} - c*|_k / (atol + rtol max|c|),   Δt_new = 0.9 Δt err^{-1/2}
//!       RMS_i |x_{n+1} - x*|_i / (atol edge + rtol max|x - X|)                         the larger
//! ```
//!
//! over the points k and vertices i that change noticeably in the step: a small active spot on a
//! large quiet sheet is not averaged away.
//!
//! A step is a transaction: the state changes only when the whole step has succeeded.

mod spec;

pub use spec::{Method, StaggeredSpec};

use super::chemistry::{ChemistryMethod, ChemistrySteps, SteadyChemistry};
use super::equilibrium::Relaxation;
use super::monolithic::Monolithic;
use super::{Integrator, Result, SolveError, StepReport, Workspace, end_of_fixed_step, under_way};
use crate::model::{Part, SignalColumns, State, Storage, TimeCourse};
use crate::num::checked::Positive;
use crate::ode::OdeMethod;

/// Growth of the step is limited to this factor, shrinking to its inverse squared.
const GROWTH: f64 = 2.0;
/// Steps are proposed a little shorter than the estimate allows.
const SAFETY: f64 = 0.9;
/// A step that must become shorter than this share of the first one gives up.
const SHORTEST: f64 = 1e-7;
/// Points that change by less than this share of the tolerance do not count in the mean.
const QUIET: f64 = 0.1;
/// How far a fixed step may leave a species' valid range and be brought back, relative to its size
/// and typical magnitude. A step that leaves it further is too long, and no error estimate says so.
const EULER_SLACK: f64 = 1e-2;
/// Tolerance of the chemistry within a step, relative to that of the coupling where this is [`USUAL`].
const INNER: f64 = 0.02;
/// The same of a shape that moves under drag: its solution is costly.
const INNER_OF_SHAPE: f64 = 0.1;
/// The tolerance that a scene has if it gives none.
const USUAL: f64 = 1e-2;
/// Tolerances within a step are not above this share of that of the coupling,
const LOOSEST_INNER: f64 = 0.2;
/// nor, relative to the solution, below this: rounding would not let a step meet them.
const FINEST_INNER: f64 = 1e-13;

/// The staggered integrator.
struct Staggered {
    spec: StaggeredSpec,
    chemistry: ChemistrySteps,
    /// [`ChemistryMethod::power`] of the chemistry's method.
    power: f64,
    step: f64,
    /// Moves a shape with storage.
    mover: Option<Monolithic>,
    /// Solves for the steady state of a chemistry without storage.
    steady: SteadyChemistry,
    policy: Storage,
}

impl Integrator for Staggered {
    fn prepare(&mut self, workspace: &mut Workspace, state: &mut State) -> Result<Relaxation> {
        let mut done = workspace.relax(state)?;
        if self.policy.chemistry == 0.0 {
            let inner = self.inner();
            done.factorisations += self.steady.solve(workspace, state, inner)?;
        }
        Ok(done)
    }

    fn advance(
        &mut self,
        workspace: &mut Workspace,
        state: &mut State,
        until: f64,
    ) -> Result<StepReport> {
        match self.spec.method {
            Method::Euler => self.euler(workspace, state, until),
            Method::Heun => self.heun(workspace, state, until),
        }
    }
}

impl Staggered {
    /// Tolerances of the chemistry within a step.
    fn inner(&self) -> (f64, f64) {
        self.inner_of(INNER, self.power)
    }

    /// Tolerances within a step for a method whose error falls with this power of them, so that the
    /// error is proportional to the tolerance of the coupling.
    fn inner_of(&self, share: f64, power: f64) -> (f64, f64) {
        let (rtol, atol) = match self.spec.method {
            Method::Euler => return (EULER_SLACK * share, EULER_SLACK * share),
            Method::Heun => (self.spec.rtol.get(), self.spec.atol.get()),
        };
        let share = share * (rtol / USUAL).powf(1.0 / power - 1.0);
        let share = share.max(FINEST_INNER / rtol).min(LOOSEST_INNER);
        (share * rtol, share * atol)
    }

    /// X: lets the shape of `next` follow from `state` while the species go to those of `next`.
    fn follow_shape(
        &mut self,
        workspace: &mut Workspace,
        state: &State,
        next: &mut State,
    ) -> Result<Relaxation> {
        if self.policy.mechanics == 0.0 {
            return workspace.relax(next);
        }
        if !workspace.model.moves() {
            return Ok(Relaxation::default());
        }
        let mut moving = state.clone();
        let course =
            TimeCourse::new((state.time, state.species.clone()), (next.time, next.species.clone()));
        let inner = self.inner_of(INNER_OF_SHAPE, ChemistryMethod::TrBdf2.power());
        let mover = self
            .mover
            .get_or_insert_with(|| Monolithic::of_part(Part::Shape, OdeMethod::TrBdf2, inner));
        mover.set_course(course);
        let mut done = Relaxation::default();
        while moving.time < next.time {
            let span = (state.time, moving.time, next.time);
            workspace.control.report(|| under_way("moving the shape", span));
            done.add(&mover.step(workspace, &mut moving, next.time)?.relaxation);
        }
        next.x = moving.x;
        done.residual = workspace.at(next).residual()?;
        Ok(done)
    }

    fn euler(
        &mut self,
        workspace: &mut Workspace,
        state: &mut State,
        until: f64,
    ) -> Result<StepReport> {
        let time = end_of_fixed_step(state.time, self.step, until);
        let step = time - state.time;
        let mut next = state.clone();
        if self.policy.chemistry > 0.0 {
            let signals = TimeCourse::still(workspace.at(state).signals()?.clone());
            let inner = self.inner();
            next.species = self.chemistry.advance(workspace, state, time, signals, inner)?;
        }
        next.time = time;
        next.step += 1;
        let slack = (EULER_SLACK, EULER_SLACK);
        workspace.model.keep_in_range(&mut next.species, time, slack)?;
        let mut relaxation = self.follow_shape(workspace, state, &mut next)?;
        if self.policy.chemistry == 0.0 {
            let inner = self.inner();
            relaxation.factorisations += self.steady.solve(workspace, &mut next, inner)?;
        }
        *state = next;
        Ok(StepReport { step, relaxation, ..StepReport::default() })
    }

    fn heun(
        &mut self,
        workspace: &mut Workspace,
        state: &mut State,
        until: f64,
    ) -> Result<StepReport> {
        let longest = self.spec.longest_step.map_or(f64::INFINITY, Positive::get);
        let shortest = SHORTEST * self.spec.step.get();
        let now = workspace.at(state).signals()?.clone();
        let mut report = StepReport::default();
        loop {
            let proposed = self.step.min(longest);
            let time = end_of_step(state.time, proposed, until);
            let step = time - state.time;
            match self.try_heun(workspace, state, &now, time, &mut report) {
                Ok((next, error)) if error <= 1.0 => {
                    *state = next;
                    report.step = step;
                    report.error = error;
                    let limit = if report.rejected > 0 { 1.0 } else { GROWTH };
                    let factor = (SAFETY / error.sqrt()).min(limit);
                    // A step cut short by an output time says nothing against longer ones.
                    self.step = (step * factor).max(if factor >= 1.0 { proposed } else { 0.0 });
                    return Ok(report);
                }
                Ok((_, error)) => {
                    let factor = (SAFETY / error.sqrt()).clamp(1.0 / (GROWTH * GROWTH), SAFETY);
                    self.step = step * factor;
                }
                Err(error) if error.is_recoverable() => {
                    self.step = step / (GROWTH * GROWTH);
                    if self.step < shortest {
                        return Err(error);
                    }
                    report.reason = Some(error.to_string());
                }
                Err(error) => return Err(error),
            }
            report.rejected += 1;
            if self.step < shortest {
                return Err(SolveError::StepTooSmall { time: state.time, step: self.step });
            }
        }
    }

    /// One try; the error estimate in units of the tolerance, and the state if that is at most 1.
    fn try_heun(
        &mut self,
        workspace: &mut Workspace,
        state: &State,
        now: &SignalColumns,
        time: f64,
        report: &mut StepReport,
    ) -> Result<(State, f64)> {
        let tolerance = (self.spec.rtol.get(), self.spec.atol.get());
        let inner = self.inner();
        let mut next = state.clone();
        next.time = time;
        next.step += 1;
        if self.policy.chemistry == 0.0 {
            return self.try_steady(workspace, state, next, report);
        }
        let frozen = TimeCourse::still(now.clone());
        next.species = self.chemistry.advance(workspace, state, time, frozen, inner)?;
        workspace.model.keep_in_range(&mut next.species, time, tolerance)?;
        report.relaxation.add(&self.follow_shape(workspace, state, &mut next)?);
        let predicted = next.clone();
        let later = workspace.at(&next).signals()?.clone();
        let signals = TimeCourse::new((state.time, now.clone()), (time, later));
        let mut on = state.clone();
        if workspace.model.diffuses() {
            on.x.iter_mut().zip(&next.x).for_each(|(a, b)| *a = 0.5 * (*a + b));
        }
        next.species = self.chemistry.advance(workspace, &on, time, signals, inner)?;
        let model = &workspace.model;
        model.keep_in_range(&mut next.species, time, tolerance)?;
        let error = model.coupling_error(state, &predicted, &next, tolerance, QUIET);
        if error > 1.0 {
            return Ok((next, error));
        }
        report.relaxation.add(&self.follow_shape(workspace, state, &mut next)?);
        let error = error.max(self.shape_error(workspace, state, &predicted, &next));
        Ok((next, error))
    }

    /// The same of the shape, where it has storage: there it may move while the species hardly do.
    fn shape_error(&self, workspace: &Workspace, state: &State, a: &State, b: &State) -> f64 {
        if self.policy.mechanics == 0.0 {
            return 0.0;
        }
        let tolerance = (self.spec.rtol.get(), self.spec.atol.get());
        workspace.model.shape_error(state, a, b, tolerance, QUIET)
    }

    /// The same where the chemistry is in steady state at every time: shape, chemistry, and both once more.
    fn try_steady(
        &mut self,
        workspace: &mut Workspace,
        state: &State,
        mut next: State,
        report: &mut StepReport,
    ) -> Result<(State, f64)> {
        let tolerance = (self.spec.rtol.get(), self.spec.atol.get());
        let inner = self.inner();
        report.relaxation.add(&self.follow_shape(workspace, state, &mut next)?);
        report.relaxation.factorisations += self.steady.solve(workspace, &mut next, inner)?;
        let predicted = next.clone();
        report.relaxation.add(&self.follow_shape(workspace, state, &mut next)?);
        report.relaxation.factorisations += self.steady.solve(workspace, &mut next, inner)?;
        let model = &workspace.model;
        let error = model.coupling_error(state, &predicted, &next, tolerance, QUIET);
        let error = error.max(self.shape_error(workspace, state, &predicted, &next));
        Ok((next, error))
    }
}

/// End of a step that does not pass `until`; the last two steps before it share the way.
fn end_of_step(time: f64, step: f64, until: f64) -> f64 {
    let left = until - time;
    if step >= left * (1.0 - 1e-12) {
        until
    } else if 2.0 * step > left {
        time + 0.5 * left
    } else {
        time + step
    }
}
