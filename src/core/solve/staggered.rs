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
//! quasi-static      as simultaneous under a small drag, then rest φ, integrated over Δt
//! simultaneous      drag dx/dt = -∂U/∂x over Δt at (c_n + c)/2    φ, integrated over Δt
//! chemistry-fast    as simultaneous                               steady at the last shape
//! ```
//!
//! X sees the species go from c_n to c along a straight line, as C sees the signals; diffusion has
//! the shape half way. The shape moves by minimisations (`incremental_potential`), once a step, along c*: what the species
//! then change matters to slow waves in higher order only; the last stage is solved again with c_{n+1}. `quasi_static` says
//! what the small drag is. Under `chemistry-fast` c* is c_n, and a second correction gives the error estimate; the chemistry is solved for
//! its steady state as in `chemistry::steady`.
//!
//! φ integrates the chemistry over Δt by a method of [`chemistry`](super::chemistry), to a tolerance
//! such that its error is a small share of the coupling tolerance, whatever that is: unless the scene
//! chooses another, the stabilised explicit one, so that diffusion does not limit Δt. What the second round changes estimates the error that lagging
//! signals cause, in the species and in the shape; heun keeps the
//! better values and so is of second order in the coupling. The step follows from
//!
//! ```text
//! err = ‖c_{n+1} - c*‖ / ((atol typical + rtol max|c|) √n),   Δt_new = 0.9 Δt err^{-1/2}
//!       ‖x_{n+1} - x*‖ / ((atol edge + rtol max|x - X|) √n)                             the larger
//! ```
//!
//! with n the number of points that carry the pattern or change ([`Model::species_misfit`](crate::model::Model::species_misfit)).
//!
//! Internal variables of effects ([`InternalVariables`](crate::effects::InternalVariables)) go as the species do: predicted on the shape
//! x_n, corrected on the straight line from x_n to x*, by the stabilised explicit method; their correction is part of err,
//! in units of `atol typical + rtol max|q - q_0|`.
//!
//! A step is a transaction: the state changes only when the whole step has succeeded.

mod growth;
mod quasi_static;
mod spec;
mod steady;
mod step_size;

use spec::{DEFAULT_TOLERANCE, Growth, Stabilised, Staggered};
pub use spec::{Method, StaggeredSpec};
use step_size::{HOPELESS_ERROR, MAX_STEP_GROWTH, shortening};

use serde::{Deserialize, Serialize};

use super::chemistry::{ChemistryMethod, Leap};
use super::equilibrium::Relaxation;
use super::incremental_potential::{MotionMethod, Stepping};
use super::rejections::{Cause, Rejection};
use super::route::Route;
use super::workspace::DISTANCE_TOLERANCE;
use super::{
    Integrator, Result, SolveError, StepReport, Workspace, end_of_fixed_step, end_of_step,
};
use crate::Vec3;
use crate::model::{LinearInTime, SignalColumns, State};
use crate::record::{Malformed, Record};

/// Stages of a step are solved as for an error of at least this share of the tolerance.
const MIN_ERROR: f64 = 1e-3;
/// A step that must become shorter than this share of the first one gives up.
const SHORTEST_STEP: f64 = 1e-7;
/// How far a fixed step may leave a species' valid range and be brought back, relative to its size
/// and typical magnitude. A step that leaves it further is too long, and no error estimate detects it.
const EULER_SLACK: f64 = 1e-2;
/// Tolerance of the chemistry within a step, relative to that of the coupling where this is [`DEFAULT_TOLERANCE`].
const CHEMISTRY_TOLERANCE_SHARE: f64 = 0.02;
/// Tolerances within a step are not above this share of that of the coupling,
const LOOSEST_CHEMISTRY_TOLERANCE: f64 = 0.2;
/// nor, relative to the solution, below this: rounding would not let a step meet them.
const FINEST_CHEMISTRY_TOLERANCE: f64 = 1e-13;

/// Steps after which a run rebuilds integrators of diffsol, to be continued from there. They restart in
/// every step anyway; what is lost is the analysis of their matrices.
const RENEWED_AFTER: u64 = 100;

/// What later steps depend on.
#[derive(Debug, Serialize, Deserialize)]
struct Memory {
    step: Option<f64>,
    first: Option<f64>,
    error: f64,
    motion: Option<(f64, Vec<Vec3>)>,
    stabilised: Stabilised,
    growth: Growth,
}

impl Integrator for Staggered {
    fn prepare(&mut self, workspace: &mut Workspace, state: &mut State) -> Result<()> {
        if self.policy.chemistry == 0.0 {
            let inner = self.inner();
            self.steady.solve(workspace, state, inner, Leap::Allowed)?;
        }
        Ok(())
    }

