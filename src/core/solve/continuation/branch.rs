//! A branch that is being followed: its steps, its end, and the way to another one.

use super::bordered::Bordered;
use super::corrector::{Condition, Corrected, Corrector, Equilibrium};
use super::metric::{Direction, Metric};
use super::special::LOCATED;
use super::{Event, Family, Point, Settings, check};
use crate::Vec3;
use crate::num::real;
use crate::parallel;
use crate::solve::stability::Stability;
use crate::solve::{Control, SolveError};

/// Iterations of the corrector at which steps keep their length.
const ITERATIONS: f64 = 4.0;
/// A step is at most so many times as long as the one before.
const GROWTH: f64 = 2.0;
/// Cosine of the largest angle between two tangents one after the other.
const TURN: f64 = 0.5;
/// Steps over more bifurcations than are located one by one are halved down to this share of the longest step: those
/// that are nearer to one another count as one. A smaller share tells more of them apart and costs a corrector each time.
const APART: f64 = 1e-3;

/// A branch that is being followed.
pub struct Continuation<F: Family> {
    pub(super) corrector: Corrector<F>,
    pub(super) stability: Stability,
    settings: Settings,
    pub(super) point: Point,
    pub(super) tangent: Direction,
    step: f64,
    ended: bool,
}

impl<F: Family> Continuation<F> {
    /// Begins at the equilibrium of `parameter` near `x`, towards larger λ or smaller ones, as `forward` says.
    ///
    /// # Errors
    /// [`SolveError::Continuation`] if no equilibrium is near; effects that a branch cannot have; those of the family.
    pub fn new(
        mut family: F,
        (x, parameter): (Vec<Vec3>, f64),
        forward: bool,
        settings: Settings,
        control: &Control,
    ) -> Result<Self, F::Error> {
        let potential = family.potential(parameter)?;
        let mechanics = potential.mechanics();
        check(mechanics)?;
        let stability = Stability::new(mechanics)?.with_control(control);
        let scale = (settings.range.end() - settings.range.start()).abs();
        let reduction = mechanics.sheet().reduction();
        let metric = Metric::new(stability.mass(), (settings.length, scale), reduction);
        let bordered = Bordered::new(mechanics)?;
        let mut corrector = Corrector { family, bordered, metric, control: control.clone() };
        let mut along = corrector.metric.parameter(x.len());
        let condition = Condition { direction: &along, x: &x, parameter, distance: 0.0 };
        let mut at = match corrector.correct((x.clone(), parameter), &condition, &settings)? {
            Corrected::Found(at) => *at,
            Corrected::Lost(Some(error)) => return Err(error),
            Corrected::Lost(None) => return Err(lost(parameter, 0.0).into()),
        };
        if !forward {
            along.parameter = -along.parameter;
        }
        let tangent = tangent(&mut corrector, &mut at, &along, &settings)?;
        let step = settings.first_step;
        let mut made = Self {
            point: Point::of(&at, 0.0, 0),
            corrector,
            stability,
            settings,
            tangent,
            step,
            ended: false,
        };
        made.point.negative = made.negative(&mut at)?;
        made.point.event = Event::Start;
        Ok(made)
    }

    /// Where it is.
    #[must_use]
    pub fn point(&self) -> &Point {
        &self.point
    }

    /// dλ/ds in units of Λ: 0 at a fold.
    #[must_use]
    pub fn slope(&self) -> f64 {
        self.tangent.parameter / self.corrector.metric.scale()
    }

