//! Times at which steps end because something jumps or bends there: laws, ramps and growth that read the time; and how long
//! steps between them may be.
//!
//! A step leads from just after one breakpoint to just before the next one, so that every evaluation within it is on
//! one side of a jump; what happens in between is round-off. The state is shown at the breakpoint itself.

use crate::effects::EffectSpec;
use crate::kinetics::breakpoints::{Course, SAMPLES, TimeDependence, sampled};
use crate::kinetics::{Batch, Column, Kinetics, Quantity, Signal, field};
use crate::model::{Chemistry, Evaluation};
use crate::num::{Short, real};
use crate::reduction::Reduction;
use crate::sheet::Sheet;
use crate::solve::replay::Window;

/// Distance of evaluations from a breakpoint, relative to its time: times of stages are rounded.
const BREAKPOINT_MARGIN: f64 = 64.0 * f64::EPSILON;
/// The same where the time is small, relative to the span.
const MIN_MARGIN: f64 = 1e-3 * BREAKPOINT_MARGIN;
/// Points at which a law is sampled, and values that this takes at most.
const SAMPLE_POINTS: usize = 16;
const MAX_VALUES: usize = 1 << 22;
/// Breakpoints of what differs from place to place: more are thinned out.
const MAX_BREAKPOINTS: usize = 100_000;
/// Steps over the span where a law that reads the time cannot be sampled.
const BLIND_STEPS: usize = 100;
/// So many breakpoints are listed.
const MAX_LISTED: usize = 6;

/// The breakpoints of a problem from time 0 to its end.
#[derive(Debug, Clone, Default)]
pub struct Breakpoints {
    /// Ascending.
    times: Vec<f64>,
    /// The course of what reads the time between them.
    courses: Vec<Course>,
    /// Whether there are any, on any rank.
    limits: bool,
    /// Where the last step was to end for their sake.
    limited: Option<f64>,
    /// End of the problem.
    until: f64,
    /// Whether those of the laws are among them.
    sampled: bool,
}

