//! Statistics of a sample.

use crate::num::real;

/// Size, mean and standard deviation of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statistics {
    /// Number of values n.
    pub count: usize,
    /// Arithmetic mean; none of an empty sample.
    pub mean: Option<f64>,
    /// Sample standard deviation √(Σ(x - mean)²/(n - 1)); none of fewer than two values.
    pub deviation: Option<f64>,
}

impl Statistics {
    /// Returns the statistics of `values`.
    #[must_use]
    pub fn new(values: &[f64]) -> Self {
        let count = values.len();
        // Sums of differences from the first value: the mean of equal values is that value, without round-off.
        let mean = values.first().map(|first| {
            first + values.iter().map(|value| value - first).sum::<f64>() / real(count)
        });
        let squares = mean.map(|mean| values.iter().map(|value| (value - mean).powi(2)).sum());
        let deviation =
            squares.filter(|_| count > 1).map(|sum: f64| (sum / real(count - 1)).sqrt());
        Self { count, mean, deviation }
    }
}
