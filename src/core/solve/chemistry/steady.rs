//! The chemistry that is steady at a given shape: `0 = D Δc + R(c, signals(x, c), t)`.
//!
//! Linearly implicit steps `(1/Δτ - ∂F/∂c) δ = F` from the chemistry there is, with Δτ growing as F
//! falls: they follow dc/dτ = F to the steady state it leads to, and end as Newton's method
//! (pseudo-transient continuation; Kelley & Keyes, SIAM J. Numer. Anal. 35 (1998) 508,
//! doi:10.1137/S0036142996304796).

use super::conserved::{ConservedTotals, areas_of};
use crate::linear::{LinearChoice, LinearError, Shifted, Sparse};
use crate::model::{Coupled, Model, State, Subsystem};
use crate::solve::{Result, SolveError, Workspace, counters};
use crate::tally::Tally;

/// Change in a step, in units of `rtol |c| + atol`, that counts as none.
const STATIONARY_CHANGE: f64 = 1e-2;
/// A step so long, in units of the fastest entry of ∂F/∂c, is long by any measure: what starts at rest but
/// for round-off moves at no speed that others could be compared with.
const LONG_STEP: f64 = 1e12;
/// Error of a step on the way, relative to a species' size and typical magnitude. What the chemistry
/// runs into hangs on the way where it has several steady states.
const STEP_TOLERANCE: f64 = 0.05;
/// A step counts as one along dc/dτ = F if it meets the equation of implicit Euler, `δ = Δτ F(c + δ)`, but for this share
/// of δ. Where a disturbance grows faster than 1/Δτ, as beyond a fold, the linear system turns the direction of the step
/// round, against F: without the test steps go back and forth there without end.
const EULER_RESIDUAL_SHARE: f64 = 0.5;
/// Steps after which the search for a steady state is abandoned.
const MAX_STEPS: usize = 5000;
/// The same of a steady state near by, which takes some twenty.
const MAX_NEAR: usize = 200;
/// Linear systems in a row that may fail.
const MAX_FAILURES: usize = 30;
/// How far a step on the way may leave a species' valid range, relative to its size and typical
/// magnitude.
const RANGE_SLACK: f64 = 0.1;
/// A species that changes by more than this share of its size and typical magnitude leaves its steady state for another
/// one: the branch of steady states that it was on has ended (a fold), or moves too far in one step of the coupling.
const JUMP_SHARE: f64 = 0.2;

/// Whether the chemistry may go to another steady state than the one it is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::solve) enum Leap {
    /// However far it is.
    Allowed,
    /// What leads away ends the search: a shorter step may stay near by.
    Refused,
}

/// Solves for the steady state of the chemistry, with what it keeps from one time to the next.
#[derive(Default)]
pub(in crate::solve) struct SteadyChemistry {
    alone: Option<Coupled>,
    newton: Option<Shifted>,
}

impl SteadyChemistry {
    /// Brings the chemistry of `state` to the steady state that it runs into while the shape rests.
    ///
    /// # Errors
    /// [`SolveError::NotSteady`] if it comes to no rest; [`SolveError::Leap`] where that is refused; errors of the
    /// plugin.
    pub(in crate::solve) fn solve(
        &mut self,
        workspace: &mut Workspace,
        state: &mut State,
        (rtol, atol): (f64, f64),
        leap: Leap,
    ) -> Result<()> {
        let Workspace { model, control, .. } = workspace;
        let _scope = counters::part(model.tally(), counters::SETTLING);
        model.hold(state.time, &mut state.species);
        let coupled = self
            .alone
            .get_or_insert_with(|| Coupled::new(model, Subsystem::Chemistry).at_fixed_time());
        coupled.start(state);
        let n = coupled.layout().unknowns();
        let tolerance = coupled.tolerances(atol);
        let (mut y, mut rate) = (coupled.pack(state), vec![0.0; n]);
        let start = y.clone();
        coupled.residual(state.time, &y, &mut rate)?;
        // The first step changes nothing by more than its own size.
        let typical: Vec<f64> = tolerance.iter().map(|tolerance| tolerance / atol).collect();
        let mut speed = relative(&typical, &y, &rate);
        if speed == 0.0 {
            return Ok(());
        }
        let mut steps = Steps::new(speed);
        let areas = areas_of(model, state);
        let most = if leap == Leap::Refused { MAX_NEAR } else { MAX_STEPS };
        for step in 0..most {
            control.check()?;
            control.report(|| relaxing(step, most, speed));
            let at = (state.time, y.as_slice(), rate.as_slice());
            let system = (&mut *coupled, &mut self.newton, areas.as_slice());
            let Some(change) = steps.linear(system, model.tally(), at)? else {
                continue;
            };
            let at = Iterate { model, state, y: &y, rate: &rate, tolerance: (rtol, &tolerance) };
            let Trial { y: tried, rate: after, largest, error } =
                at.trial(coupled, &change, steps.inverse, &typical)?;
            if !(error <= 4.0 * STEP_TOLERANCE && largest.is_finite()) {
                steps.shorten(shortening(error));
                continue;
            }
            (y, rate) = (tried, after);
            let left =
                |i: usize| (y[i] - start[i]).abs() > JUMP_SHARE * (typical[i] + start[i].abs());
            if leap == Leap::Refused && (0..n).any(left) {
                return Err(SolveError::Leap { time: state.time });
            }
            speed = relative(&typical, &y, &rate);
            if !speed.is_finite() {
                break;
            }
            if largest < STATIONARY_CHANGE && steps.are_long() {
                return accept(state, (coupled, model), &y, (rtol, atol));
            }
            steps.adapt(error, largest < STATIONARY_CHANGE);
        }
        Err(SolveError::NotSteady { time: state.time, rate: speed })
    }
}

