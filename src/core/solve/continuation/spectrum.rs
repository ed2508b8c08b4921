//! The eigenvalues of a steady state that are nearest to 0.
//!
//! ```text
//! J v = μ B v        B the storage of the unknowns, 0 in rows without; a disturbance grows as exp(μ t)
//! (-J)⁻¹ B v = θ v   θ = -1/μ: the largest θ are the μ nearest to 0
//! ```
//!
//! By Rayleigh and Ritz in a block Krylov space, whose blocks are wide enough for the multiple eigenvalues of symmetric
//! shapes. Products are those of the rows with storage: the others follow, and may be large where their block is nearly
//! singular. Eigenvalues far from 0, as of fast oscillations, are not seen: a count of unstable ones is that among the nearest.
//!
//! Reference: Saad, Numerical Methods for Large Eigenvalue Problems (SIAM 2011), chapter 6, doi:10.1137/1.9781611970739.

use super::Unknowns;
use crate::linear::largest_eigenvalues;
use crate::model::{Chemistry, Coupled, Model};
use crate::solve::SolveError;

/// Eigenvalues that are looked for at every point: of more none are known.
pub(super) const MAX_EIGENVALUES: usize = 12;

/// An eigenvalue with its direction.
pub(super) struct Pair {
    /// -Re μ: below 0 where the disturbance grows.
    pub(super) eigenvalue: f64,
    /// |Im μ|.
    pub(super) frequency: f64,
    pub(super) vector: Vec<f64>,
}

/// B; 0 in rows of held values, which no disturbance moves.
pub(super) fn storage(coupled: &Coupled, model: &Model) -> Vec<f64> {
    let mut storage: Vec<f64> = coupled.mass().collect();
    let layout = coupled.layout();
    if let Some(chemistry) = model.chemistry() {
        for s in 0..layout.species() {
            for point in (0..layout.points()).filter(|point| chemistry.held().holds(s, *point)) {
                storage[layout.concentration(s, point)] = 0.0;
            }
        }
    }
    storage
}

/// The `count` eigenvalues nearest to 0, fewer where there are no more, in ascending order of -Re μ. `solve` is (-J)⁻¹.
pub(super) fn nearest(
    storage: &[f64],
    solve: &mut dyn FnMut(&mut [f64]) -> Result<(), SolveError>,
    count: usize,
) -> Result<Vec<Pair>, SolveError> {
    let mut apply = |v: &mut [f64]| {
        v.iter_mut().zip(storage).for_each(|(v, b)| *v *= b);
        solve(v)
    };
    let stored: Vec<bool> = storage.iter().map(|b| *b != 0.0).collect();
    let found = largest_eigenvalues(&stored, &mut apply, count)?;
    let mut pairs: Vec<Pair> = found
        .into_iter()
        .map(|(theta, vector)| {
            // μ = -1/θ.
            let square = theta.0 * theta.0 + theta.1 * theta.1;
            let frequency = theta.1.abs() / square;
            Pair { eigenvalue: theta.0 / square, frequency, vector }
        })
        .collect();
    pairs.sort_by(|a, b| a.eigenvalue.total_cmp(&b.eigenvalue));
    Ok(pairs)
}

/// Scales a mode: the largest displacement has length 1 and a positive largest component, or where no shape moves the
/// largest change of a species in units of its typical magnitude is 1.
pub(super) fn normalise(mode: &mut Unknowns, model: &Model) {
    let longest = mode.x.iter().max_by(|a, b| a.norm().total_cmp(&b.norm()));
    let by_shape = longest.map_or(0.0, |v| v.norm() * v[v.iamax()].signum());
    let typical = model.chemistry().map(Chemistry::all_typical);
    let species = mode.species.iter().zip(typical.into_iter().flatten());
    let changes =
        species.flat_map(|(values, typical)| values.iter().map(move |value| value / typical));
    let by_species = changes.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
    let size = if by_shape == 0.0 { by_species } else { by_shape };
    if size != 0.0 {
        mode.scale(1.0 / size);
    }
}
