//! diffsol's methods behind one face: one checked step at a time.

use std::sync::Arc;

use diffsol::{
    Bdf, BdfState, ExplicitRk, NonLinearOp, OdeBuilder, OdeEquations, OdeSolverMethod,
    OdeSolverProblem, OdeSolverState, OdeSolverStopReason, Op, RkState, Sdirk, Tableau, Vector,
    VectorCommon,
};

use super::equations::Equations;
use super::iteration_matrix::IterationMatrix;
use super::newton::{NewtonSolver, SharedFactor};
use super::unknowns::Unknowns;
use super::{Accept, OdeError, OdeMethod, Rejected, Result};
use crate::ode::Options;

/// A step below this share of the first one gives up.
const MIN_STEP_SHARE: f64 = 1e-9;
/// A first step below this share of the way leads nowhere: its inverse, and squares of rates, are no numbers any more.
const SHORTEST_FIRST_SHARE: f64 = 1e-130;
/// Length of a step that is tried again, relative to the one that was taken back.
const RETRY_FACTOR: f64 = 0.25;
/// Tries at one step that end with numbers that are not finite or not allowed.
const MAX_RETRIES: usize = 20;
/// Times as near as so many units of round-off are the same to diffsol: it neither steps from one to
/// the other nor takes it for a time to stop at.
const SAME_TIME: f64 = 100.0 * f64::EPSILON;
/// A step that would leave less than itself to the stop time shares the way with the next one: steps much shorter than
/// their neighbours cost all their history, and with output times near to each other as many steps to grow again.
const STUB_SHARE: f64 = 1.0;
/// A try is longer than the shortest one where it is so many times as long.
const LONG_ATTEMPT_RATIO: f64 = 100.0;
/// The least step is at most this share of the way to the stop time, however short that is.
const SHORTEST_OF_REST: f64 = 1e-6;

/// The diffsol problem of `equations`, to be kept where a [`Stepper`] can borrow it.
///
/// # Errors
/// Tolerances of the wrong number, which is a fault of the caller.
pub(super) fn problem(
    equations: Equations,
    time: f64,
    atol: Vec<f64>,
    options: &Options,
) -> Result<Problem> {
    let made = OdeBuilder::<IterationMatrix>::new()
        .t0(time)
        .h0(options.span)
        .rtol(options.rtol)
        .atol(atol)
        .build_from_eqn(equations);
    let mut problem = made.map_err(|e| refusal(options.method, time, &e.to_string()))?;
    // Counted over the solver's whole life: a long run would die of harmless failures.
    problem.ode_options.max_nonlinear_solver_failures = usize::MAX;
    problem.ode_options.max_error_test_failures = usize::MAX;
    Ok(problem)
}

fn refusal(method: OdeMethod, time: f64, message: &str) -> OdeError {
    OdeError::Stopped { method: method.name(), time, message: message.into() }
}

pub(super) type Problem = OdeSolverProblem<Equations>;

enum Method<'a> {
    Bdf(Box<Bdf<'a, Equations, NewtonSolver>>),
    Sdirk(Box<Sdirk<'a, Equations, NewtonSolver>>),
    Explicit(Box<ExplicitRk<'a, Equations>>),
}

impl Method<'_> {
    fn set_shortest(&mut self, shortest: f64) {
        match self {
            Self::Bdf(solver) => solver.config_mut().minimum_timestep = shortest,
            Self::Sdirk(solver) => solver.config_mut().minimum_timestep = shortest,
            Self::Explicit(solver) => solver.config_mut().minimum_timestep = shortest,
        }
    }
}

macro_rules! every {
    ($method:expr, $solver:ident => $body:expr, none => $none:expr) => {
        match $method {
            Some(Method::Bdf($solver)) => $body,
            Some(Method::Sdirk($solver)) => $body,
            Some(Method::Explicit($solver)) => $body,
            None => $none,
        }
    };
}

/// An integration under way.
pub(super) struct Stepper<'a> {
    problem: &'a Problem,
    options: Arc<Options>,
    /// None after a start that failed.
    method: Option<Method<'a>>,
    shortest: f64,
    spare: SharedFactor,
    /// Time reached: the stop time itself where the solver has come within round-off of it.
    time: f64,
    /// Where the step under way has begun.
    start: Vec<f64>,
}