    /// Whether it has left the range of λ.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.ended
    }

    /// The family.
    pub fn family(&mut self) -> &mut F {
        &mut self.corrector.family
    }

    /// One step along the branch; the points from the one before on: special ones in between, and where it leads.
    ///
    /// # Errors
    /// [`SolveError::Continuation`] if no step leads on, [`SolveError::Interrupted`], and those of the family; it is then
    /// where it was.
    pub fn advance(&mut self) -> Result<Vec<Point>, F::Error> {
        let mut reason = None;
        let tally = self.corrector.tally().clone();
        loop {
            if self.step < self.settings.least_step {
                let lost = || lost(self.point.parameter, self.settings.least_step).into();
                return Err(reason.unwrap_or_else(lost));
            }
            let (from, ahead) = (&self.point, &self.tangent);
            let guess =
                (moved(&from.x, self.step, &ahead.x), from.parameter + self.step * ahead.parameter);
            match self.correct_from(guess, &self.tangent.clone(), self.step)? {
                Corrected::Found(at) => {
                    if let Some(points) = self.accept(*at)? {
                        tally.count(|work| work.steps += 1);
                        return Ok(points);
                    }
                }
                Corrected::Lost(why) => reason = why.or(reason),
            }
            tally.count(|work| work.rejected += 1);
            self.step *= 0.5;
        }
    }

    /// Leaves the branch at `from`, a bifurcation on it, along the mode `number` of that: forwards, or backwards where
    /// `reverse`. The first points of the other branch.
    ///
    /// # Errors
    /// [`SolveError::Continuation`] if no equilibrium is found there, and as [`Self::advance`].
    pub fn switch(
        &mut self,
        from: &Point,
        number: usize,
        reverse: bool,
    ) -> Result<Vec<Point>, F::Error> {
        let Event::Bifurcation(modes) = &from.event else { return Ok(Vec::new()) };
        let Some(mode) = modes.get(number) else { return Ok(Vec::new()) };
        let mut along = Direction { x: mode.shape.clone(), parameter: 0.0 };
        let length = self.corrector.metric.norm(&along);
        along.scale(if reverse { -1.0 } else { 1.0 } / length);
        self.point = Point { event: Event::None, ..from.clone() };
        self.tangent = along;
        (self.step, self.ended) = (self.settings.first_step, false);
        // Tangents across the bifurcation are at any angle to its mode.
        let mut reason = None;
        while self.step >= self.settings.least_step {
            let guess = (moved(&from.x, self.step, &self.tangent.x), from.parameter);
            match self.correct_from(guess, &self.tangent.clone(), self.step)? {
                Corrected::Found(mut at) => {
                    let tangent = self.tangent_at(&mut at)?;
                    let negative = self.negative(&mut at)?;
                    return self.arrive(*at, (tangent, negative), Vec::new());
                }
                Corrected::Lost(why) => reason = why.or(reason),
            }
            self.step *= 0.5;
        }
        Err(reason.unwrap_or_else(|| lost(from.parameter, self.settings.least_step).into()))
    }

    /// The equilibrium near `guess` at the distance `distance` along `direction` from the point.
    pub(super) fn correct_from(
        &mut self,
        guess: (Vec<Vec3>, f64),
        direction: &Direction,
        distance: f64,
    ) -> Result<Corrected<F::Error>, F::Error> {
        let Point { x, parameter, .. } = &self.point;
        let condition = Condition { direction, x, parameter: *parameter, distance };
        self.corrector.correct(guess, &condition, &self.settings)
    }

    /// The tangent at `at`, at an angle below 90° to the last one.
    pub(super) fn tangent_at(&mut self, at: &mut Equilibrium) -> Result<Direction, F::Error> {
        let Self { corrector, tangent, settings, .. } = self;
        self::tangent(corrector, at, tangent, settings)
    }

    /// Negative eigenvalues at `at`.
    pub(super) fn negative(&mut self, at: &mut Equilibrium) -> Result<usize, SolveError> {
        Ok(self.stability.inertia(&mut at.potential, &at.x)?.negative)
    }

    /// Takes over `at`, with the special points on the way, unless the step was too long.
    fn accept(&mut self, mut at: Equilibrium) -> Result<Option<Vec<Point>>, F::Error> {
        let tangent = self.tangent_at(&mut at)?;
        let divisible = 0.5 * self.step >= self.settings.least_step;
        let turned = self.corrector.metric.inner(&self.tangent, &tangent);
        if turned < TURN && divisible {
            return Ok(None);
        }
        let negative = self.negative(&mut at)?;
        let fold = self.tangent.parameter * tangent.parameter < 0.0;
        let changed = negative.abs_diff(self.point.negative);
        // A fold turns one eigenvalue; other changes are bifurcations.
        if fold && changed != 1 && divisible {
            return Ok(None);
        }
        let passed = changed.abs_diff(usize::from(fold));
        if passed > LOCATED && 0.5 * self.step >= APART * self.settings.longest_step {
            return Ok(None);
        }
        let events = self.special(&mut at, (&tangent, negative), fold)?;
        let located = events.iter().any(|point| matches!(point.event, Event::Bifurcation(_)));
        let mut points = self.arrive(at, (tangent, negative), events)?;
        if passed > 0
            && !located
            && let Some(last) = points.last_mut().filter(|last| last.event == Event::None)
        {
            last.event = Event::Passed(passed);
        }
        Ok(Some(points))
    }

    /// Goes to `at`, with that tangent and so many negative eigenvalues, after the special points `before`.
    fn arrive(
        &mut self,
        at: Equilibrium,
        (tangent, negative): (Direction, usize),
        mut before: Vec<Point>,
    ) -> Result<Vec<Point>, F::Error> {
        let range = self.settings.range.clone();
        if !range.contains(&at.parameter) {
            let end = if at.parameter > *range.end() { *range.end() } else { *range.start() };
            if let Some(mut last) = self.at_parameter(&at, end)? {
                let negative = self.negative(&mut last)?;
                let arc = self.point.arc + self.distance(&last);
                self.point = Point { event: Event::End, ..Point::of(&last, arc, negative) };
                before.retain(|point| range.contains(&point.parameter) && point.arc <= arc);
                self.ended = true;
                before.push(self.point.clone());
                return Ok(before);
            }
        }
        let arc = self.point.arc + self.distance(&at);
        self.ended = !range.contains(&at.parameter);
        self.point = Point::of(&at, arc, negative);
        self.tangent = tangent;
        let factor = GROWTH.powf((ITERATIONS - real(at.iterations)) / 2.0).clamp(0.5, GROWTH);
        self.step = (self.step * factor).min(self.settings.longest_step);
        before.push(self.point.clone());
        Ok(before)
    }

    /// The equilibrium at λ = `end` between the point and `at`.
    fn at_parameter(
        &mut self,
        at: &Equilibrium,
        end: f64,
    ) -> Result<Option<Equilibrium>, F::Error> {
        let share = (end - self.point.parameter) / (at.parameter - self.point.parameter);
        if !(share > 0.0) {
            return Ok(None);
        }
        let between = |(from, to): (&Vec3, &Vec3)| from + share * (to - from);
        let x: Vec<Vec3> = self.point.x.iter().zip(&at.x).map(between).collect();
        let along = self.corrector.metric.parameter(x.len());
        let condition = Condition { direction: &along, x: &at.x, parameter: end, distance: 0.0 };
        Ok(match self.corrector.correct((x.clone(), end), &condition, &self.settings)? {
            Corrected::Found(at) => Some(*at),
            Corrected::Lost(_) => None,
        })
    }

    /// Arc length of the chord from the point to `at`.
    pub(super) fn distance(&self, at: &Equilibrium) -> f64 {
        let x = at.x.iter().zip(&self.point.x).map(|(to, from)| to - from).collect();
        self.corrector.metric.norm(&Direction { x, parameter: at.parameter - self.point.parameter })
    }
}

