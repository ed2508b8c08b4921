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
//! The mean of c stands for its course over the step, which is of second order too. Under
//! `chemistry-fast` c* is c_n, and a second correction gives the error estimate. The shape moves by
//! TR-BDF2 under error control (`monolithic`), the chemistry settles as in `steady`.
//!
//! where φ integrates the chemistry over Δt by the stabilised explicit method of
//! [`chebyshev`](super::chebyshev), to a fiftieth of the coupling tolerance, so that diffusion does
//! not limit Δt. `c_{n+1} - c*` estimates the error that lagging signals cause; heun keeps the
//! better value and so is of second order in the coupling. The step follows from
//!
//! ```text
//! err = RMS_k |c_{n+1} - c*|_k / (atol + rtol max|c|),   Δt_new = 0.9 Δt err^{-1/2}
//! ```
//!
//! over the points k that change noticeably in the step: a small active spot on a large quiet
//! sheet is not averaged away.
//!
//! A step is a transaction: the state changes only when the whole step has succeeded.

use serde::{Deserialize, Serialize};

use super::equilibrium::Relaxation;
use super::monolithic::InOnePiece;
use super::steady::relax_chemistry;
use super::{Integrator, IntegratorSpec, SolveError, StepReport, end_of_fixed_step};
use crate::num::checked::Positive;
use crate::state::State;
use crate::system::{SignalColumns, System};
use crate::timescale::Storage;
use crate::{Error, Result};

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
/// Tolerance of the chemistry within a step, relative to that of the coupling.
const INNER: f64 = 0.02;

/// Parameters of the staggered integrator in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StaggeredSpec {
    /// How a step is made.
    #[serde(default)]
    pub method: Method,
    /// Euler: the fixed step. Heun: the first step tried.
    #[serde(default = "default_step")]
    pub step: Positive,
    /// Longest step (heun).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub longest_step: Option<Positive>,
    /// Relative tolerance of the coupling error (heun).
    #[serde(default = "default_tolerance")]
    pub rtol: Positive,
    /// Absolute tolerance, in units of each species' typical magnitude (heun).
    #[serde(default = "default_tolerance")]
    pub atol: Positive,
}

fn positive(value: f64) -> Positive {
    Positive::new(value).unwrap_or_else(|| unreachable!("{value} is above 0"))
}

fn default_step() -> Positive {
    positive(0.01)
}

fn default_tolerance() -> Positive {
    positive(1e-2)
}

/// How a staggered step is made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Explicit Euler with a fixed step, as in the paper.
    Euler,
    /// Predict, relax, correct, with a step chosen by the error estimate.
    #[default]
    Heun,
}

#[typetag::serde(name = "staggered")]
impl IntegratorSpec for StaggeredSpec {
    fn name(&self) -> String {
        match self.method {
            Method::Euler => "staggered, Euler".into(),
            Method::Heun => "staggered, predict-relax-correct".into(),
        }
    }

    fn build(&self, policy: Storage) -> Result<Box<dyn Integrator>, SolveError> {
        Ok(Box::new(Staggered { spec: self.clone(), step: self.step.get(), policy }))
    }
}

crate::register_kind!(dyn IntegratorSpec, "staggered", StaggeredSpec);

/// The staggered integrator.
struct Staggered {
    spec: StaggeredSpec,
    step: f64,
    policy: Storage,
}

impl Integrator for Staggered {
    fn prepare(&mut self, system: &mut System, state: &mut State) -> Result<Relaxation> {
        let mut done = system.relax(state)?;
        if self.policy.chemistry == 0.0 {
            done.factorisations += relax_chemistry(system, state, self.inner())?;
        }
        Ok(done)
    }

    fn advance(
        &mut self,
        system: &mut System,
        state: &mut State,
        until: f64,
    ) -> Result<StepReport> {
        match self.spec.method {
            Method::Euler => self.euler(system, state, until),
            Method::Heun => self.heun(system, state, until),
        }
    }
}

impl Staggered {
    /// Tolerances within a step.
    fn inner(&self) -> (f64, f64) {
        match self.spec.method {
            Method::Euler => (EULER_SLACK * INNER, EULER_SLACK * INNER),
            Method::Heun => (INNER * self.spec.rtol.get(), INNER * self.spec.atol.get()),
        }
    }