impl<'a> Stepper<'a> {
    /// From the start of `problem`.
    ///
    /// # Errors
    /// If F cannot be evaluated there.
    pub(super) fn new(problem: &'a Problem, options: &Arc<Options>) -> Result<Self> {
        let (time, y) = (problem.t0, problem.eqn.init_vector());
        let first = Self::first_step(problem, options, options.span, time, &y)?;
        let (shortest, spare) = (MIN_STEP_SHARE * first, SharedFactor::default());
        let started = Self::start(problem, options, time, y, (first, shortest), &spare)?;
        problem.eqn.forget_start();
        let (method, options) = (Some(started), Arc::clone(options));
        Ok(Self { problem, options, method, shortest, spare, time, start: Vec::new() })
    }

    /// Restarts from `y` at `time`, with no memory of the way there but factors' patterns.
    ///
    /// # Errors
    /// If F cannot be evaluated there.
    pub(super) fn restart(&mut self, time: f64, y: &[f64], span: f64) -> Result<()> {
        self.problem.eqn.take_error();
        let y = vector(self.problem, y);
        let first = Self::first_step(self.problem, &self.options, span, time, &y)?;
        self.shortest = MIN_STEP_SHARE * first;
        self.begin(time, y, first)
    }

    fn begin(&mut self, time: f64, y: Unknowns, step: f64) -> Result<()> {
        // Dropped first: the old solver leaves its factor to the new one.
        self.method = None;
        let steps = (step, self.shortest);
        let started = Self::start(self.problem, &self.options, time, y, steps, &self.spare)?;
        self.method = Some(started);
        self.time = time;
        Ok(())
    }

    /// dy/dt: F in rows with storage, in the others that of a consistent start, 0 where it is not known.
    fn slope(problem: &Problem, options: &Options, time: f64, y: &Unknowns) -> Result<Unknowns> {
        let mut slope = problem.eqn.rhs().call(y, time);
        if let Some(error) = problem.eqn.take_error() {
            return Err(error);
        }
        let values = slope.inner_mut().as_mut_slice();
        if let Some(differential) = problem.eqn.differential() {
            let known = problem.eqn.slope_at(time);
            for (i, value) in values.iter_mut().enumerate().filter(|(i, _)| !differential[*i]) {
                *value = known.as_ref().map_or(0.0, |slope| slope[i]);
            }
        }
        if values.iter().any(|v| !v.is_finite()) {
            return Err(refusal(options.method, time, "the rates are not finite"));
        }
        Ok(slope)
    }

    /// A hundredth of the time in which the solution changes by its own size or its tolerance.
    fn first_step(
        problem: &Problem,
        options: &Options,
        span: f64,
        time: f64,
        y: &Unknowns,
    ) -> Result<f64> {
        if let Some(step) = options.step {
            return Ok(step);
        }
        let slope = Self::slope(problem, options, time, y)?;
        let norm = |v: &Unknowns| v.squared_norm(y, &problem.atol, options.rtol).sqrt();
        let (size, speed) = (norm(y), norm(&slope));
        let step = if speed > 0.0 { 0.01 * size.max(1.0) / speed } else { 1e-3 * span };
        match step > SHORTEST_FIRST_SHARE * span {
            true => Ok(step.min(span)),
            false => Err(OdeError::TooFast { step }),
        }
    }