impl Breakpoints {
    /// Those of `effects` until the time `until`.
    pub(crate) fn collect<'a>(
        effects: impl IntoIterator<Item = &'a dyn EffectSpec>,
        sheet: &Sheet,
        until: f64,
    ) -> Self {
        let mut found = TimeDependence::default();
        effects.into_iter().for_each(|effect| found.add(effect.time_dependence(sheet, until)));
        let mut made = Self { until, ..Self::default() };
        made.add(found, sheet.reduction());
        made
    }

    /// Adds those of the laws, from their formulas or by sampling them with the species of the state, once; says what
    /// is not certain about them.
    pub fn sample(&mut self, at: &mut Evaluation<'_>) -> Option<String> {
        if std::mem::replace(&mut self.sampled, true) {
            return None;
        }
        let chemistry = at.model().chemistry()?;
        if !chemistry.signals().wanted().contains(&Signal::Time) {
            return None;
        }
        let mut found = TimeDependence::default();
        let note = of_laws(chemistry, at, self.until, &mut found);
        self.add(found, at.model().sheet().reduction());
        note
    }

    /// Brings the times into their order; those that no step can tell apart are one.
    fn add(&mut self, found: TimeDependence, reduction: &Reduction) {
        self.courses.extend(found.courses);
        self.limits = reduction.any(!self.courses.is_empty());
        let (until, mut times) = (self.until, std::mem::take(&mut self.times));
        times.extend(reduction.gathered(found.breakpoints));
        times.retain(|time| (0.0..=until).contains(time));
        times.sort_unstable_by(f64::total_cmp);
        for time in times {
            if self.times.last().is_none_or(|last| time - last > 4.0 * self.margin(time)) {
                self.times.push(time);
            }
        }
        if self.times.len() > MAX_BREAKPOINTS {
            let step = self.times.len().div_ceil(MAX_BREAKPOINTS);
            self.times = self.times.iter().step_by(step).copied().collect();
        }
    }

    /// Whether what reads the time still changes after `time`, on any rank.
    #[must_use]
    pub fn changes_after(&self, time: f64, reduction: &Reduction) -> bool {
        let last = self.times.iter().rfind(|last| **last < self.until);
        let later = last.is_some_and(|last| *last > time + self.margin(time));
        reduction.any(later || self.courses.iter().any(|course| course.changes_after(time)))
    }

    fn margin(&self, time: f64) -> f64 {
        (BREAKPOINT_MARGIN * time.abs()).max(MIN_MARGIN * self.until)
    }

    fn is_at(&self, breakpoint: f64, time: f64) -> bool {
        (time - breakpoint).abs() <= self.margin(breakpoint)
    }

    /// Whether a step was to end at `time` for what reads the time.
    #[must_use]
    pub fn include(&self, time: f64) -> bool {
        if self.limited == Some(time) {
            return true;
        }
        let next = self.times.partition_point(|other| *other < time);
        let near = self.times[next.saturating_sub(1)..].iter().take(2);
        near.into_iter().any(|breakpoint| self.is_at(*breakpoint, time))
    }

    /// The step from `time` that passes neither `until` nor a breakpoint.
    #[must_use]
    pub fn window(&self, time: f64, until: f64) -> Window {
        let mut window = Window { start: time, end: until, shown_time: until };
        let from = self.times.partition_point(|other| *other < time);
        for breakpoint in &self.times[from.saturating_sub(1)..] {
            let margin = self.margin(*breakpoint);
            if self.is_at(*breakpoint, time) {
                window.start = breakpoint.max(time) + margin;
            } else if *breakpoint > time {
                if self.is_at(*breakpoint, until) {
                    window.end = breakpoint.min(until) - margin;
                } else if *breakpoint < until {
                    (window.end, window.shown_time) = (breakpoint - margin, *breakpoint);
                }
                break;
            }
        }
        // Of what is shorter nothing is left.
        if window.end <= window.start {
            Window { start: time, end: until, shown_time: until }
        } else {
            window
        }
    }

    /// The same step, no longer than the course of what reads the time allows.
    pub fn limit(&mut self, window: Window, reduction: &Reduction) -> Window {
        self.limited = None;
        if !self.limits {
            return window;
        }
        let length = window.end - window.start;
        let limit = |length: f64, course: &Course| course.longest_step(window.start, length);
        let longest = reduction.min(1, |_| self.courses.iter().fold(length, limit));
        let end = window.start + longest;
        if longest >= length || end <= window.start {
            return window;
        }
        self.limited = Some(end);
        Window { end, shown_time: end, ..window }
    }

    /// The steps of a replay end where windows do: from a time to at most another.
    pub fn windows(&mut self, reduction: &Reduction) -> impl FnMut(f64, f64) -> Window {
        |time, until| self.limit(self.window(time, until), reduction)
    }

    /// Times up to the end at which what reads the time is near to any of its values, at most `most` of them. Collective.
    #[must_use]
    pub fn sample_times(&self, most: usize, reduction: &Reduction) -> Vec<f64> {
        let Self { times, courses, .. } = self.clone();
        let known = TimeDependence { breakpoints: times, courses };
        reduction.gathered(known.sample_times(self.until, most))
    }

    /// Those inside the span.
    #[must_use]
    pub fn times(&self) -> &[f64] {
        let inside = |time: &f64| *time > self.margin(*time) && !self.is_at(*time, self.until);
        let from = self.times.iter().position(inside).unwrap_or(self.times.len());
        let to = self.times.iter().rposition(inside).map_or(from, |last| last + 1);
        &self.times[from..to]
    }

    /// The first of them, in words; none without any.
    #[must_use]
    pub fn describe(&self) -> Option<String> {
        if self.times.is_empty() {
            return None;
        }
        let first: Vec<String> =
            self.times.iter().take(MAX_LISTED).map(|t| Short(*t).to_string()).collect();
        let more = match self.times.len().saturating_sub(MAX_LISTED) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        Some(format!(
            "steps end at t = {}{more}: laws, ramps or growth jump or bend there",
            first.join(", ")
        ))
    }
}

