//! The corrector: Newton's method for an equilibrium at a given place along a direction.
//!
//! ```text
//! g(u, λ) = 0,     ⟨t, (u, λ) - (u₀, λ₀)⟩ = s
//! ```
//!
//! Minima and saddles alike: no energy is lowered. The column ∂g/∂λ is the difference quotient of g of two
//! members of the family; fixed directions that move with λ move in it.

use super::metric::Metric;
use super::system::{Equilibrium, System};
use super::{Direction, Settings, Unknowns};
use crate::solve::Control;

/// Most iterations: where more are needed the step is too long.
const MAX_ITERATIONS: usize = 10;
/// A correction shorter than this, in arc length, ends the iteration where forces are below the tolerance: the error left
/// is of the order of its square.
const CONVERGED_CORRECTION: f64 = 1e-7;
/// The same after the last iteration, where round-off keeps corrections from getting smaller.
const ACCEPTABLE_CORRECTION: f64 = 1e-5;
/// Difference of the parameter in units of Λ for ∂g/∂λ: the quotient is central, so that its error is some 1e-8 of what
/// varies over Λ, and round-off some 1e-12.
const PARAMETER_DIFFERENCE: f64 = 1e-4;

/// `⟨direction, u - at⟩ = distance`, with the parameter in u and in `at`.
#[derive(Clone, Copy)]
pub(super) struct Condition<'a> {
    pub(super) direction: &'a Direction,
    pub(super) at: &'a Unknowns,
    pub(super) parameter: f64,
    pub(super) distance: f64,
}

/// What a correction came to.
pub(super) enum CorrectorOutcome<S: System> {
    /// The equilibrium.
    Found(Box<Equilibrium<S::Member>>),
    /// None near the guess, and the error of the system if that is why.
    Lost(Option<S::Error>),
}

/// What corrections work with.
pub(super) struct Corrector<S: System> {
    pub(super) system: S,
    pub(super) metric: Metric,
    pub(super) control: Control,
}

impl<S: System> Corrector<S> {
    /// ∂g/∂λ at `at`; one-sided at the end of the values that the system has.
    pub(super) fn by_parameter(
        &mut self,
        at: &Equilibrium<S::Member>,
    ) -> Result<Unknowns, S::Error> {
        let difference = PARAMETER_DIFFERENCE * self.metric.scale();
        let mut of = |parameter: f64| self.system.evaluate(at.at.clone(), parameter);
        let (above, below) = (of(at.parameter + difference), of(at.parameter - difference));
        let (above, below) = match (above, below) {
            (Ok(above), Ok(below)) => (above, below),
            (Ok(above), Err(_)) => (above, of(at.parameter)?),
            (Err(_), Ok(below)) => (of(at.parameter)?, below),
            (Err(error), Err(_)) => return Err(error),
        };
        let step = above.parameter - below.parameter;
        let mut quotient = above.imbalance.plus(-1.0, &below.imbalance);
        quotient.scale(1.0 / step);
        Ok(quotient)
    }

    /// The equilibrium near `guess` that meets `condition`.
    ///
    /// # Errors
    /// [`SolveError::Interrupted`].
    pub(super) fn correct(
        &mut self,
        (guess, parameter): (Unknowns, f64),
        condition: &Condition<'_>,
        settings: &Settings,
    ) -> Result<CorrectorOutcome<S>, S::Error> {
        let mut at = match self.system.evaluate(guess, parameter) {
            Ok(at) => at,
            Err(error) => return Ok(CorrectorOutcome::Lost(Some(error))),
        };
        let form = self.metric.form(condition.direction);
        let (mut last, mut largest) = (f64::INFINITY, f64::INFINITY);
        loop {
            self.control.check()?;
            let balanced = at.residual <= settings.tolerance;
            let done = at.iterations >= MAX_ITERATIONS;
            if balanced && (last <= CONVERGED_CORRECTION || done && last <= ACCEPTABLE_CORRECTION) {
                return Ok(CorrectorOutcome::Found(Box::new(at)));
            }
            if done || !(at.energy.is_finite() && at.residual.is_finite() && last <= largest) {
                return Ok(CorrectorOutcome::Lost(None));
            }
            let change = match self.newton(&mut at, (condition, &form), settings.tolerance) {
                Ok(Some(change)) => change,
                Ok(None) => return Ok(CorrectorOutcome::Lost(None)),
                Err(error) => return Ok(CorrectorOutcome::Lost(Some(error))),
            };
            largest = MAX_CORRECTION * settings.longest_step;
            last = self.metric.norm(&change);
            let next = at.at.plus(1.0, &change.unknowns);
            let finite = change.parameter.is_finite() && last.is_finite();
            if !(finite && self.system.allows(&at, &next)) {
                return Ok(CorrectorOutcome::Lost(None));
            }
            let iterations = at.iterations + 1;
            self.system.tally().count(|work| work.iterations += 1);
            at = match self.system.evaluate(next, at.parameter + change.parameter) {
                Ok(next) => Equilibrium { iterations, ..next },
                Err(error) => return Ok(CorrectorOutcome::Lost(Some(error))),
            };
        }
    }

    /// The next correction; none where the system cannot be solved.
    fn newton(
        &mut self,
        at: &mut Equilibrium<S::Member>,
        (condition, form): (&Condition<'_>, &Direction),
        tolerance: f64,
    ) -> Result<Option<Direction>, S::Error> {
        let column = self.by_parameter(at)?;
        if self.system.factorise(at, tolerance).is_err() {
            return Ok(None);
        }
        let missed = self.missed(at, condition);
        let mut down = at.imbalance.clone();
        down.scale(-1.0);
        Ok(self.system.solve_bordered((&column, form), (&down, -missed)).ok())
    }

    /// What is missing to `condition`.
    fn missed(&self, at: &Equilibrium<S::Member>, condition: &Condition<'_>) -> f64 {
        // Those that move with the parameter are no unknowns: the direction is 0 there.
        let unknowns = at.at.plus(-1.0, condition.at);
        let from = Direction { unknowns, parameter: at.parameter - condition.parameter };
        self.metric.inner(condition.direction, &from) - condition.distance
    }
}

/// A correction longer than so many of the longest steps leads to another branch.
const MAX_CORRECTION: f64 = 2.0;