/// The lengths of steps.
struct Steps {
    /// 1/Δτ.
    inverse: f64,
    /// The largest relative rate at the start.
    first: f64,
    /// The largest entry of ∂F/∂c.
    fastest: f64,
    /// Linear systems in a row that failed.
    failures: usize,
}

impl Steps {
    fn new(first: f64) -> Self {
        Self { inverse: first, first, fastest: 0.0, failures: 0 }
    }

    /// Beyond what is long by any measure the linear system has no digits left.
    fn set_fastest(&mut self, fastest: f64) {
        self.fastest = fastest;
        self.inverse = self.inverse.max(0.5 * fastest / LONG_STEP);
    }

    fn shorten(&mut self, by: f64) {
        self.inverse = by * self.inverse.max(1e-9 * self.first);
    }

    /// δ of the linearly implicit step from `(t, c, F)`, in which totals that the chemistry conserves stay as they are.
    /// None where the system cannot be solved.
    fn linear(
        &mut self,
        (coupled, newton, areas): (&mut Coupled, &mut Option<Shifted>, &[Vec<f64>]),
        tally: &Tally,
        (time, y, rate): (f64, &[f64], &[f64]),
    ) -> Result<Option<Vec<f64>>> {
        let jacobian = coupled.jacobian(time, y)?;
        self.set_fastest(jacobian.largest());
        let totals = ConservedTotals::new(areas, jacobian, y, rate);
        let mut change = rate.to_vec();
        let newton = prepared(newton, jacobian)?;
        let inverse = self.inverse;
        let solved = newton.solve(jacobian, |_| (inverse, 1.0), &mut change, tally);
        let again = |x: &mut [f64]| newton.solve_again(x, tally);
        let solved = solved.and_then(|()| totals.restore(&mut change, y, inverse, again));
        Ok(self.after_linear_solve(solved)?.then_some(change))
    }

    /// Whether a linear system was solved. A shorter step makes a matrix easier that could not be solved with; with no step to
    /// speak of it is the identity.
    fn after_linear_solve(&mut self, solved: std::result::Result<(), LinearError>) -> Result<bool> {
        let Err(failure) = solved else {
            self.failures = 0;
            return Ok(true);
        };
        self.shorten(4.0);
        self.failures += 1;
        if self.failures > MAX_FAILURES { Err(failure.into()) } else { Ok(false) }
    }

    fn are_long(&self) -> bool {
        self.inverse < 1e-3 * self.first || LONG_STEP * self.inverse < self.fastest
    }

    /// After an accepted step with this `error`.
    fn adapt(&mut self, error: f64, is_still: bool) {
        let growth = (error / STEP_TOLERANCE).sqrt().clamp(0.1, 2.0);
        self.inverse *= if is_still { growth.min(0.1) } else { growth };
    }
}

