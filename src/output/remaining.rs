//! How much longer a run takes, or nothing where it cannot be estimated.
//!
//! Steps under error control begin tiny and grow, so the share of the way that is behind says little
//! about the rest. What is read is the length h of steps over the latest part of the run, in two
//! halves, which gives two forecasts of the number of steps in the rest of the way s,
//!
//! ```text
//! n₁ = s/h                 the length of the later half stays
//! n₂ = ln(1 + k s/h)/k     it goes on changing at the rate k a step between the halves
//! ```
//!
//! and with the mean cost of a step, which is left out of the halves because clocks are noisy, the time.
//! Where the two differ widely no estimate is given.

use std::collections::VecDeque;

use rumple_numerics::num::real;

/// Fewest seconds of steps behind a forecast.
const LEAST_SECONDS: f64 = 2.0;
/// Fewest steps in each half: one or two show no trend.
const LEAST_STEPS: usize = 3;
/// The share of the seconds so far that counts as the latest part: old steps are forgotten, and one
/// slow step does not yet decide.
const LATEST: f64 = 0.5;
/// A forecast reaches no further than this many times the latest part.
const REACH: f64 = 100.0;
/// The two forecasts differ by this factor at most.
const AGREE: f64 = 2.0;
/// Steps that are remembered; halved when there are more, so that any length of run is covered.
const KEPT: usize = 256;

/// A step that was taken.
#[derive(Debug, Clone, Copy, Default)]
struct Step {
    /// Seconds since the beginning.
    seconds: f64,
    /// Simulated time.
    time: f64,
    /// How many there are with it.
    number: usize,
}

/// Times of steps, and what follows from them.
#[derive(Debug, Clone, Default)]
pub struct Remaining {
    /// Steps from the first on, evenly thinned out.
    steps: VecDeque<Step>,
    /// One step in so many is remembered.
    every: usize,
    /// Steps since one was remembered.
    since: usize,
    /// The last step.
    last: Step,
}

impl Remaining {
    /// Records a step that ended `seconds` after the beginning at the simulated `time`.
    pub fn step(&mut self, seconds: f64, time: f64) {
        self.last = Step { seconds, time, number: self.last.number + 1 };
        self.since += 1;
        if self.since < self.every.max(1) {
            return;
        }
        self.since = 0;
        self.steps.push_back(self.last);
        if self.steps.len() > KEPT {
            let mut keep = false;
            self.steps.retain(|_| {
                keep = !keep;
                keep
            });
            self.every = 2 * self.every.max(1);
        }
    }

    /// Seconds from the last step to the simulated time `end`.
    #[must_use]
    pub fn seconds(&self, end: f64) -> Option<f64> {
        let (begin, last) = (self.steps.front()?.seconds, self.last);
        if !(last.seconds - begin >= LEAST_SECONDS) {
            return None;
        }
        let latest = LATEST * (last.seconds - begin);
        let first = *self.steps.iter().find(|s| s.seconds >= last.seconds - latest)?;
        let half = usize::midpoint(first.number, last.number);
        let middle = *self.steps.iter().find(|s| s.number >= half)?;
        if middle.number < first.number + LEAST_STEPS || last.number < middle.number + LEAST_STEPS {
            return None;
        }
        let count = |from: Step, to: Step| real(to.number - from.number);
        let length = |from: Step, to: Step| (to.time - from.time) / count(from, to);
        let (earlier, later) = (length(first, middle), length(middle, last));
        // Lengths are those of the middles of their halves.
        let change = (later / earlier).ln() / (0.5 * count(first, last));
        let left = end - last.time;
        let stays = left / later;
        let goes_on = if change == 0.0 { stays } else { (change * stays).ln_1p() / change };
        let agree = (1.0 / AGREE..=AGREE).contains(&(stays / goes_on)) && left > 0.0;
        let cost = (last.seconds - first.seconds) / count(first, last);
        let forecast = cost * (stays * goes_on).sqrt();
        (agree && forecast <= REACH * latest).then_some(forecast)
    }
}

/// `57 s`, `3.1 min`, `45 min`, `2.5 h`, `4 d`: two significant figures at most.
#[must_use]
pub fn duration(seconds: f64) -> String {
    const UNITS: [(&str, f64); 4] = [("s", 1.0), ("min", 60.0), ("h", 3600.0), ("d", 86400.0)];
    let mut text = String::new();
    for (number, (unit, size)) in UNITS.into_iter().enumerate() {
        let value = two_figures(seconds / size);
        // Fractions of a second are of no use.
        let value = if number == 0 { value.ceil() } else { value };
        text = format!("{value} {unit}");
        if value < UNITS.get(number + 1).map_or(f64::INFINITY, |next| 1.5 * next.1 / size) {
            break;
        }
    }
    text
}

/// `value` rounded to two significant figures.
fn two_figures(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}
