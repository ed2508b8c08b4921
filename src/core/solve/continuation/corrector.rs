//! The corrector: Newton's method for an equilibrium at a given place along a direction.
//!
//! ```text
//! g(x, λ) = ∂U/∂x = 0,     ⟨t, u - u₀⟩ = s,     u = (x, λ)
//! ```
//!
//! Minima and saddles alike: no energy is lowered. The column ∂g/∂λ is the difference quotient of gradients of two
//! members of the family; fixed directions that move with λ move in it.

use super::bordered::Bordered;
use super::metric::{Direction, Metric};
use super::{Family, Settings};
use crate::Vec3;
use crate::model::Potential;
use crate::parallel;
use crate::solve::{Control, SolveError};
use crate::tally::Tally;

/// Most iterations: where more are needed the step is too long.
const MOST: usize = 10;
/// A correction shorter than this, in arc length, ends the iteration where forces are below the tolerance: the error left
/// is of the order of its square.
const CLOSE: f64 = 1e-7;
/// The same after the last iteration, where round-off keeps corrections from getting smaller.
const NEARLY: f64 = 1e-5;
/// No triangle's area may fall below this share in one correction.
const AREA_SHARE: f64 = 0.1;
/// Difference of the parameter in units of Λ for ∂g/∂λ: the quotient is central, so that its error is some 1e-8 of what
/// varies over Λ, and round-off some 1e-12.
const DIFFERENCE: f64 = 1e-4;

/// An equilibrium, with the potential and the gradient there.
pub(super) struct Equilibrium {
    pub(super) x: Vec<Vec3>,
    pub(super) parameter: f64,
    pub(super) potential: Potential,
    pub(super) gradient: Vec<Vec3>,
    pub(super) energy: f64,
    pub(super) residual: f64,
    pub(super) iterations: usize,
}

/// `⟨direction, u - (x, parameter)⟩ = distance`.
#[derive(Clone, Copy)]
pub(super) struct Condition<'a> {
    pub(super) direction: &'a Direction,
    pub(super) x: &'a [Vec3],
    pub(super) parameter: f64,
    pub(super) distance: f64,
}

/// What a correction came to.
pub(super) enum Corrected<E> {
    /// The equilibrium.
    Found(Box<Equilibrium>),
    /// None near the guess, and the error of the family if that is why.
    Lost(Option<E>),
}

/// What corrections work with.
pub(super) struct Corrector<F: Family> {
    pub(super) family: F,
    pub(super) bordered: Bordered,
    pub(super) metric: Metric,
    pub(super) control: Control,
}

impl<F: Family> Corrector<F> {
    /// Where its work is counted.
    pub(super) fn tally(&self) -> &Tally {
        self.bordered.tally()
    }

    /// The family's member of `parameter` at `x`, whose moving fixed directions are set.
    pub(super) fn evaluate(
        &mut self,
        mut x: Vec<Vec3>,
        parameter: f64,
    ) -> Result<Equilibrium, F::Error> {
        let mut potential = self.family.potential(parameter)?;
        potential.mechanics().set_prescribed(potential.time(), &mut x);
        let mut gradient = vec![Vec3::zeros(); x.len()];
        let energy = potential.energy_gradient(&x, &mut gradient);
        let residual = potential.residual(&gradient);
        let iterations = 0;
        Ok(Equilibrium { x, parameter, potential, gradient, energy, residual, iterations })
    }

    /// ∂g/∂λ at `at`; one-sided at the end of the values that the family has.
    pub(super) fn by_parameter(&mut self, at: &Equilibrium) -> Result<Vec<Vec3>, F::Error> {
        let difference = DIFFERENCE * self.metric.scale();
        let mut of = |parameter: f64| self.evaluate(at.x.clone(), parameter);
        let (above, below) = (of(at.parameter + difference), of(at.parameter - difference));
        let (above, below) = match (above, below) {
            (Ok(above), Ok(below)) => (above, below),
            (Ok(above), Err(_)) => (above, of(at.parameter)?),
            (Err(_), Ok(below)) => (of(at.parameter)?, below),
            (Err(error), Err(_)) => return Err(error),
        };
        let step = above.parameter - below.parameter;
        let mut quotient = above.gradient;
        parallel::update(&mut quotient, |i, v| *v = (*v - below.gradient[i]) / step);
        Ok(quotient)
    }