/// Adds those of the laws, and says what is not certain about them.
fn of_laws(
    chemistry: &Chemistry,
    at: &mut Evaluation<'_>,
    until: f64,
    found: &mut TimeDependence,
) -> Option<String> {
    let state = at.state();
    // A start without values is refused elsewhere.
    let signals = at.signals().ok()?.clone();
    let species: Vec<&[f64]> = state.species.iter().map(Vec::as_slice).collect();
    chemistry.with_inputs(&species, &signals, |kinetics, batch| {
        let known = kinetics.time_dependence(batch, until, found);
        let name = kinetics.descriptor().title();
        match sampled(until, |times| rates_at(chemistry, kinetics, batch, times)) {
            Some(sampled) => {
                found.breakpoints.extend(sampled.breakpoints);
                if !known {
                    found.courses.extend(sampled.courses);
                }
                (!known).then(|| {
                    format!(
                        "the rates of {name} read the time and were sampled at {} times of the start: what lasts less than \
                         {} between them is stepped over unless longest_step is shorter",
                        SAMPLES + 1,
                        Short(until / real(SAMPLES))
                    )
                })
            }
            // All is known already of what has no values for reasons of its own.
            None if known => None,
            None => {
                let times = &mut found.breakpoints;
                times.extend((1..BLIND_STEPS).map(|k| until * real(k) / real(BLIND_STEPS)));
                Some(format!(
                    "{name} reads the time but has no values at later times with the species of the start: its jumps are \
                     not known, and steps end at {BLIND_STEPS} equal parts of the span"
                ))
            }
        }
    })
}

/// The rates at some points of `batch` and all `times`, one column for each point and species.
fn rates_at(
    chemistry: &Chemistry,
    kinetics: &dyn Kinetics,
    batch: &Batch<'_>,
    times: &[f64],
) -> Option<Vec<Vec<f64>>> {
    let descriptor = kinetics.descriptor();
    let species = descriptor.species.len().max(1);
    let points =
        SAMPLE_POINTS.min(MAX_VALUES / (2 * species * SAMPLES)).clamp(1, batch.count.max(1));
    let chosen: Vec<usize> = (0..points).map(|k| k * batch.count / points).collect();
    let count = chosen.len() * times.len();
    let spread = |column: &Column<'_>| -> Vec<f64> {
        let values = chosen.iter().map(|point| column.at(*point));
        values.flat_map(|value| std::iter::repeat_n(value, times.len())).collect()
    };
    let time = descriptor
        .signals
        .iter()
        .flat_map(|read| read.signal.columns().iter().map(|_| read.signal));
    let signals: Vec<Vec<f64>> = batch
        .signals
        .iter()
        .zip(time)
        .map(|(column, signal)| match signal {
            Signal::Time => times.repeat(chosen.len()),
            _ => spread(column),
        })
        .collect();
    let parameters: Vec<Vec<f64>> = batch.parameters.iter().map(spread).collect();
    let mut all = Vec::new();
    // A pulse that multiplies a species is not seen where there is none of it.
    for more in [0.0, 1.0] {
        let mut values: Vec<Vec<f64>> = batch.species.iter().map(spread).collect();
        raise(&mut values, chemistry, more);
        let part = Batch {
            location: batch.location,
            first: 0,
            count,
            species: &columns(&values),
            signals: &columns(&signals),
            parameters: &columns(&parameters),
        };
        let mut rates = vec![vec![0.0; count]; descriptor.species.len()];
        let mut out: Vec<_> = rates.iter_mut().map(Vec::as_mut_slice).collect();
        match field::evaluate(kinetics, Quantity::Rates, &part, &mut out, &mut []) {
            Ok(_) => all.extend(
                rates.iter().flat_map(|column| column.chunks(times.len()).map(<[f64]>::to_vec)),
            ),
            Err(_) if more > 0.0 => {}
            Err(_) => return None,
        }
    }
    Some(all)
}

/// Adds `share` of the typical magnitudes to the values of all species, within their ranges.
fn raise(values: &mut [Vec<f64>], chemistry: &Chemistry, share: f64) {
    let species = &chemistry.descriptor().species;
    for ((values, species), typical) in values.iter_mut().zip(species).zip(chemistry.all_typical())
    {
        values
            .iter_mut()
            .for_each(|c| *c = (*c + share * typical).clamp(species.lower, species.upper));
    }
}

fn columns(all: &[Vec<f64>]) -> Vec<Column<'_>> {
    all.iter().map(Into::into).collect()
}