    fn advance(
        &mut self,
        workspace: &mut Workspace,
        state: &mut State,
        until: f64,
    ) -> Result<StepReport> {
        let before = (self.step, self.first, self.error, self.motion.clone());
        let kept = (self.stabilised.clone(), self.growth);
        let done = match self.spec.method {
            Method::Euler => self.euler(workspace, state, until),
            Method::Heun => self.heun(workspace, state, until),
        };
        if done.is_err() {
            (self.step, self.first, self.error, self.motion) = before;
            (self.stabilised, self.growth) = kept;
        }
        done
    }

    fn renewed_after(&self) -> Option<u64> {
        self.chemistry.is_library().then_some(RENEWED_AFTER)
    }

    fn renew(&mut self) {
        self.chemistry.forget();
    }

    fn memory(&self) -> Record {
        let &Self { step, first, error, growth, .. } = self;
        let (motion, stabilised) = (self.motion.memory(), self.stabilised.clone());
        Record::encode(&Memory { step, first, error, motion, stabilised, growth })
    }

    fn is_storable(&self) -> bool {
        self.chemistry.is_new()
    }

    fn restore(&mut self, memory: &Record, vertices: usize) -> Result<(), Malformed> {
        let Memory { step, first, error, motion, stabilised, growth } = memory.read()?;
        (self.step, self.first, self.error) = (step, first, error);
        (self.stabilised, self.growth) = (stabilised, growth);
        self.motion.restore(motion, vertices)
    }
}

impl Staggered {
    /// Tolerances of the chemistry within a step.
    fn inner(&self) -> (f64, f64) {
        self.inner_of(CHEMISTRY_TOLERANCE_SHARE, self.power)
    }

    /// Tolerances within a step for a method whose error falls with this power of them, so that the
    /// error is proportional to the tolerance of the coupling.
    fn inner_of(&self, share: f64, power: f64) -> (f64, f64) {
        let (rtol, atol) = match self.spec.method {
            Method::Euler => return (EULER_SLACK * share, EULER_SLACK * share),
            Method::Heun => (self.spec.rtol.get(), self.spec.atol.get()),
        };
        let share = share * (rtol / DEFAULT_TOLERANCE).powf(1.0 / power - 1.0);
        let share = share.max(FINEST_CHEMISTRY_TOLERANCE / rtol).min(LOOSEST_CHEMISTRY_TOLERANCE);
        (share * rtol, share * atol)
    }

    /// X: lets the shape of `next` follow from `state` while the species go to those of `next`. Gives the
    /// shape of lower order that an error estimate compares with, if there is one.
    fn follow_shape(
        &mut self,
        workspace: &mut Workspace,
        state: &State,
        next: &mut State,
        done: &mut Relaxation,
    ) -> Result<Option<Vec<Vec3>>> {
        if !workspace.model.moves() {
            return Ok(None);
        }
        if self.relaxes(workspace) {
            workspace.check_way(state, next)?;
            done.add(&workspace.relax_once(next)?);
            return Ok(None);
        }
        if self.is_stabilised(workspace)
            && self.stabilised.rests()
            && let Some(near) = self.motion.follow_equilibrium(workspace, state, next)?
        {
            done.add(&near);
            return Ok(Some(next.x.to_vec()));
        }
        let tolerance = match self.spec.method {
            // As exact as forces are asked to be.
            Method::Euler => 0.0,
            Method::Heun => {
                // Where steps are shorter than the tolerance asks for, their errors are smaller.
                let share = self.error.clamp(MIN_ERROR, 1.0);
                share * workspace.model.shape_unit(state, self.tolerance())
            }
        };
        let second_order = self.shape == MotionMethod::Sdirk2;
        let (drag, distance_tolerance) = match self.policy.mechanics > 0.0 {
            true => (1.0, f64::INFINITY),
            false => (self.stabilising_drag(workspace, state)?, DISTANCE_TOLERANCE),
        };
        let relative = self.spec.rtol.get();
        let bound =
            (self.spec.method == Method::Heun).then_some((self.tolerance(), HOPELESS_ERROR));
        let by = Stepping { drag, second_order, tolerance, relative, distance_tolerance, bound };
        let to = next.clone();
        let route = Route::in_time(state, &to);
        let moved = self.motion.advance(workspace, state, route.clock(), &route, &by)?;
        done.add(&moved.done);
        next.x = moved.x.into();
        done.residual = workspace.reported_residual(next)?;
        Ok(Some(moved.coarse))
    }

