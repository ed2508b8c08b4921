//! How long a run will take, from its first steps.
//!
//! Steps under error control begin tiny and grow, so the share of the way that is behind says little about
//! the rest. What is forecast are the numbers and lengths of the steps that are left (`step_sizes`) and what a
//! step of a length costs (`cost`):
//!
//! ```text
//! left = Σ n(h) c(h)
//! ```
//!
//! That is done again and again. A forecast is announced once it has settled: those made since `SINCE` of the
//! time reached say the same of the whole run within a factor of `AGREE` and what may be assumed within
//! `WIDEST`, the steps no longer grow by as much as
//! they may, and at least `BEHIND` of the way or of the cost is behind. Where the forecasts come to differ,
//! as in a snap, nothing is announced until they agree again.

mod cost;
mod preview;
mod run_forecast;
mod step_sizes;
pub mod words;

pub use preview::{Preview, preview};
pub(super) use run_forecast::{Clock, RunForecast};

use std::collections::VecDeque;

use self::cost::Cost;
use self::step_sizes::{EqualSteps, Trend};
use crate::num::real;
use crate::scene::Scene;
pub use crate::solve::StepRule;

/// Forecasts of the whole that are announced differ by this factor at most.
const AGREE: f64 = 2.0;
/// Part of the time reached since which forecasts have to agree.
const SINCE: f64 = 0.25;
/// Part of the way, or of the forecast cost, that is behind when a forecast is announced.
const BEHIND: f64 = 0.1;
/// What may be assumed gives wholes that differ by this factor at most.
const WIDEST: f64 = 4.0;
/// Shares of how lengths have gone with time, and costs with lengths, that are assumed to persist.
const LIKELY: (f64, f64) = (0.75, 1.0);
/// Steps that grow by more than this share of what they may, on a logarithmic scale, are still growing.
const GROWING: f64 = 0.7;
/// Part of the way after which steps that still grow are as long as they become.
const GROWN: f64 = 0.3;
/// Fewest steps behind a forecast, and fewest forecasts that agree.
const FEWEST: usize = 3;
/// Steps that are remembered at least.
const KEPT: usize = 2048;
/// A forecast is rebuilt when there are more steps by this share.
const AGAIN: f64 = 1.0 / 32.0;

/// Where a run goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Way {
    /// Its end.
    pub until: f64,
    /// Steps end at the multiples of this.
    pub every: f64,
    /// It ends after so many steps.
    pub max_steps: Option<u64>,
    /// It may end sooner, at an unknown time.
    pub may_end_sooner: bool,
}

impl Way {
    /// That of a scene.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let span = &scene.time.span;
        let until = span.until.get();
        Self {
            until,
            every: scene.output.every.map_or(until, |every| every.get().min(until)),
            max_steps: span.max_steps.map(|most| most.get() as u64),
            may_end_sooner: span.stop_when_steady.is_some(),
        }
    }
}

/// A step that was accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taken {
    /// Time at its end.
    pub time: f64,
    /// Its length.
    pub length: f64,
    /// The length that its error estimate allows, where known.
    pub allowed: Option<f64>,
    /// Whether it ends where the run wants a state, and might be longer otherwise.
    pub cut: bool,
    /// What it has cost, rejected attempts and output included, s.
    pub seconds: f64,
}

/// Seconds, with a range that they are likely to be in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Likely.
    pub likely: f64,
    /// At least.
    pub least: f64,
    /// At most.
    pub most: f64,
}

impl Range {
    /// These seconds alone.
    #[must_use]
    pub fn of(likely: f64) -> Self {
        Self { likely, least: likely, most: likely }
    }

    /// So many times as long, and then longer by so much.
    #[must_use]
    pub fn times_plus(self, factor: f64, more: f64) -> Self {
        let changed = |seconds: f64| factor * seconds + more;
        let Self { likely, least, most } = self;
        Self { likely: changed(likely), least: changed(least), most: changed(most) }
    }
}

/// A forecast of the whole run.
#[derive(Debug, Clone, Copy)]
struct Made {
    /// Steps by then, and the time that they had led to.
    steps: u64,
    time: f64,
    /// Seconds, the start included.
    whole: f64,
}

/// What the steps of a run have been, and what follows for the rest.
#[derive(Debug, Clone)]
pub struct Forecast {
    rule: StepRule,
    way: Way,
    /// The latest steps.
    steps: Vec<Taken>,
    /// Steps so far.
    count: u64,
    /// What relaxing the start has cost, s.
    start: f64,
    /// What that and all steps have cost, s.
    spent: f64,
    made: VecDeque<Made>,
    /// Steps and seconds that are left, by the last forecast.
    left: Option<(f64, Range)>,
}

impl Forecast {
    /// Of a run along `way` by steps of that rule, whose start has cost `start` seconds.
    #[must_use]
    pub fn new(rule: StepRule, way: Way, start: f64) -> Self {
        let (steps, made) = (Vec::new(), VecDeque::new());
        Self { rule, way, steps, count: 0, start, spent: start, made, left: None }
    }

