//! How long a run will take, from its first steps.
//!
//! Steps under error control begin tiny and grow, so the share of the way that is behind says little about
//! the rest. What is forecast are the numbers and lengths of the steps that are left (`step_sizes`) and what a
//! step of a length costs, which goes with a power of it:
//!
//! ```text
//! left = Σ n(h) c(h),  c(h) = c₀ (h/h₀)^b
//! ```
//!
//! That is done again and again. A forecast is announced once it has settled: those made since `SINCE` of the
//! time reached, and what the last one assumes, say the same of the whole run within a factor of `WIDEST`, the steps
//! no longer grow by as much as they may, and at least `BEHIND` of the way or of the cost is behind. Where the
//! forecasts come to differ, as in a snap, nothing is announced until they agree again.

mod power_law;
mod run_forecast;
mod step_sizes;
pub mod words;

pub(super) use run_forecast::{Clock, RunForecast};
pub use words::Range;

use self::power_law::PowerLaw;
use crate::num::checked::AtLeast;
use crate::num::real;
use crate::scene::Scene;
pub use crate::solve::StepRule;

/// Share of the time reached since which steps count and forecasts have to agree.
const SINCE: f64 = 0.25;
/// Forecasts that are announced, and the ends of the last one, give wholes that differ by this factor at most.
const WIDEST: f64 = 3.0;
/// Part of the way, or of the forecast cost, that is behind when a forecast is announced.
const BEHIND: f64 = 0.1;
/// Share of how lengths have gone with time that is assumed to persist.
const LIKELY: f64 = 0.75;
/// Steps that grow by more than this share of what they may, on a logarithmic scale, are still growing.
const GROWING: f64 = 0.7;
/// Part of the way after which steps that still grow are as long as they become.
const GROWN: f64 = 0.3;
/// Fewest steps behind a forecast, and fewest forecasts that agree.
const FEWEST: usize = 3;
/// Steps that are remembered at least.
const KEPT: usize = 1024;
/// A forecast is rebuilt after one more step, and one more for so many steps so far.
const AGAIN: usize = 32;
/// Most steps that say what a step costs.
const LATEST: usize = 64;
/// The most that a step counts for, in medians: one on which a sheet snaps may cost as much as all others.
const MOST: f64 = 2.0;
/// The least cost of a step, s: clocks tick.
const TICK: f64 = 1e-9;
/// Relaxations take longer after long steps, but not by as much; the second number is the weight of that.
const PRIOR: (f64, f64) = (0.3, 8.0);
/// Times are the same within this share of a step.
const SAME: f64 = 1e-9;