impl Point {
    /// Of an equilibrium.
    pub(super) fn of(at: &Equilibrium, arc: f64, negative: usize) -> Self {
        let Equilibrium { parameter, energy, residual, iterations, .. } = *at;
        let (x, event) = (at.x.clone(), Event::None);
        Self { arc, parameter, x, energy, residual, negative, iterations, event }
    }
}

/// The tangent at `at`, of length 1, at an angle below 90° to `earlier`.
fn tangent<F: Family>(
    corrector: &mut Corrector<F>,
    at: &mut Equilibrium,
    earlier: &Direction,
    settings: &Settings,
) -> Result<Direction, F::Error> {
    let column = corrector.by_parameter(at)?;
    corrector.factorise(at, settings.tolerance)?;
    let form = corrector.metric.form(earlier);
    let none = vec![Vec3::zeros(); at.x.len()];
    let mut tangent = corrector.bordered.solve_bordered((&column, &form), (&none, 1.0));
    let length = corrector.metric.norm(&tangent);
    tangent.scale(1.0 / length);
    Ok(tangent)
}

/// `x + step · direction`.
fn moved(x: &[Vec3], step: f64, direction: &[Vec3]) -> Vec<Vec3> {
    let mut x = x.to_vec();
    parallel::update(&mut x, |i, x| *x += step * direction[i]);
    x
}

/// That no equilibrium is found beyond λ = `parameter`.
fn lost(parameter: f64, step: f64) -> SolveError {
    SolveError::Continuation { parameter, step }
}