    /// Takes over H at `at`.
    pub(super) fn factorise(
        &mut self,
        at: &mut Equilibrium,
        tolerance: f64,
    ) -> Result<(), SolveError> {
        let Equilibrium { potential, x, gradient, .. } = at;
        self.bordered.factorise(potential, x, (gradient, tolerance))
    }

    /// The equilibrium near (`x`, `parameter`) that meets `condition`.
    ///
    /// # Errors
    /// [`SolveError::Interrupted`].
    pub(super) fn correct(
        &mut self,
        (x, parameter): (Vec<Vec3>, f64),
        condition: &Condition<'_>,
        settings: &Settings,
    ) -> Result<Corrected<F::Error>, F::Error> {
        let mut at = match self.evaluate(x, parameter) {
            Ok(at) => at,
            Err(error) => return Ok(Corrected::Lost(Some(error))),
        };
        let form = self.metric.form(condition.direction);
        let (mut last, mut largest) = (f64::INFINITY, f64::INFINITY);
        loop {
            self.control.check()?;
            let balanced = at.residual <= settings.tolerance;
            let done = at.iterations >= MOST;
            if balanced && (last <= CLOSE || done && last <= NEARLY) {
                return Ok(Corrected::Found(Box::new(at)));
            }
            if done || !(at.energy.is_finite() && at.residual.is_finite() && last <= largest) {
                return Ok(Corrected::Lost(None));
            }
            let column = match self.by_parameter(&at) {
                Ok(column) => column,
                Err(error) => return Ok(Corrected::Lost(Some(error))),
            };
            if self.factorise(&mut at, settings.tolerance).is_err() {
                return Ok(Corrected::Lost(None));
            }
            let missed = self.missed(&at, condition);
            let down: Vec<Vec3> = at.gradient.iter().map(|g| -g).collect();
            let change = self.bordered.solve_bordered((&column, &form), (&down, -missed));
            largest = LARGEST * settings.longest_step;
            last = self.metric.norm(&change);
            let Some(next) = self.moved(&at, &change) else { return Ok(Corrected::Lost(None)) };
            let iterations = at.iterations + 1;
            self.tally().count(|work| work.iterations += 1);
            at = match self.evaluate(next, at.parameter + change.parameter) {
                Ok(next) => Equilibrium { iterations, ..next },
                Err(error) => return Ok(Corrected::Lost(Some(error))),
            };
        }
    }

    /// What is missing to `condition`.
    fn missed(&self, at: &Equilibrium, condition: &Condition<'_>) -> f64 {
        let mut x = at.x.clone();
        parallel::update(&mut x, |i, v| *v -= condition.x[i]);
        // Those that move with the parameter are no unknowns: the direction is 0 there.
        let from = Direction { x, parameter: at.parameter - condition.parameter };
        self.metric.inner(condition.direction, &from) - condition.distance
    }

    /// The shape of `at` after `change`, if that makes no triangle collapse.
    fn moved(&self, at: &Equilibrium, change: &Direction) -> Option<Vec<Vec3>> {
        let finite = change.parameter.is_finite() && self.metric.norm(change).is_finite();
        let mut next = at.x.clone();
        parallel::update(&mut next, |i, x| *x += change.x[i]);
        (finite && at.potential.keeps_triangles(&at.x, &next, AREA_SHARE, 0.0)).then_some(next)
    }
}

/// A correction longer than so many of the longest steps leads to another branch.
const LARGEST: f64 = 2.0;
