//! A branch that is being followed: its steps, its end, and the way to another one.

use super::corrector::{Condition, Corrector, CorrectorOutcome};
use super::metric::Metric;
use super::system::{Equilibrium, System};
use super::{Direction, Event, Point, Settings, Unknowns, UnstableDirections};
use crate::num::real;
use crate::solve::{Control, SolveError};

/// Iterations of the corrector at which steps keep their length.
const TARGET_ITERATIONS: f64 = 4.0;
/// A step is at most so many times as long as the one before.
const MAX_STEP_GROWTH: f64 = 2.0;
/// Cosine of the largest angle between two tangents one after the other.
const MIN_TANGENT_COSINE: f64 = 0.5;
/// Steps over more bifurcations than are located one by one are halved down to this share of the longest step: those
/// that are nearer to one another count as one. A smaller share tells more of them apart and costs a corrector each time.
const MIN_HALVED_STEP: f64 = 1e-3;

/// Most bifurcations that are located one by one in one step; more are one, at the place of the first. Each costs some
/// ten spectra.
pub(super) const MAX_LOCATED: usize = 2;

/// A branch that is being followed.
pub struct Continuation<S: System> {
    pub(super) corrector: Corrector<S>,
    settings: Settings,
    pub(super) point: Point,
    pub(super) tangent: Direction,
    step: f64,
    ended: bool,
}

