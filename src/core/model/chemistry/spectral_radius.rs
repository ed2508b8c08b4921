//! How fast disturbances of the species decay or grow: bounds on the spectral radius of ∂(dc/dt)/∂c.
//!
//! ```text
//! ρ(J) ≤ ρ(|J|) ≤ ‖|J|^k‖^(1/k)        ‖A‖ the largest row sum of |A|, k = 1, 2, 4, …, 16
//! ```
//!
//! at every point. With k = 1 the largest entry counts in full, which may be far above every eigenvalue where the units of
//! species differ by orders of magnitude. With k = 16 it counts by its 16th root.
//!
//! References: Wielandt, Math. Z. 52 (1950), doi:10.1007/BF02230720 (ρ(J) ≤ ρ(|J|)); Gelfand, Mat. Sbornik 9 (1941) (ρ as the
//! limit over k).

use smallvec::SmallVec;

use super::{Chemistry, Few, ModelError, SignalColumns, Surface};
use crate::effects::TransportInputs;
use crate::sheet::Sheet;

/// Row sums that exceed the largest rate of a species by itself so many times are bounded more closely, by four
/// products of matrices a point.
const OFF_DIAGONAL: f64 = 4.0;
/// Squarings: k = 2⁴.
const SQUARINGS: i32 = 4;

impl Chemistry {
    /// Bounds on the spectral radius of the rates by the species, 1/time: of the reaction, and of diffusion by its own bound.
    /// The sum bounds that of both.
    ///
    /// # Errors
    /// If the plugin fails.
    pub fn spectral_bounds(
        &self,
        on: (&Sheet, f64),
        surface: &Surface,
        species: &[&[f64]],
        signals: &SignalColumns,
    ) -> Result<[f64; 2], ModelError> {
        let (sheet, _) = on;
        let count = species.first().map_or(0, |c| c.len());
        let (n, inputs) = (species.len(), self.descriptor().inputs());
        let partials = self.reaction_partials(species, signals).map_err(ModelError::from);
        let partials = ModelError::agreed(sheet.reduction(), partials)?;
        let entry = |p: usize, s: usize, j: usize| partials.column(s * inputs + j)[p].abs();
        let row_sum = |p: usize, s: usize| (0..n).map(|j| entry(p, s, j)).sum::<f64>();
        // Of all ranks: each decides by it how to bound its own points.
        let diagonal = largest(n, |s| sheet.reduction().max(count, |p| entry(p, s, s)));
        let loose = |norm: f64| n > 1 && norm.is_finite() && norm > OFF_DIAGONAL * diagonal;
        let bound = |p: usize| match largest(n, |s| row_sum(p, s)) {
            norm if loose(norm) => of_powers(n, norm, |s, j| entry(p, s, j)),
            norm => norm,
        };
        let reaction = largest(1, |_| sheet.reduction().max(count, bound));
        let mut diffusion =
            [self.transport_bound(on, surface, (species, self.signal_values(signals)))];
        sheet.reduction().max_over_ranks(&mut diffusion);
        Ok([reaction, diffusion[0]])
    }

    /// A bound on the spectral radius of all transports together, 1/time: the largest sum of those of one species.
    #[must_use]
    pub fn transport_bound(
        &self,
        on: (&Sheet, f64),
        surface: &Surface,
        inputs: TransportInputs<'_>,
    ) -> f64 {
        let mut sums: Few<f64> = SmallVec::from_elem(0.0, self.descriptor().species.len());
        for (term, operator) in self.transports.iter().zip(surface.operators()) {
            sums[term.species()] += term.bound(on, operator, inputs);
        }
        sums.into_iter().fold(0.0, f64::max)
    }
}

/// The largest `f(k)` of `count`, at least 0; NaN wins.
fn largest(count: usize, f: impl Fn(usize) -> f64) -> f64 {
    (0..count)
        .map(f)
        .fold(0.0, |most, value| if value > most || value.is_nan() { value } else { most })
}

/// `‖A^k‖^(1/k)` of a non-negative n × n matrix with the largest row sum `norm`, which is the first bound.
fn of_powers(n: usize, norm: f64, entry: impl Fn(usize, usize) -> f64) -> f64 {
    let mut power: Vec<f64> = (0..n * n).map(|k| entry(k / n, k % n) / norm).collect();
    let mut bound = norm;
    for squaring in 1..=SQUARINGS {
        let product = |k: usize| (0..n).map(|j| power[k / n * n + j] * power[j * n + k % n]).sum();
        let square: Vec<f64> = (0..n * n).map(product).collect();
        let size = largest(n, |s| square[s * n..][..n].iter().sum());
        // Some power of A is 0, and so are all eigenvalues.
        if size == 0.0 {
            return 0.0;
        }
        bound *= size.powf(0.5f64.powi(squaring));
        power = square.into_iter().map(|value| value / size).collect();
    }
    bound.min(norm)
}

#[cfg(test)]
mod tests {
    use super::of_powers;

    #[test]
    fn powers_bound_the_spectral_radius_in_any_units() {
        // Eigenvalues 5, 1 and 1 whatever the units of the last species.
        for unit in [1.0, 1e6, 1e15] {
            let matrix = [[5.0, 0.0, 0.0], [1e-3, 1.0, 0.0], [0.0, unit, 1.0]];
            let bound = of_powers(3, unit + 1.0_f64.max(5.0), |s, j| matrix[s][j]);
            assert!((5.0..50.0).contains(&bound), "{unit:e}: {bound}");
        }
        // A rotation by unlike numbers has the radius √(ab).
        let bound = of_powers(2, 1e8, |s, j| [[0.0, 1e8], [1e-4, 0.0]][s][j]);
        assert!((bound / 1e2 - 1.0).abs() < 1e-9, "{bound}");
        assert_eq!(of_powers(2, 3.0, |s, j| [[0.0, 3.0], [0.0, 0.0]][s][j]), 0.0);
    }
}