    /// The internal variables of effects at the time of `to`, while shape and species go from those of `state` to its.
    fn flow(
        &mut self,
        workspace: &mut Workspace,
        state: &State,
        to: &State,
    ) -> Result<Vec<Vec<f64>>> {
        let inner = self.inner_of(CHEMISTRY_TOLERANCE_SHARE, ChemistryMethod::Chebyshev.power());
        self.internal.advance(workspace, (state, to), inner)
    }

    /// Whether the shape is relaxed once a step without drag, rather than moved.
    fn relaxes(&self, workspace: &Workspace) -> bool {
        let plain = workspace.stabilisation.share == Some(0.0) || !workspace.reaches_rest();
        self.policy.mechanics == 0.0 && plain
    }

    /// Whether it moves under the stabilising drag.
    fn is_stabilised(&self, workspace: &Workspace) -> bool {
        self.policy.mechanics == 0.0 && workspace.model.moves() && !self.relaxes(workspace)
    }

    /// Tolerances of the coupling.
    fn tolerance(&self) -> (f64, f64) {
        (self.spec.rtol.get(), self.spec.atol.get())
    }

    fn euler(
        &mut self,
        workspace: &mut Workspace,
        state: &mut State,
        until: f64,
    ) -> Result<StepReport> {
        let step = self.step.unwrap_or(until - state.time);
        let time = end_of_fixed_step(state.time, step, until);
        let step = time - state.time;
        let mut next = state.clone();
        if self.policy.chemistry > 0.0 {
            let signals = LinearInTime::still(workspace.at(state).signals()?.clone());
            let inner = self.inner();
            next.species = self.chemistry.advance(workspace, state, time, signals, inner)?;
        }
        next.time = time;
        next.step += 1;
        next.internal = self.flow(workspace, state, &next)?;
        let slack = (EULER_SLACK, EULER_SLACK);
        workspace.model.keep_in_range(&mut next.species, time, slack)?;
        let mut relaxation = Relaxation::default();
        self.follow_shape(workspace, state, &mut next, &mut relaxation)?;
        if self.is_stabilised(workspace) {
            self.rest(workspace, state, &mut next, &mut relaxation)?;
        }
        if self.policy.chemistry == 0.0 {
            let inner = self.inner();
            self.steady.solve(workspace, &mut next, inner, Leap::Allowed)?;
        }
        *state = next;
        Ok(StepReport { length: step, relaxation, ..StepReport::default() })
    }

    /// Heun's method under error control: attempts shorter steps until one is accepted.
    fn heun(
        &mut self,
        workspace: &mut Workspace,
        state: &mut State,
        until: f64,
    ) -> Result<StepReport> {
        let longest = self.longest_step();
        let mut tried = match self.step {
            Some(step) => step,
            None => self.first_step(workspace, state, until)?,
        };
        let shortest = self.shortest_step(workspace, tried);
        let now = workspace.at(state).signals()?.clone();
        let (mut report, mut first) = (StepReport::default(), true);
        loop {
            let proposed = tried.min(longest);
            let time = end_of_step(state.time, proposed, until);
            let step = time - state.time;
            // Of rejected attempts nothing but the work counts.
            report.relaxation = Relaxation::of_iterations(report.relaxation.iterations);
            let kept = self.stabilised.clone();
            let attempt = match self.try_heun(workspace, state, &now, time, &mut report) {
                Err(SolveError::Departed) => Ok((state.clone(), HOPELESS_ERROR)),
                attempt => attempt,
            };
            match attempt {
                Ok((next, error)) if error <= 1.0 => {
                    *state = self.watched(workspace, next, (step, &report.relaxation))?;
                    (report.length, report.error) = (step, error);
                    self.propose(step, proposed, error, first);
                    return Ok(report);
                }
                Ok((_, error)) => {
                    let new = Rejection { error, ..Rejection::new(state, step, Cause::Error) };
                    workspace.reject(new);
                    tried = step * shortening(error);
                }
                Err(error) if error.is_recoverable() => {
                    let message = error.to_string();
                    report.reason = Some(message.clone());
                    let new = Rejection { message, ..Rejection::new(state, step, error.cause()) };
                    workspace.reject(new);
                    tried = step / (MAX_STEP_GROWTH * MAX_STEP_GROWTH);
                    if tried < shortest {
                        return Err(match error.is_without_rest() {
                            true => self.gives_up(workspace, state, (time, tried)),
                            false => error,
                        });
                    }
                }
                Err(error) => return Err(error),
            }
            first = false;
            self.stabilised = kept;
            self.step = Some(tried);
            if !(tried >= shortest) {
                return Err(self.gives_up(workspace, state, (time, tried)));
            }
        }
    }