    fn start(
        problem: &'a Problem,
        options: &Arc<Options>,
        time: f64,
        y: Unknowns,
        (step, shortest): (f64, f64),
        spare: &SharedFactor,
    ) -> Result<Method<'a>> {
        let dy = Self::slope(problem, options, time, &y)?;
        let refuse = |e: diffsol::DiffsolError| refusal(options.method, time, &e.to_string());
        let linear = NewtonSolver::new(problem.eqn.shared(), options, spare.clone());
        macro_rules! state {
            ($kind:ty) => {{
                let mut state = <$kind>::new_without_initialise(problem).map_err(refuse)?;
                let parts = state.as_mut();
                *parts.y = y;
                *parts.dy = dy;
                *parts.t = time;
                *parts.h = step;
                state
            }};
        }
        macro_rules! runge_kutta {
            () => {{
                let mut state = state!(RkState<Unknowns>);
                state.set_problem(problem).map_err(refuse)?;
                *state.as_mut().h = step;
                state
            }};
        }
        let mut method = match options.method {
            OdeMethod::Bdf => {
                let mut state = state!(BdfState<Unknowns>);
                state.set_problem(problem).map_err(refuse)?;
                *state.as_mut().h = step;
                Method::Bdf(Box::new(Bdf::new(problem, state, linear).map_err(refuse)?))
            }
            OdeMethod::TrBdf2 | OdeMethod::Esdirk34 => {
                let tableau = || match options.method {
                    OdeMethod::TrBdf2 => Tableau::tr_bdf2(),
                    _ => Tableau::esdirk34(),
                };
                let state = runge_kutta!();
                let made = Sdirk::new(problem, state, tableau(), linear).map_err(refuse)?;
                Method::Sdirk(Box::new(made))
            }
            OdeMethod::Tsit45 => {
                let state = runge_kutta!();
                let made = ExplicitRk::new(problem, state, Tableau::tsit45()).map_err(refuse)?;
                Method::Explicit(Box::new(made))
            }
        };
        // Implicit methods evaluate ∂F/∂y at once.
        if let Some(error) = problem.eqn.take_error() {
            return Err(error);
        }
        method.set_shortest(shortest);
        Ok(method)
    }

    /// Keeps the solution, from where the next step may have to be tried again.
    fn keep_solution(&mut self) {
        self.start.clear();
        every!(&self.method, solver => {
            self.start.extend_from_slice(solver.state().y.inner().as_slice());
        }, none => ());
    }

    /// Tries that the solver rejected by their error and in Newton's method, and iterations of that, since its
    /// start.
    fn statistics(&self) -> [u64; 3] {
        let all = every!(&self.method, solver => {
            let s = solver.get_statistics();
            [
                s.number_of_error_test_failures,
                s.number_of_nonlinear_solver_fails,
                s.number_of_nonlinear_solver_iterations,
            ]
        }, none => [0; 3]);
        all.map(|count| count as u64)
    }

    /// One step that does not pass `until`, and ends at it exactly where it comes within round-off of
    /// it. `accept` may refuse the new solution (time, values): the step is then taken back and tried
    /// again, shorter; numbers that are not finite are never shown to it, nor are those from where
    /// the next step would find no finite rates. Rejected step attempts are added to `rejected`.
    ///
    /// # Errors
    /// An error of F or of `accept` that no shorter step cures, or the last one if none did.
    pub(super) fn step(
        &mut self,
        until: f64,
        accept: &mut Accept<'_>,
        rejected: &mut Rejected,
    ) -> Result<()> {
        for retry in 0.. {
            let time = self.time;
            self.keep_solution();
            let before = self.statistics();
            let stepped = self.raw_step(until);
            let [failed, newton, iterations] = self.statistics();
            self.options.tally.count(|work| work.newton_iterations += iterations - before[2]);
            rejected.error += failed - before[0];
            rejected.newton += newton - before[1];
            let stored_error = self.problem.eqn.take_error();
            let error = match stepped {
                Ok(()) => {
                    let finite = self.is_finite();
                    let verdict =
                        if finite { self.shown_to(accept) } else { Err(OdeError::NotFinite) };
                    match (verdict, stored_error) {
                        (Ok(()), Some(error)) if !error.is_recoverable() => return Err(error),
                        (Ok(()), told) => {
                            // A try that F had no value for ended in Newton's method.
                            rejected.newton -= rejected.newton.min(u64::from(told.is_some()));
                            rejected.refused.extend(told);
                            return Ok(());
                        }
                        // What F said is the better reason for numbers that are not finite.
                        (Err(_), Some(error)) if !finite => error,
                        (Err(error), _) => error,
                    }
                }
                Err(error) => {
                    // What F said is the better reason, unless of a try far longer than the last one.
                    let longer = self.problem.eqn.failed_at() - time
                        > LONG_ATTEMPT_RATIO * self.least(until - time);
                    return Err(match stored_error {
                        Some(told) if !(told.is_recoverable() && longer) => told,
                        _ => error,
                    });
                }
            };
            let step = RETRY_FACTOR * (self.time - time);
            let hopeless = retry >= MAX_RETRIES || !(step > self.least(until - time));
            if hopeless || !error.is_recoverable() {
                return Err(error);
            }
            rejected.refused.push(error);
            let start = vector(self.problem, &self.start);
            self.begin(time, start, step)?;
        }
        Ok(())
    }

    /// Whether `accept` takes the solution.
    fn shown_to(&self, accept: &mut Accept<'_>) -> Result<()> {
        every!(&self.method, solver => {
            accept(self.time, solver.state().y.inner().as_slice())
        }, none => Ok(()))
        .map_err(OdeError::from)
    }

    /// Whether the solution is finite, and the rates there that an explicit method begins its next
    /// step with: its error norm drops NaN, so that a step into where there are none is accepted.
    fn is_finite(&self) -> bool {
        let finite = |v: &Unknowns| v.inner().as_slice().iter().all(|v| v.is_finite());
        every!(&self.method, solver => {
            let state = solver.state();
            finite(state.y) && (self.options.method.is_implicit() || finite(state.dy))
        }, none => false)
    }

    /// The least step over that length of time.
    fn least(&self, length: f64) -> f64 {
        self.shortest.min(SHORTEST_OF_REST * length).max(f64::MIN_POSITIVE)
    }

    /// A step; where diffsol has lost the direction of time by round-off, as after many stop times, it restarts.
    fn raw_step(&mut self, until: f64) -> Result<()> {
        if self.fitted_step(until)? {
            return Ok(());
        }
        let start = vector(self.problem, &self.start);
        self.begin(self.time, start, until - self.time)?;
        match self.fitted_step(until)? {
            true => Ok(()),
            false => {
                Err(refusal(self.options.method, self.time, "it has lost the direction of time"))
            }
        }
    }

    /// A step that ends at `until` or before; whether diffsol has taken that for a time ahead.
    fn fitted_step(&mut self, until: f64) -> Result<bool> {
        let time = self.time;
        let refuse = |e: diffsol::DiffsolError| refusal(self.options.method, time, &e.to_string());
        let shortest = self.least(until - time);
        let stop = every!(&mut self.method, solver => {
            let (now, step) = (solver.state().t, solver.state().h);
            let same = SAME_TIME * (now.abs() + step.abs());
            // Of the solver's own time: what it has fallen short of stop times by adds up.
            let rest = until - now;
            if rest.abs() <= same {
                until
            } else {
                // A step that diffsol has fitted to the stop time is as long as the way, but for round-off. What this
                // adds up to is made good before diffsol takes it for a way to go, forwards or back.
                let over = step - rest;
                let short = over < -0.1 * same && rest < (1.0 + STUB_SHARE) * step;
                let long = over > 0.1 * same && over < 2.0 * same;
                let shared = (short || long) && rest > 4.0 * same;
                let stop = if shared { now + 0.5 * rest } else { until };
                solver.config_mut().minimum_timestep = shortest;
                if solver.set_stop_time(stop).is_err() {
                    return Ok(false);
                }
                match solver.step().map_err(refuse)? {
                    OdeSolverStopReason::TstopReached => stop,
                    OdeSolverStopReason::InternalTimestep
                    | OdeSolverStopReason::RootFound(..) => solver.state().t,
                }
            }
        }, none => return Err(refusal(self.options.method, time, "its start failed")));
        self.time = stop;
        Ok(true)
    }
}

fn vector(problem: &Problem, values: &[f64]) -> Unknowns {
    Unknowns::from_slice(values, problem.eqn.context().clone())
}
