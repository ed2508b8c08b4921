//! How well data determine parameters.
//!
//! ```text
//! J = ∂r/∂q,  q_j = p_j/|p_j|      J = U S Vᵀ,  cov q = s² V S⁻² Vᵀ
//! ```
//!
//! s² is 1 where standard errors are given, else χ² over the degrees of freedom. A direction V_k is *sloppy* (Gutenkunst et al., PLoS
//! Comput. Biol. 3 (2007) e189, doi:10.1371/journal.pcbi.0030189) where its standard error s/S_k exceeds 1: the data do not tell a parameter from twice it.

use nalgebra::{DMatrix, SVD};
use serde::Serialize;

use super::problem::ROUND_OFF;

/// Products of shares of parameters in a direction below this are round-off.
const SHARE: f64 = 1e-4;

/// Standard errors and what the data do not determine.
#[derive(Debug, Clone, Serialize)]
pub struct Uncertainty {
    /// Standard error of every parameter; none where it exceeds the parameter.
    pub standard: Vec<Option<f64>>,
    /// Correlations of the parameters, row by row; none where an error is infinite.
    pub correlation: Option<Vec<Vec<f64>>>,
    /// Directions in the space of parameters, the best determined one first.
    pub directions: Vec<Direction>,
}

/// A direction in the space of the parameters, each relative to its size.
#[derive(Debug, Clone, Serialize)]
pub struct Direction {
    /// Its standard error, relative; none if it is infinite.
    pub error: Option<f64>,
    /// Shares of the parameters: a unit vector.
    pub components: Vec<f64>,
}

impl Direction {
    /// Whether the data do not determine it.
    #[must_use]
    pub fn is_sloppy(&self) -> bool {
        self.error.is_none_or(|error| error > 1.0)
    }
}

impl Uncertainty {
    /// By the Jacobian of the residuals by the parameters of sizes `scales`, and s².
    pub(super) fn new(jacobian: &DMatrix<f64>, scales: &[f64], variance: f64) -> Self {
        let mut scaled = jacobian.clone();
        scales.iter().enumerate().for_each(|(j, scale)| scaled.column_mut(j).scale_mut(*scale));
        let n = scales.len();
        let svd = SVD::new(scaled, false, true);
        let v = svd.v_t.unwrap_or_else(|| DMatrix::identity(n, n));
        let largest = svd.singular_values.iter().copied().fold(0.0, f64::max);
        let error = |k: usize| {
            let value = svd.singular_values[k];
            (value > ROUND_OFF * largest).then(|| variance.sqrt() / value)
        };
        let known: Vec<Option<f64>> = (0..n).map(error).collect();
        let covariance = |i: usize, j: usize| -> f64 {
            let terms = known.iter().enumerate().map(|(k, error)| {
                let product = v[(k, i)] * v[(k, j)];
                match error {
                    Some(error) => product * error * error,
                    None if product.abs() < SHARE => 0.0,
                    None => f64::INFINITY,
                }
            });
            terms.sum()
        };
        let relative: Vec<f64> = (0..n).map(|j| covariance(j, j).sqrt()).collect();
        let standard =
            relative.iter().zip(scales).map(|(e, scale)| (*e <= 1.0).then_some(e * scale));
        let finite = known.iter().all(Option::is_some);
        let row = |i: usize| -> Vec<f64> {
            (0..n).map(|j| covariance(i, j) / (relative[i] * relative[j])).collect()
        };
        let mut directions: Vec<Direction> = (0..n)
            .map(|k| Direction { error: known[k], components: v.row(k).iter().copied().collect() })
            .collect();
        let size = |direction: &Direction| direction.error.unwrap_or(f64::INFINITY);
        directions.sort_by(|a, b| size(a).total_cmp(&size(b)));
        Self {
            standard: standard.collect(),
            correlation: finite.then(|| (0..n).map(row).collect()),
            directions,
        }
    }
}