/// Solves `(1/Δτ - ∂F/∂c) δ = F`, once it is analysed.
fn prepared<'a>(newton: &'a mut Option<Shifted>, jacobian: &Sparse) -> Result<&'a mut Shifted> {
    Ok(match newton {
        Some(newton) => newton,
        None => newton.insert(Shifted::new(jacobian, LinearChoice::Auto, None)?),
    })
}

/// Progress message of a search.
fn relaxing(step: usize, most: usize, speed: f64) -> String {
    format!(
        "relaxing the chemistry to steady state, step {step} of at most {most}; it still changes by {speed:.1e} of its \
         size per unit of time"
    )
}

/// Divisor of the step after one rejected with this error.
fn shortening(error: f64) -> f64 {
    if error.is_finite() { (error / STEP_TOLERANCE).sqrt().clamp(1.5, 10.0) } else { 4.0 }
}

/// Puts the steady state `y` into `state`, brought into the valid ranges within the tolerances.
fn accept(
    state: &mut State,
    (coupled, model): (&Coupled, &Model),
    y: &[f64],
    tolerances: (f64, f64),
) -> Result<()> {
    let mut next = state.clone();
    coupled.layout().unpack(model.mechanics(), state.time, y, &mut next);
    model.keep_in_range(&mut next.species, state.time, tolerances)?;
    *state = next;
    Ok(())
}

/// The largest rate, each relative to its value, or to its typical one where that is 0.
fn relative(typical: &[f64], y: &[f64], rate: &[f64]) -> f64 {
    let of = |i: usize| rate[i].abs() / (typical[i] + y[i].abs());
    (0..y.len()).map(of).fold(0.0, f64::max)
}

/// Where a step begins.
struct Iterate<'a> {
    model: &'a Model,
    state: &'a State,
    y: &'a [f64],
    rate: &'a [f64],
    /// rtol, and atol of every unknown.
    tolerance: (f64, &'a [f64]),
}

/// Where it leads.
struct Trial {
    y: Vec<f64>,
    rate: Vec<f64>,
    /// Largest change in units of the tolerance.
    largest: f64,
    /// Estimate of its relative error; infinite where the kinetics have no value, or one far out of their range.
    error: f64,
}

impl Iterate<'_> {
    fn trial(
        &self,
        coupled: &mut Coupled,
        change: &[f64],
        inverse_step: f64,
        typical: &[f64],
    ) -> Result<Trial> {
        let Self { model, state, y: before, rate: rate_before, tolerance: (rtol, tolerance) } =
            *self;
        let (mut y, mut rate) = (before.to_vec(), rate_before.to_vec());
        let mut largest: f64 = 0.0;
        for i in 0..y.len() {
            y[i] += change[i];
            largest = largest.max(change[i].abs() / (rtol * y[i].abs() + tolerance[i]));
        }
        let mut shown = state.clone();
        coupled.layout().unpack(model.mechanics(), state.time, &y, &mut shown);
        let sensible =
            model.keep_in_range(&mut shown.species, state.time, (RANGE_SLACK, RANGE_SLACK));
        let done = sensible.and_then(|()| coupled.residual(state.time, &y, &mut rate));
        let error = match done {
            Ok(()) if strays(&rate, change, (tolerance, rtol, &y), inverse_step) => f64::INFINITY,
            Ok(()) => {
                let differ: Vec<f64> = rate.iter().zip(rate_before).map(|(b, a)| b - a).collect();
                0.5 / inverse_step * relative(typical, &y, &differ)
            }
            Err(failure) if failure.is_recoverable() => f64::INFINITY,
            Err(failure) => return Err(failure.into()),
        };
        Ok(Trial { y, rate, largest, error })
    }
}

/// Whether a change that counts does not lead along the rates at its end.
fn strays(
    rate: &[f64],
    change: &[f64],
    (tolerance, rtol, y): (&[f64], f64, &[f64]),
    inverse_step: f64,
) -> bool {
    let largest = |of: &dyn Fn(usize) -> f64| {
        let unit = |i: usize| rtol * y[i].abs() + tolerance[i];
        (0..y.len()).map(|i| of(i).abs() / unit(i)).fold(0.0, f64::max)
    };
    let moved = largest(&|i| change[i]);
    moved > 1.0 && largest(&|i| rate[i] / inverse_step - change[i]) > EULER_RESIDUAL_SHARE * moved
}
