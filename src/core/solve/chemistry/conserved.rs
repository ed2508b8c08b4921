//! Totals that a chemistry conserves while the shape rests.
//!
//! ```text
//! w_(s,i) = a_s A_i    with    wᵀ ∂F/∂c = 0  and  wᵀF = 0:    (1/Δτ - ∂F/∂c) δ = F  has  wᵀδ = 0
//! ```
//!
//! The matrix is singular then but for 1/Δτ, and long steps amplify the round-off of F along its null vector. What a
//! solution lacks is solved for with the same factor: `(1/Δτ - ∂F/∂c) η = -e wᵀδ/Δτ`, `wᵀe = 1`.

use nalgebra::DMatrix;

use crate::linear::{LinearError, Sparse};
use crate::model::{Model, State};

/// Round-off of a sum, relative to its terms.
const ROUND_OFF: f64 = 1e-13;
/// The same of a total at most, after a step.
const LEFT: f64 = 4.0 * f64::EPSILON;
/// Solutions at most that restore totals, of two digits each by iterative solvers. What is lacking then is spread evenly.
const MAX_SOLVES: usize = 3;

/// Areas of the points, at rest and in the shape of `state`: `measure` and `metric` say which of them conserve.
pub(super) fn areas_of(model: &Model, state: &State) -> Vec<Vec<f64>> {
    let (sheet, Some(chemistry)) = (model.sheet(), model.chemistry()) else { return Vec::new() };
    if sheet.triangles().is_empty() {
        return vec![vec![1.0; chemistry.points(sheet)]];
    }
    let mut areas = [sheet.rest(), &state.x].map(|x| chemistry.point_areas(sheet, x)).to_vec();
    areas.dedup();
    areas
}

/// A total, by its weights.
struct Total {
    /// w of every unknown.
    weight: Vec<f64>,
    /// a of every species: e is `a_s / Σ A` everywhere.
    share: Vec<f64>,
}

/// The totals that a step leaves as they are.
pub(super) struct ConservedTotals(Vec<Total>);

impl ConservedTotals {
    /// Those of the state `y` with this ∂F/∂c and F = `rate`.
    pub(super) fn new(areas: &[Vec<f64>], jacobian: &Sparse, y: &[f64], rate: &[f64]) -> Self {
        let noise: Vec<f64> = (0..y.len())
            .map(|i| rate[i].abs() + jacobian.row(i).map(|(j, v)| (v * y[j]).abs()).sum::<f64>())
            .collect();
        let mut all = Vec::new();
        for areas in areas {
            let species = y.len() / areas.len();
            let total: f64 = areas.iter().sum();
            for a in combinations(jacobian, areas) {
                let weight: Vec<f64> =
                    (0..y.len()).map(|i| a[i % species] * areas[i / species]).collect();
                let terms = weight.iter().zip(rate).zip(&noise);
                let (change, limit) = terms.fold((0.0, 0.0), |(change, limit), ((w, r), noise)| {
                    (change + w * r, limit + w.abs() * noise)
                });
                if change.abs() <= ROUND_OFF * limit {
                    all.push(Total { weight, share: a.iter().map(|a| a / total).collect() });
                }
            }
        }
        Self(all)
    }

    /// Makes `change`, a step of length 1/`inverse` from `y`, keep the totals; `solve` solves with its matrix.
    pub(super) fn restore(
        &self,
        change: &mut [f64],
        y: &[f64],
        inverse: f64,
        mut solve: impl FnMut(&mut [f64]) -> Result<(), LinearError>,
    ) -> Result<(), LinearError> {
        for round in 0..=MAX_SOLVES {
            let mut lacking = vec![0.0; y.len()];
            let mut is_kept = true;
            for Total { weight, share } in &self.0 {
                let (mut sum, mut size) = (0.0, 0.0);
                for (i, w) in weight.iter().enumerate() {
                    sum += w * (change[i] + lacking[i]);
                    size += (w * y[i]).abs();
                }
                if sum.abs() > LEFT * size {
                    is_kept = false;
                    for (i, lacking) in lacking.iter_mut().enumerate() {
                        *lacking -= share[i % share.len()] * sum;
                    }
                }
            }
            if is_kept {
                break;
            }
            if round < MAX_SOLVES {
                lacking.iter_mut().for_each(|value| *value *= inverse);
                solve(&mut lacking)?;
            }
            change.iter_mut().zip(lacking).for_each(|(change, lacking)| *change += lacking);
        }
        Ok(())
    }
}

/// Orthonormal combinations a of the species whose totals with these areas ∂F/∂c does not change.
fn combinations(jacobian: &Sparse, areas: &[f64]) -> Vec<Vec<f64>> {
    let n = jacobian.rows();
    let species = n / areas.len();
    let (mut sums, mut sizes) = (DMatrix::<f64>::zeros(n, species), vec![0.0; n]);
    for i in 0..n {
        for (j, value) in jacobian.row(i) {
            let change = areas[i / species] * value;
            sums[(j, i % species)] += change;
            sizes[j] += change.abs();
        }
    }
    for (mut row, size) in sums.row_iter_mut().zip(sizes) {
        row /= size.max(f64::MIN_POSITIVE);
    }
    // The decomposition of what is not finite does not end.
    if !sums.iter().all(|value| value.is_finite()) {
        return Vec::new();
    }
    let limit = ROUND_OFF * crate::num::real(n).sqrt();
    let svd = sums.qr().r().svd(false, true);
    let Some(vectors) = svd.v_t else { return Vec::new() };
    let small = (0..species).filter(|k| svd.singular_values[*k] <= limit);
    small.map(|k| vectors.row(k).iter().copied().collect()).collect()
}