    /// Records a step and updates the forecast.
    pub fn step(&mut self, taken: Taken) {
        self.count += 1;
        self.spent += taken.seconds;
        if self.steps.len() >= 2 * KEPT {
            self.steps.drain(..KEPT);
        }
        self.steps.push(taken);
        if let Some((steps, range)) = &mut self.left {
            // Until the next one the last forecast holds.
            let behind = (1.0 / steps.max(1.0)).min(1.0);
            *steps = (*steps - 1.0).max(0.0);
            *range = range.times_plus(1.0 - behind, 0.0);
        }
        let last = self.made.back().map_or(0, |made| made.steps);
        if self.steps.len() < FEWEST || real_of(self.count - last) < AGAIN * real_of(last) {
            return;
        }
        self.left = self.forecast();
        let Some((_, left)) = self.left else { return };
        let whole = self.spent + left.likely;
        self.made.push_back(Made { steps: self.count, time: taken.time, whole });
        while self.made.front().is_some_and(|made| made.time < SINCE * taken.time)
            && self.made.len() > FEWEST
        {
            self.made.pop_front();
        }
    }

    /// Steps that are left, as far as is known.
    #[must_use]
    pub fn steps_left(&self) -> Option<f64> {
        self.left.map(|(steps, _)| steps)
    }

    /// Seconds that are left, once that has settled.
    #[must_use]
    pub fn left(&self) -> Option<Range> {
        let (_, left) = self.left?;
        self.has_settled().then(|| {
            let earlier = || self.made.iter().map(|made| made.whole - self.spent);
            let least = earlier().fold(left.least, f64::min).max(0.0);
            Range { least, most: earlier().fold(left.most, f64::max), ..left }
        })
    }

    /// Seconds of the whole run, the start included, once that has settled.
    #[must_use]
    pub fn whole(&self) -> Option<Range> {
        Some(self.left()?.times_plus(1.0, self.spent))
    }

    /// The same at so many times the tolerance, or at steps so many times as long: the way that is behind is
    /// thought of as costing as many times as much as the rest.
    #[must_use]
    pub fn whole_at(&self, factor: f64) -> Option<f64> {
        let whole = self.whole()?.likely;
        let (_, now) = self.seconds_left(1.0, LIKELY)?;
        let (_, then) = self.seconds_left(factor, LIKELY)?;
        let other = self.start + (whole - self.start) * (then / now);
        // Nothing is left at the end.
        other.is_finite().then_some(other)
    }

    fn has_settled(&self) -> bool {
        let Some((_, left)) = self.left else { return false };
        let wholes = || self.made.iter().map(|made| made.whole);
        let (least, most) = (wholes().fold(f64::INFINITY, f64::min), wholes().fold(0.0, f64::max));
        let behind = self.spent - self.start;
        let far =
            self.time() >= BEHIND * self.way.until || behind >= BEHIND * (behind + left.likely);
        let narrow = self.spent + left.most <= WIDEST * (self.spent + left.least);
        self.made.len() >= FEWEST && most <= AGREE * least && narrow && far && self.has_grown()
    }

    /// Whether steps are no longer those of the beginning, which grow as fast as they may.
    fn has_grown(&self) -> bool {
        let StepRule::Controlled { growth, .. } = self.rule else { return true };
        let limit = growth.powf(GROWING);
        let mut lengths = self.steps.iter().rev().take(FEWEST).map(|step| step.length);
        let mut later = lengths.next().unwrap_or(0.0);
        let steady = lengths.all(|length| {
            let steady = later < limit * length;
            later = length;
            steady
        });
        steady || self.time() > GROWN * self.way.until
    }

    fn time(&self) -> f64 {
        self.steps.last().map_or(0.0, |step| step.time)
    }

    /// Steps and seconds that are left: the range is that of what may be assumed of lengths and costs.
    fn forecast(&self) -> Option<(f64, Range)> {
        let (steps, likely) = self.seconds_left(1.0, LIKELY)?;
        let scatter = self.cost().error().exp();
        let mut range = Range::of(likely);
        for assumed in [(0.0, 1.0), (1.0, 1.0), (LIKELY.0, 0.0)] {
            let (_, other) = self.seconds_left(1.0, assumed)?;
            range.least = range.least.min(other);
            range.most = range.most.max(other);
        }
        range.least /= scatter;
        range.most *= scatter;
        Some((steps, range))
    }

    fn cost(&self) -> Cost {
        Cost::of(&self.steps)
    }

    /// Steps and seconds that are left at so many times the tolerance, with these shares of how lengths go
    /// with time and costs with lengths.
    fn seconds_left(&self, tolerance: f64, (trend, power): (f64, f64)) -> Option<(f64, f64)> {
        let cost = self.cost().with_share(power);
        let pieces = self.pieces(tolerance, trend);
        let mut steps: f64 = pieces.iter().map(|piece| piece.count).sum();
        let mut seconds = pieces.iter().map(|p| p.count * cost.seconds(p.length)).sum();
        if let Some(most) = self.way.max_steps {
            let most = real_of(most.saturating_sub(self.count));
            if most < steps {
                seconds *= most / steps;
                steps = most;
            }
        }
        (f64::is_finite(seconds) && steps.is_finite()).then_some((steps, seconds))
    }

    /// The steps that are left.
    fn pieces(&self, tolerance: f64, share: f64) -> Vec<EqualSteps> {
        let time = self.time();
        match self.rule {
            StepRule::Fixed(length) => step_sizes::fixed(&self.way, time, tolerance * length),
            StepRule::Controlled { power, longest, growth, .. } => {
                let mut trend = Trend::of(&self.steps, self.way.until).with_scaled_exponent(share);
                let factor = tolerance.powf(1.0 / power);
                trend.scale(factor);
                let last = self.steps.last().map_or(0.0, |step| step.length);
                let next = factor * growth * last;
                step_sizes::controlled(&self.way, time, &trend, (next, growth), longest)
            }
        }
    }
}

fn real_of(count: u64) -> f64 {
    real(usize::try_from(count).unwrap_or(usize::MAX))
}
