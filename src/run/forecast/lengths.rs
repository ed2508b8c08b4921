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
/// How much is thought to be known of a before, namely 0: the sum of squares of ln t that counts as much.
const KNOWN: f64 = 0.3;
/// Pieces of the way, equally long in ln t, with one length of steps each.
const PIECES: u32 = 48;
/// Steps that may grow before they are taken for grown.
const GROWTHS: usize = 200;
/// Times are the same within this share of a step.
const SAME: f64 = 1e-9;

/// So many steps of one length.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub(super) count: f64,
    pub(super) length: f64,
}

impl Piece {
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
pub(super) fn fixed(way: &Way, time: f64, length: f64) -> Vec<Piece> {
    if !(time < way.until) {
        return Vec::new();
    }
    let next = next_output(way, time);
    let whole = ((way.until - next) / way.every + SAME).floor().max(0.0);
    let rest = way.until - next - whole * way.every;
    let mut pieces = vec![Piece::over(next - time, length)];
    if whole > 0.0 {
        let one = Piece::over(way.every, length);
        pieces.push(Piece { count: whole * one.count, ..one });
    }
    if rest > SAME * length {
        pieces.push(Piece::over(rest, length));
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
        Self { level: sum / weight, at, power: slope(&points, (0.0, KNOWN)).clamp(-0.5, 1.0) }
    }

    /// The same with so much of its power.
    pub(super) fn with_share(self, share: f64) -> Self {
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

/// Steps that begin at `next` and grow by `growth` at most towards the trend.
pub(super) fn controlled(
    way: &Way,
    time: f64,
    trend: &Trend,
    (mut next, growth): (f64, f64),
    longest: f64,
) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let mut now = time;
    while now < way.until * (1.0 - SAME)
        && next < trend.length(now).min(way.every).min(longest)
        && pieces.len() < GROWTHS
    {
        let left = next_output(way, now) - now;
        // The last two steps before an output time share the way.
        let length = match next {
            long if long >= left => left,
            long if 2.0 * long > left => 0.5 * left,
            short => short,
        };
        pieces.push(Piece { count: 1.0, length });
        now += length;
        next *= growth;
    }
    let ratio = (way.until / now).powf(1.0 / f64::from(PIECES));
    for number in 0..PIECES {
        if !(now < way.until * (1.0 - SAME)) {
            break;
        }
        let end = if number + 1 == PIECES { way.until } else { (now * ratio).min(way.until) };
        let length = trend.length((now * end).sqrt()).min(longest).min(way.until);
        let step = Piece::over(way.every, length).length;
        pieces.push(Piece { count: (end - now) / step, length: step });
        now = end;
    }
    pieces
}
