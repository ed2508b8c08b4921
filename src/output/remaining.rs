//! How much longer a run takes, or nothing where that cannot be told.
//!
//! Steps under error control begin tiny and grow, so the share of the way that is behind says little
//! about the rest. What is read is the pace (simulated time per second) over the latest part of the
//! run, in two halves, which gives two forecasts of the rest of the way s,
//!
//! ```text
//! T₁ = s/p                 the pace p of the later half stays
//! T₂ = ln(1 + k s/p)/k     it goes on changing at the rate k at which it changed between the halves
//! ```
//!
//! Where these are far apart nobody knows, and nothing is said.

use std::collections::VecDeque;

/// Fewest seconds of steps behind a forecast.
const LEAST_SECONDS: f64 = 2.0;
/// Fewest steps in each half: a few do not make a pace.
const LEAST_STEPS: usize = 3;
/// The share of the seconds so far that counts as the latest part: old paces are forgotten, and one
/// slow step does not yet decide.
const LATEST: f64 = 0.5;
/// A forecast reaches no further than this many times the latest part.
const REACH: f64 = 100.0;
/// The two forecasts differ by this factor at most.
const AGREE: f64 = 2.0;
/// Steps that are remembered; halved when there are more, so that any length of run is covered.
const KEPT: usize = 256;

/// Times of steps, and what follows from them.
#[derive(Debug, Clone, Default)]
pub struct Remaining {
    /// Seconds and simulated time after steps, from the first on; evenly thinned out.
    steps: VecDeque<(f64, f64)>,
    /// One step in so many is remembered.
    every: usize,
    /// Steps since one was remembered.
    since: usize,
    /// The last step.
    last: (f64, f64),
}

impl Remaining {
    /// Takes notice of a step that ended `seconds` after the beginning at the simulated `time`.
    pub fn step(&mut self, seconds: f64, time: f64) {
        self.last = (seconds, time);
        self.since += 1;
        if self.since < self.every.max(1) {
            return;
        }
        self.since = 0;
        self.steps.push_back((seconds, time));
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
        let (&(begin, _), (now, time)) = (self.steps.front()?, self.last);
        if !(now - begin >= LEAST_SECONDS) {
            return None;
        }
        let latest = LATEST * (now - begin);
        let after = |seconds: f64| self.steps.partition_point(|(at, _)| *at < seconds);
        let (first, middle) = (after(now - latest), after(now - 0.5 * latest));
        if middle < first + LEAST_STEPS || self.steps.len() <= middle + LEAST_STEPS {
            return None;
        }
        let (first, middle) = (self.steps[first], self.steps[middle]);
        let pace = |from: (f64, f64), to: (f64, f64)| (to.1 - from.1) / (to.0 - from.0);
        let (earlier, later) = (pace(first, middle), pace(middle, self.last));
        // The paces are those of the middles of their halves.
        let between = 0.5 * (now - first.0);
        let change = (later / earlier).ln() / between;
        let way = end - time;
        let stays = way / later;
        let goes_on = if change == 0.0 { stays } else { (change * stays).ln_1p() / change };
        let ratio = stays / goes_on;
        let agree = (1.0 / AGREE..=AGREE).contains(&ratio) && way > 0.0;
        let forecast = (stays * goes_on).sqrt();
        (agree && forecast <= REACH * latest).then_some(forecast)
    }
}

/// `57 s`, `3.1 min`, `45 min`, `2.5 h`, `4 d`: two significant figures at most.
#[must_use]
pub fn duration(seconds: f64) -> String {
    const UNITS: [(&str, f64); 4] = [("s", 1.0), ("min", 60.0), ("h", 3600.0), ("d", 86400.0)];
    let mut told = String::new();
    for (number, (unit, size)) in UNITS.into_iter().enumerate() {
        let value = two_figures(seconds / size);
        // Fractions of a second are of no use.
        let value = if number == 0 { value.ceil() } else { value };
        told = format!("{value} {unit}");
        if value < UNITS.get(number + 1).map_or(f64::INFINITY, |next| 1.5 * next.1 / size) {
            break;
        }
    }
    told
}

/// `value` rounded to two significant figures.
fn two_figures(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}