impl<S: System> Continuation<S> {
    /// Begins at the equilibrium of `parameter` near `start`, towards larger λ or smaller ones, as `forward` says.
    ///
    /// # Errors
    /// [`SolveError::Continuation`] if no equilibrium is near; those of the system.
    pub(super) fn begin(
        (system, metric): (S, Metric),
        (start, parameter): (Unknowns, f64),
        forward: bool,
        settings: Settings,
        control: &Control,
    ) -> Result<Self, S::Error> {
        let mut corrector = Corrector { system, metric, control: control.clone() };
        let mut along = corrector.metric.parameter(&start);
        let condition = Condition { direction: &along, at: &start, parameter, distance: 0.0 };
        let mut at = match corrector.correct((start.clone(), parameter), &condition, &settings)? {
            CorrectorOutcome::Found(at) => *at,
            CorrectorOutcome::Lost(Some(error)) => return Err(error),
            CorrectorOutcome::Lost(None) => return Err(lost(parameter, 0.0).into()),
        };
        if !forward {
            along.parameter = -along.parameter;
        }
        let tangent = tangent(&mut corrector, &mut at, &along, &settings)?;
        let (step, ended) = (settings.first_step, false);
        let unstable = corrector.system.unstable_directions(&mut at)?;
        let point = Point { event: Event::Start, ..Point::new(&at, 0.0, unstable) };
        Ok(Self { point, corrector, settings, tangent, step, ended })
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

    /// What is followed.
    pub fn system(&mut self) -> &mut S {
        &mut self.corrector.system
    }

    /// One step along the branch; the points from the one before on: special ones in between, and where it leads.
    ///
    /// # Errors
    /// [`SolveError::Continuation`] if no step leads on, [`SolveError::Interrupted`], and those of the family; it is then
    /// where it was.
    pub fn advance(&mut self) -> Result<Vec<Point>, S::Error> {
        let mut reason = None;
        let tally = self.corrector.system.tally().clone();
        loop {
            if self.step < self.settings.least_step {
                let lost = || lost(self.point.parameter, self.settings.least_step).into();
                return Err(reason.unwrap_or_else(lost));
            }
            let (from, ahead) = (&self.point, &self.tangent);
            let guess = from.at.plus(self.step, &ahead.unknowns);
            let guess = (guess, from.parameter + self.step * ahead.parameter);
            match self.correct_from(guess, &self.tangent.clone(), self.step)? {
                CorrectorOutcome::Found(at) => {
                    if let Some(points) = self.accept(*at)? {
                        tally.count(|work| work.steps += 1);
                        return Ok(points);
                    }
                }
                CorrectorOutcome::Lost(why) => reason = why.or(reason),
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
    ) -> Result<Vec<Point>, S::Error> {
        let Event::Bifurcation(modes) = &from.event else { return Ok(Vec::new()) };
        let Some(mode) = modes.get(number) else { return Ok(Vec::new()) };
        let mut along = Direction { unknowns: mode.shape.clone(), parameter: 0.0 };
        let length = self.corrector.metric.norm(&along);
        along.scale(if reverse { -1.0 } else { 1.0 } / length);
        self.point = Point { event: Event::None, ..from.clone() };
        self.tangent = along;
        (self.step, self.ended) = (self.settings.first_step, false);
        // Tangents across the bifurcation are at any angle to its mode.
        let mut reason = None;
        while self.step >= self.settings.least_step {
            let guess = (from.at.plus(self.step, &self.tangent.unknowns), from.parameter);
            match self.correct_from(guess, &self.tangent.clone(), self.step)? {
                CorrectorOutcome::Found(mut at) => {
                    let tangent = self.tangent_at(&mut at)?;
                    let unstable = self.corrector.system.unstable_directions(&mut at)?;
                    return self.arrive(*at, (tangent, unstable), Vec::new());
                }
                CorrectorOutcome::Lost(why) => reason = why.or(reason),
            }
            self.step *= 0.5;
        }
        Err(reason.unwrap_or_else(|| lost(from.parameter, self.settings.least_step).into()))
    }

    /// The equilibrium near `guess` at the distance `distance` along `direction` from the point.
    pub(super) fn correct_from(
        &mut self,
        guess: (Unknowns, f64),
        direction: &Direction,
        distance: f64,
    ) -> Result<CorrectorOutcome<S>, S::Error> {
        let Point { at, parameter, .. } = &self.point;
        let condition = Condition { direction, at, parameter: *parameter, distance };
        self.corrector.correct(guess, &condition, &self.settings)
    }

    /// The tangent at `at`, at an angle below 90° to the last one.
    pub(super) fn tangent_at(
        &mut self,
        at: &mut Equilibrium<S::Member>,
    ) -> Result<Direction, S::Error> {
        let Self { corrector, tangent, settings, .. } = self;
        self::tangent(corrector, at, tangent, settings)
    }

    /// Takes over `at`, with the special points on the way, unless the step was too long.
    fn accept(&mut self, mut at: Equilibrium<S::Member>) -> Result<Option<Vec<Point>>, S::Error> {
        let tangent = self.tangent_at(&mut at)?;
        let divisible = 0.5 * self.step >= self.settings.least_step;
        let turned = self.corrector.metric.inner(&self.tangent, &tangent);
        if turned < MIN_TANGENT_COSINE && divisible {
            return Ok(None);
        }
        // Pivots of an indefinite matrix may vanish at one point and not at the next.
        let unstable = match self.corrector.system.unstable_directions(&mut at) {
            Err(SolveError::Linear(_)) if divisible => return Ok(None),
            counted => counted?,
        };
        let fold = self.tangent.parameter * tangent.parameter < 0.0;
        let changed = unstable.distance(self.point.unstable_directions());
        // A fold turns one eigenvalue; other changes are bifurcations.
        if fold && changed != 1 && divisible {
            return Ok(None);
        }
        let passed = changed.abs_diff(usize::from(fold));
        if passed > MAX_LOCATED && 0.5 * self.step >= MIN_HALVED_STEP * self.settings.longest_step {
            return Ok(None);
        }
        let events = self.special(&mut at, (&tangent, unstable), fold)?;
        let is_change =
            |event: &Event| matches!(event, Event::Bifurcation(_) | Event::Singularity(_));
        let located = events.iter().any(|point| is_change(&point.event));
        let mut points = self.arrive(at, (tangent, unstable), events)?;
        if passed > 0
            && !located
            && let Some(last) = points.last_mut().filter(|last| last.event == Event::None)
        {
            last.event = Event::Passed(passed);
        }
        Ok(Some(points))
    }

    /// Goes to `at`, with that tangent and so many growing disturbances, after the special points `before`.
    fn arrive(
        &mut self,
        at: Equilibrium<S::Member>,
        (tangent, unstable): (Direction, UnstableDirections),
        mut before: Vec<Point>,
    ) -> Result<Vec<Point>, S::Error> {
        let range = self.settings.range.clone();
        if !range.contains(&at.parameter) {
            let end = if at.parameter > *range.end() { *range.end() } else { *range.start() };
            if let Some(mut last) = self.at_parameter(&at, end)? {
                let unstable = self.corrector.system.unstable_directions(&mut last)?;
                let arc = self.point.arc + self.distance(&last);
                self.point = Point { event: Event::End, ..Point::new(&last, arc, unstable) };
                before.retain(|point| range.contains(&point.parameter) && point.arc <= arc);
                self.ended = true;
                before.push(self.point.clone());
                return Ok(before);
            }
        }
        let arc = self.point.arc + self.distance(&at);
        self.ended = !range.contains(&at.parameter);
        self.point = Point::new(&at, arc, unstable);
        self.tangent = tangent;
        let factor = MAX_STEP_GROWTH
            .powf((TARGET_ITERATIONS - real(at.iterations)) / 2.0)
            .clamp(0.5, MAX_STEP_GROWTH);
        self.step = (self.step * factor).min(self.settings.longest_step);
        before.push(self.point.clone());
        Ok(before)
    }

    /// The equilibrium at λ = `end` between the point and `at`.
    fn at_parameter(
        &mut self,
        at: &Equilibrium<S::Member>,
        end: f64,
    ) -> Result<Option<Equilibrium<S::Member>>, S::Error> {
        let share = (end - self.point.parameter) / (at.parameter - self.point.parameter);
        if !(share > 0.0) {
            return Ok(None);
        }
        let way = at.at.plus(-1.0, &self.point.at);
        let guess = self.point.at.plus(share, &way);
        let along = self.corrector.metric.parameter(&guess);
        let condition = Condition { direction: &along, at: &at.at, parameter: end, distance: 0.0 };
        Ok(match self.corrector.correct((guess, end), &condition, &self.settings)? {
            CorrectorOutcome::Found(at) => Some(*at),
            CorrectorOutcome::Lost(_) => None,
        })
    }

    /// Arc length of the chord from the point to `at`.
    pub(super) fn distance(&self, at: &Equilibrium<S::Member>) -> f64 {
        let unknowns = at.at.plus(-1.0, &self.point.at);
        let parameter = at.parameter - self.point.parameter;
        self.corrector.metric.norm(&Direction { unknowns, parameter })
    }
}

impl Point {
    /// Of an equilibrium.
    pub(super) fn new<M>(found: &Equilibrium<M>, arc: f64, unstable: UnstableDirections) -> Self {
        let Equilibrium { parameter, energy, residual, iterations, .. } = *found;
        let (at, event) = (found.at.clone(), Event::None);
        let (negative, negative_of_shape) = (unstable.total(), unstable.shape);
        Self {
            arc,
            parameter,
            at,
            energy,
            residual,
            negative,
            negative_of_shape,
            iterations,
            event,
        }
    }

    /// How many disturbances grow.
    pub(super) fn unstable_directions(&self) -> UnstableDirections {
        let shape = self.negative_of_shape;
        UnstableDirections { shape, coupled: self.negative.saturating_sub(shape) }
    }
}

/// The tangent at `at`, of length 1, at an angle below 90° to `earlier`.
fn tangent<S: System>(
    corrector: &mut Corrector<S>,
    at: &mut Equilibrium<S::Member>,
    earlier: &Direction,
    settings: &Settings,
) -> Result<Direction, S::Error> {
    let column = corrector.by_parameter(at)?;
    let Corrector { system, metric, .. } = corrector;
    system.factorise(at, settings.tolerance)?;
    let none = at.at.zeros_like();
    let mut tangent = system.solve_bordered((&column, &metric.form(earlier)), (&none, 1.0))?;
    let length = metric.norm(&tangent);
    tangent.scale(1.0 / length);
    Ok(tangent)
}

/// That no equilibrium is found beyond λ = `parameter`.
fn lost(parameter: f64, step: f64) -> SolveError {
    SolveError::Continuation { parameter, step }
}
