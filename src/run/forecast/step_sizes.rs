//! How many steps are left, and how long they are.
//!
//! Fixed steps are counted. Of steps under error control the length that the tolerance allows is taken to go
//! with time as
//!
//! ```text
//! h(t) = h₀ (t/t₀)^a
//! ```
//!
//! from its mean and its regression over the steps since t₀/2, at least [`FEWEST`]. Where the integrator says
//! what its error estimate allows, that is h, so that neither output times nor a limit on growth hide it; else it
//! is the length of steps that no output time cuts. Steps grow towards h(t) as fast as they may, and
//! between two output times all are equally long, which no step control does exactly.

use super::cost::slope;
use super::{Taken, Way};

/// Fewest steps that say how lengths go with time.
const FEWEST: usize = 6;
/// Weight of the prior a = 0 in the regression, as a sum of squared deviations of ln t.
const PRIOR_WEIGHT: f64 = 0.3;
/// Pieces of the way, equally long in ln t, with one length of steps each.
const PIECES: u32 = 48;
/// Most steps of the ramp in which steps grow towards h(t).
const MAX_RAMP_STEPS: usize = 200;
/// Times are the same within this share of a step.
const SAME: f64 = 1e-9;

/// A number of steps of equal length; the number need not be whole.
#[derive(Debug, Clone, Copy)]
pub(super) struct EqualSteps {
    pub(super) count: f64,
    pub(super) length: f64,
}

impl EqualSteps {
    /// Over a way of `length` in equal steps of `step` at most.
    fn over(length: f64, step: f64) -> Self {
        let count = (length / step - SAME).ceil().max(1.0);
        Self { count, length: length / count }
    }
}

/// The first output time after `time`.
pub(super) fn next_output(way: &Way, time: f64) -> f64 {
    let number = (time / way.every * (1.0 + SAME)).floor() + 1.0;
    (number * way.every).min(way.until)
}

/// Steps of one length, shortened but at output times.
pub(super) fn fixed(way: &Way, time: f64, length: f64) -> Vec<EqualSteps> {
    if !(time < way.until) {
        return Vec::new();
    }
    let next = next_output(way, time);
    let whole = ((way.until - next) / way.every + SAME).floor().max(0.0);
    let rest = way.until - next - whole * way.every;
    let mut pieces = vec![EqualSteps::over(next - time, length)];
    if whole > 0.0 {
        let one = EqualSteps::over(way.every, length);
        pieces.push(EqualSteps { count: whole * one.count, ..one });
    }
    if rest > SAME * length {
        pieces.push(EqualSteps::over(rest, length));
    }
    pieces
}

/// How the length that the tolerance allows goes with time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trend {
    /// Logarithm of the length …
    level: f64,
    /// … at this time.
    at: f64,
    power: f64,
}

impl Trend {
    /// From these steps, of which there is one at least; no step is longer than `until`.
    pub(super) fn of(steps: &[Taken], until: f64) -> Self {
        let at = steps.last().map_or(until, |step| step.time);
        let since = steps.partition_point(|step| step.time <= 0.5 * at);
        let latest = &steps[since.min(steps.len().saturating_sub(FEWEST))..];
        let free = |step: &&Taken| step.allowed.is_some() || !step.cut;
        let some = latest.iter().any(|step| free(&step));
        let mut points = Vec::with_capacity(latest.len());
        let (mut sum, mut weight) = (0.0, 0.0);
        for step in latest.iter().filter(|step| !some || free(step)) {
            let length = step.allowed.unwrap_or(step.length).min(until).ln();
            points.push((step.time.ln(), length));
            sum += step.length * length;
            weight += step.length;
        }
        Self {
            level: sum / weight,
            at,
            power: slope(&points, (0.0, PRIOR_WEIGHT)).clamp(-0.5, 1.0),
        }
    }

    /// The same with `share` times the exponent a.
    pub(super) fn with_scaled_exponent(self, share: f64) -> Self {
        Self { power: share * self.power, ..self }
    }

    /// Makes all lengths so many times as long.
    pub(super) fn scale(&mut self, factor: f64) {
        self.level += factor.ln();
    }

    fn length(&self, time: f64) -> f64 {
        (self.level + self.power * (time / self.at).ln()).exp()
    }
}

/// Steps that start with `first_step` and grow towards the trend, each at most `max_ratio` times as long as the last.
pub(super) fn controlled(
    way: &Way,
    time: f64,
    trend: &Trend,
    (first_step, max_ratio): (f64, f64),
    longest: f64,
) -> Vec<EqualSteps> {
    let mut pieces = Vec::new();
    let (mut now, mut next) = (time, first_step);
    while now < way.until * (1.0 - SAME)
        && next < trend.length(now).min(way.every).min(longest)
        && pieces.len() < MAX_RAMP_STEPS
    {
        let left = next_output(way, now) - now;
        // The last two steps before an output time share the way.
        let length = match next {
            long if long >= left => left,
            long if 2.0 * long > left => 0.5 * left,
            short => short,
        };
        pieces.push(EqualSteps { count: 1.0, length });
        now += length;
        next *= max_ratio;
    }
    let ratio = (way.until / now).powf(1.0 / f64::from(PIECES));
    for number in 0..PIECES {
        if !(now < way.until * (1.0 - SAME)) {
            break;
        }
        let end = if number + 1 == PIECES { way.until } else { (now * ratio).min(way.until) };
        let length = trend.length((now * end).sqrt()).min(longest).min(way.until);
        let step = EqualSteps::over(way.every, length).length;
        pieces.push(EqualSteps { count: (end - now) / step, length: step });
        now = end;
    }
    pieces
}