/// Where a run goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Way {
    /// Its end.
    pub until: f64,
    /// Steps end at the multiples of this.
    pub every: f64,
    /// It ends after so many steps.
    pub max_steps: Option<usize>,
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
            max_steps: span.max_steps.map(AtLeast::get),
            may_end_sooner: span.stop_when_steady.is_some(),
        }
    }

    /// The first output time after `time`.
    fn next_output(&self, time: f64) -> f64 {
        let number = (time / self.every * (1.0 + SAME)).floor() + 1.0;
        (number * self.every).min(self.until)
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

/// What the steps of a run have been, and what follows for the rest.
#[derive(Debug, Clone)]
pub struct Forecast {
    rule: StepRule,
    way: Way,
    /// The latest steps.
    steps: Vec<Taken>,
    /// Steps so far.
    count: usize,
    /// What relaxing the start has cost, s.
    start: f64,
    /// What that and all steps have cost, s.
    spent: f64,
    /// Steps after which the next forecast is made.
    due: usize,
    /// All steps by the last forecast, which holds until the next.
    total: Option<f64>,
    /// Forecasts that have to agree: when they were made, and the seconds of the whole, the start included.
    made: Vec<(f64, Range)>,
}

impl Forecast {
    /// Of a run along `way` by steps of that rule, whose start has cost `start` seconds.
    #[must_use]
    pub fn new(rule: StepRule, way: Way, start: f64) -> Self {
        let (steps, made) = (Vec::new(), Vec::new());
        Self { rule, way, steps, count: 0, start, spent: start, due: FEWEST, total: None, made }
    }

    /// Records a step and updates the forecast.
    pub fn step(&mut self, taken: Taken) {
        self.count += 1;
        self.spent += taken.seconds;
        if self.steps.len() >= 2 * KEPT {
            self.steps.drain(..KEPT);
        }
        self.steps.push(taken);
        if self.count >= self.due {
            self.due = self.count + 1 + self.count / AGAIN;
            self.forecast();
        }
    }

    /// Steps that are left, as far as is known.
    #[must_use]
    pub fn steps_left(&self) -> Option<f64> {
        self.total.map(|total| (total - real(self.count)).max(0.0))
    }

    /// Seconds that are left, once that has settled.
    #[must_use]
    pub fn left(&self) -> Option<Range> {
        Some(self.whole()?.map(|whole| whole - self.spent))
    }

    /// Seconds of the whole run, the start included, once that has settled.
    #[must_use]
    pub fn whole(&self) -> Option<Range> {
        let last = self.made.last()?.1;
        let likely = self.made.iter().map(|(_, whole)| whole.likely);
        let range = Range::spanning(last.likely, likely.chain([last.least, last.most]));
        let behind = self.spent - self.start;
        let far =
            self.time() >= BEHIND * self.way.until || behind >= BEHIND * (last.likely - self.start);
        let agree = last.likely.is_finite() && range.most / range.least <= WIDEST;
        let settled = self.made.len() >= FEWEST && agree && far && self.has_grown();
        settled.then(|| range.map(|seconds| seconds.max(self.spent)))
    }

    /// The same at so many times the tolerance, or at steps so many times as long: the way that is behind is
    /// thought of as costing as many times as much as the rest.
    #[must_use]
    pub fn whole_at(&self, factor: f64) -> Option<f64> {
        let whole = self.whole()?.likely;
        let [(_, now), (_, then)] = [1.0, factor].map(|factor| self.rest(factor, LIKELY));
        let other = self.start + (whole - self.start) * (then / now);
        // Nothing is left at the end.
        other.is_finite().then_some(other)
    }

    /// Whether steps are no longer those of the beginning, which grow as fast as they may.
    fn has_grown(&self) -> bool {
        let StepRule::Controlled { growth, .. } = self.rule else { return true };
        let limit = growth.powf(GROWING);
        let mut latest = self.steps.windows(2).rev().take(FEWEST - 1);
        self.time() > GROWN * self.way.until
            || latest.all(|pair| pair[1].length < limit * pair[0].length)
    }

    fn time(&self) -> f64 {
        self.steps.last().map_or(0.0, |step| step.time)
    }

    /// Forecasts the whole run: the range is that of what lengths may do.
    fn forecast(&mut self) {
        let (steps, likely) = self.rest(1.0, LIKELY);
        let left = Range::spanning(likely, [0.0, 1.0].map(|share| self.rest(1.0, share).1));
        self.total = Some(real(self.count) + steps);
        let (time, spent) = (self.time(), self.spent);
        self.made.retain(|(made, _)| *made >= SINCE * time);
        self.made.push((time, left.map(|left| spent + left)));
    }

    /// What a step of a length costs, by the later half of the steps.
    fn cost(&self) -> PowerLaw {
        let half = self.steps.len().div_ceil(2).clamp(FEWEST, LATEST).min(self.steps.len());
        let latest = &self.steps[self.steps.len() - half..];
        let mut costs: Vec<f64> = latest.iter().map(|step| step.seconds).collect();
        costs.sort_by(f64::total_cmp);
        let most = MOST * costs.get(half / 2).copied().unwrap_or_default();
        let cost = |step: &Taken| step.seconds.min(most).max(TICK).ln();
        let points = latest.iter().map(|step| (step.length.ln(), cost(step), 1.0));
        PowerLaw::fit(&points.collect::<Vec<_>>(), PRIOR)
    }
}
