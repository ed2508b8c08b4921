//! What a step of a length costs, from the steps that were made.
//!
//! ```text
//! c(h) = c₀ (h/h₀)^b
//! ```
//!
//! with h₀ the mean length (geometric) of the later half of the steps and c₀ their mean cost at it. One step
//! on which a sheet snaps may cost as much as all others: none counts for more than [`MOST`] medians. The
//! power is that of a regression over the latest steps, drawn to [`USUAL`] where their lengths are nearly equal.

use super::Taken;
use crate::num::real;

/// Steps of the later half that count at most.
const LATEST: usize = 64;
/// The most that a step counts for, in medians.
const MOST: f64 = 2.0;
/// The power where nothing is known: relaxations take longer after long steps, but not by as much.
const USUAL: f64 = 0.3;
/// How much is thought to be known of the power before: the sum of squares of ln h that counts as much.
const KNOWN: f64 = 8.0;
/// The least cost of a step, s: clocks tick.
const TICK: f64 = 1e-9;

/// What a step of a length costs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cost {
    /// Logarithm of the mean cost, s, …
    level: f64,
    /// … at this logarithm of a length.
    at: f64,
    power: f64,
    /// Standard error of the level.
    error: f64,
}

impl Cost {
    /// From these steps, of which there is one at least.
    pub(super) fn of(steps: &[Taken]) -> Self {
        let half = steps.len().div_ceil(2).clamp(super::FEWEST, LATEST).min(steps.len());
        let power = slope(&latest(steps, LATEST), (USUAL, KNOWN)).clamp(0.0, 1.0);
        let points = latest(steps, half);
        let count = real(points.len().max(1));
        let at = points.iter().map(|p| p.0).sum::<f64>() / count;
        let mean = points.iter().map(|(h, c)| (c - power * (h - at)).exp()).sum::<f64>() / count;
        let middle = points.iter().map(|p| p.1).sum::<f64>() / count;
        let square: f64 = points.iter().map(|p| (p.1 - middle).powi(2)).sum();
        let error = (square / (count - 1.0).max(1.0) / count).sqrt();
        Self { level: mean.ln(), at, power, error }
    }

    /// The same with so much of its power.
    pub(super) fn with_share(self, share: f64) -> Self {
        Self { power: share * self.power, ..self }
    }

    /// Seconds of a step of this length.
    pub(super) fn seconds(&self, length: f64) -> f64 {
        (self.level + self.power * (length.ln() - self.at)).exp()
    }

    /// Standard error of the logarithm of its mean.
    pub(super) fn error(&self) -> f64 {
        self.error
    }
}

/// Logarithms of length and cost of the latest steps, so many.
fn latest(steps: &[Taken], count: usize) -> Vec<(f64, f64)> {
    let steps = &steps[steps.len() - count.min(steps.len())..];
    let mut costs: Vec<f64> = steps.iter().map(|step| step.seconds).collect();
    costs.sort_by(f64::total_cmp);
    let at = |k: usize| costs.get(k).copied().unwrap_or(0.0);
    let most = 0.5 * MOST * (at((costs.len().max(1) - 1) / 2) + at(costs.len() / 2));
    let cost = |step: &Taken| step.seconds.min(most).max(TICK).ln();
    steps.iter().map(|step| (step.length.ln(), cost(step))).collect()
}

/// The slope of y over x, drawn to `prior` with the weight of a sum of squares of x.
pub(super) fn slope(points: &[(f64, f64)], (prior, weight): (f64, f64)) -> f64 {
    let count = real(points.len().max(1));
    let x = points.iter().map(|p| p.0).sum::<f64>() / count;
    let y = points.iter().map(|p| p.1).sum::<f64>() / count;
    let (mut xx, mut xy) = (weight, weight * prior);
    for p in points {
        xx += (p.0 - x).powi(2);
        xy += (p.0 - x) * (p.1 - y);
    }
    xy / xx
}