    /// The step below which it gives up; `tried` is the first that is tried.
    fn shortest_step(&mut self, workspace: &Workspace, tried: f64) -> f64 {
        let first = *self.first.get_or_insert(tried);
        SHORTEST_STEP * first * self.relaxing_share(workspace)
    }

    /// Why no step to `time` from `state` is short enough: of a quasi-static shape what leaves it without an equilibrium.
    fn gives_up(
        &self,
        workspace: &mut Workspace,
        state: &State,
        (time, step): (f64, f64),
    ) -> SolveError {
        if !self.is_stabilised(workspace) {
            return SolveError::StepTooSmall { time: state.time, step };
        }
        workspace.reason_without_rest(&State { time, ..state.clone() })
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
        let tolerance = self.tolerance();
        let inner = self.inner();
        let rested = self.stabilised.rests();
        let mut next = state.clone();
        next.time = time;
        next.step += 1;
        if self.policy.chemistry == 0.0 {
            return self.try_steady(workspace, state, next, report);
        }
        let frozen = LinearInTime::still(now.clone());
        next.species = self.chemistry.advance(workspace, state, time, frozen, inner)?;
        workspace.model.keep_in_range(&mut next.species, time, tolerance)?;
        next.internal = self.flow(workspace, state, &next)?;
        let coarse = self.follow_shape(workspace, state, &mut next, &mut report.relaxation)?;
        let mut predicted = next.clone();
        let later = workspace.at(&next).signals()?.clone();
        let signals = LinearInTime::new((state.time, now.clone()), (time, later));
        let mut on = state.clone();
        if workspace.model.diffuses() {
            on.x.iter_mut().zip(&next.x).for_each(|(a, b)| *a = 0.5 * (*a + b));
        }
        next.species = self.chemistry.advance(workspace, &on, time, signals, inner)?;
        next.internal = self.flow(workspace, state, &predicted)?;
        let model = &workspace.model;
        model.keep_in_range(&mut next.species, time, tolerance)?;
        let error = model.species_misfit(state, (&predicted, &next), tolerance);
        let error = error.max(model.internal_misfit(state, (&predicted, &next), tolerance));
        if error > 1.0 {
            return Ok((next, error));
        }
        let Some(coarse) = coarse else {
            self.follow_shape(workspace, &predicted, &mut next, &mut report.relaxation)?;
            let error = error.max(self.shape_error(workspace, state, &predicted, &next));
            return Ok((next, error));
        };
        predicted.x = coarse.into();
        self.correct_shape(workspace, state, (&mut predicted, &mut next), &mut report.relaxation)?;
        report.relaxation.residual = workspace.reported_residual(&next)?;
        report.relaxation.dissipated = self.motion.dissipated(workspace.model.mechanics(), &next.x);
        let error = error.max(self.shape_error(workspace, state, &predicted, &next));
        if error <= 1.0 && self.is_stabilised(workspace) {
            self.rest(workspace, state, &mut next, &mut report.relaxation)?;
            if rested && self.lags(next.time - state.time, &report.relaxation) {
                return Err(SolveError::Departed);
            }
        }
        Ok((next, error))
    }

    /// Brings the shape of `next` along with what its species have become since it was `predicted`.
    ///
    /// Moved through what the species did at first, slow waves err by Δt times what these then change, no more than the
    /// method itself; stiff ones are to be brought along.
    fn correct_shape(
        &mut self,
        workspace: &mut Workspace,
        state: &State,
        (predicted, next): (&mut State, &mut State),
        done: &mut Relaxation,
    ) -> Result<()> {
        let rested = self.motion.rests();
        match self.motion.correct(workspace, next) {
            Ok(more) => {
                done.add(&more);
                if !rested || self.shape_error(workspace, state, predicted, next) <= 1.0 {
                    return Ok(());
                }
            }
            Err(error) if rested && error.is_without_rest() => {}
            Err(error) => return Err(error),
        }
        // A fold lies between the two.
        self.stabilised.set_off();
        next.x = state.x.clone();
        if let Some(coarse) = self.follow_shape(workspace, state, next, done)? {
            predicted.x = coarse.into();
        }
        Ok(())
    }

    /// The same of the shape, where it has storage: there it may move while the species are nearly steady.
    fn shape_error(&self, workspace: &Workspace, state: &State, a: &State, b: &State) -> f64 {
        if self.relaxes(workspace) {
            return 0.0;
        }
        workspace.model.shape_misfit(&state.x, (&a.x, &b.x), self.tolerance())
    }
}
