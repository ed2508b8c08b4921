//! A quantity that goes with a power of another, from what it was.
//!
//! ```text
//! y(x) = y₀ (x/x₀)^b
//! ```
//!
//! with x₀ the geometric mean, b the power of a weighted regression of ln y over ln x, and y₀ such that y has the
//! mean of the points: sums of y, as numbers and costs of steps are, hold where y scatters.

use crate::num::real;

/// The largest power: what is steeper is chance.
const STEEPEST: f64 = 1.0;

/// The fitted law.
#[derive(Debug, Clone, Copy)]
pub(super) struct PowerLaw {
    ln_x: f64,
    ln_y: f64,
    power: f64,
}

impl PowerLaw {
    /// Of points (ln x, ln y, weight), of which there is one at least. The power is drawn to that of `prior`, which
    /// counts as much as points with its second number as their sum of squares of ln x.
    pub(super) fn fit(points: &[(f64, f64, f64)], prior: (f64, f64)) -> Self {
        let total: f64 = points.iter().map(|point| point.2).sum();
        let mean = |of: &dyn Fn(f64, f64) -> f64| {
            points.iter().map(|(x, y, weight)| weight * of(*x, *y)).sum::<f64>() / total
        };
        let (ln_x, middle) = (mean(&|x, _| x), mean(&|_, y| y));
        let squares = real(points.len()) * mean(&|x, _| (x - ln_x).powi(2));
        let products = real(points.len()) * mean(&|x, y| (x - ln_x) * (y - middle));
        let power = (prior.0 * prior.1 + products) / (prior.1 + squares);
        let power = power.clamp(-STEEPEST, STEEPEST);
        let ln_y = mean(&|x, y| (y - power * (x - ln_x)).exp()).ln();
        Self { ln_x, ln_y, power }
    }

    /// The same with so much of its power.
    pub(super) fn with_share(self, share: f64) -> Self {
        Self { power: share * self.power, ..self }
    }

    /// y at this x.
    pub(super) fn at(&self, x: f64) -> f64 {
        (self.ln_y + self.power * (x.ln() - self.ln_x)).exp()
    }
}