    /// X: lets the shape of `next` follow from `state` while the species go to those of `next`.
    fn follow_shape(
        &self,
        system: &mut System,
        state: &State,
        next: &mut State,
    ) -> Result<Relaxation> {
        if self.policy.mechanics == 0.0 {
            return system.relax(next);
        }
        if !system.moves() {
            system.follow(next)?;
            return Ok(Relaxation::default());
        }
        let mut moving = state.clone();
        for (c, to) in moving.species.iter_mut().zip(&next.species) {
            for (c, to) in c.iter_mut().zip(to) {
                *c = 0.5 * (*c + to);
            }
        }
        let mut mover = InOnePiece::of_shape(self.policy, self.inner());
        let mut done = Relaxation::default();
        while moving.time < next.time {
            done.add(&mover.advance(system, &mut moving, next.time)?.relaxation);
        }
        next.x = moving.x;
        system.follow(next)?;
        done.residual = system.residual(next);
        Ok(done)
    }

    fn euler(&self, system: &mut System, state: &mut State, until: f64) -> Result<StepReport> {
        let time = end_of_fixed_step(state.time, self.step, until);
        let step = time - state.time;
        let mut next = state.clone();
        if self.policy.chemistry > 0.0 {
            let signals = system.signals(state);
            let rates = system.rates(&state.species, &signals)?;
            for (species, rate) in next.species.iter_mut().zip(&rates) {
                for (c, r) in species.iter_mut().zip(rate) {
                    *c += step * r;
                }
            }
        }
        next.time = time;
        next.step += 1;
        system.keep_in_range(&mut next.species, time, (EULER_SLACK, EULER_SLACK))?;
        let mut relaxation = self.follow_shape(system, state, &mut next)?;
        if self.policy.chemistry == 0.0 {
            relaxation.factorisations += relax_chemistry(system, &mut next, self.inner())?;
        }
        *state = next;
        Ok(StepReport { step, relaxation, ..StepReport::default() })
    }

    fn heun(&mut self, system: &mut System, state: &mut State, until: f64) -> Result<StepReport> {
        let longest = self.spec.longest_step.map_or(f64::INFINITY, Positive::get);
        let shortest = SHORTEST * self.spec.step.get();
        let now = system.signals(state);
        let mut report = StepReport::default();
        loop {
            let proposed = self.step.min(longest);
            let time = end_of_step(state.time, proposed, until);
            let step = time - state.time;
            match self.try_heun(system, state, &now, time, &mut report) {
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
                Err(error) if error.may_vanish_with_the_step() => {
                    self.step = step / (GROWTH * GROWTH);
                    if self.step < shortest {
                        return Err(error);
                    }
                }
                Err(error) => return Err(error),
            }
            report.rejected += 1;
            if self.step < shortest {
                let error = SolveError::StepTooSmall { time: state.time, step: self.step };
                return Err(Error::Solve(error));
            }
        }
    }

    /// One try; the error estimate in units of the tolerance, and the state if that is at most 1.
    fn try_heun(
        &self,
        system: &mut System,
        state: &State,
        now: &SignalColumns,
        time: f64,
        report: &mut StepReport,
    ) -> Result<(State, f64)> {
        let (rtol, atol) = (self.spec.rtol.get(), self.spec.atol.get());
        let inner = self.inner();
        // The transport still follows the shape of the last try; bring it back.
        system.follow(state)?;
        let mut next = state.clone();
        next.time = time;
        next.step += 1;
        if self.policy.chemistry == 0.0 {
            return self.try_settling(system, state, next, report);
        }
        next.species = system.advance_chemistry(state, time, now, now, inner)?;
        system.keep_in_range(&mut next.species, time, (rtol, atol))?;
        let predicted = next.species.clone();
        report.relaxation.add(&self.follow_shape(system, state, &mut next)?);
        let then = system.signals(&next);
        next.species = system.advance_chemistry(state, time, now, &then, inner)?;
        system.keep_in_range(&mut next.species, time, (rtol, atol))?;
        let error = system.coupling_error(state, &predicted, &next.species, (rtol, atol), QUIET);
        if error <= 1.0 {
            report.relaxation.add(&self.follow_shape(system, state, &mut next)?);
        }
        Ok((next, error))
    }

    /// The same where the chemistry settles at once: shape, chemistry, and both once more.
    fn try_settling(
        &self,
        system: &mut System,
        state: &State,
        mut next: State,
        report: &mut StepReport,
    ) -> Result<(State, f64)> {
        let tolerance = (self.spec.rtol.get(), self.spec.atol.get());
        report.relaxation.add(&self.follow_shape(system, state, &mut next)?);
        report.relaxation.factorisations += relax_chemistry(system, &mut next, self.inner())?;
        let predicted = next.species.clone();
        report.relaxation.add(&self.follow_shape(system, state, &mut next)?);
        report.relaxation.factorisations += relax_chemistry(system, &mut next, self.inner())?;
        let error = system.coupling_error(state, &predicted, &next.species, tolerance, QUIET);
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
