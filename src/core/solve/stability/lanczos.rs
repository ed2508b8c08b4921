//! Lanczos' method for the smallest eigenvalues of `H v = λ M v`, by shift and inversion.
//!
//! ```text
//! (H - σ M)⁻¹ M v = θ v,   θ = 1/(λ - σ) > 0   with σ below all λ
//! ```
//!
//! The largest θ are the smallest λ and converge first. Vectors are orthogonal in M, and kept so by
//! orthogonalising twice against all before. One start vector sees one vector of a multiple
//! eigenvalue (a round sheet has pairs), so what was found is locked and the iteration repeated in its
//! complement, until a repetition finds nothing smaller than the largest that is wanted.

use nalgebra::{DMatrix, Dyn, SymmetricEigen};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::restricted::Restricted;
use crate::Vec3;
use crate::effects::Pins;
use crate::parallel;
use crate::solve::{Control, SolveError};

/// Change of `θ v` by the operator, relative, at which a pair counts as found. The error of θ is the
/// square of it.
const TOLERANCE: f64 = 1e-9;
/// Vectors kept before starting again from the best: memory against speed.
const LONGEST_BASIS: usize = 100;
/// Starts before giving up.
const MAX_STARTS: usize = 40;
/// Steps between two tests of convergence.
const TEST_INTERVAL: usize = 5;
/// Relative length below which the Krylov space is exhausted.
const EXHAUSTED_LENGTH: f64 = 1e-13;

/// The operator, restricted to the complement of rigid motions.
struct Pencil<'p, 'a> {
    restricted: &'p mut Restricted<'a>,
    pins: &'p Pins,
}

/// An eigenvalue and its vector of length 1 in M.
type Pair = (f64, Vec<Vec3>);

impl Pencil<'_, '_> {
    fn inner(&self, a: &[Vec3], b: &[Vec3]) -> f64 {
        self.restricted.inner(a, b)
    }

    /// `(H - σ M)⁻¹ M v`.
    fn apply(&mut self, v: &[Vec3]) -> Vec<Vec3> {
        let mass = self.restricted.mass();
        let mut w: Vec<Vec3> = (0..v.len()).map(|i| mass[i] * v[i]).collect();
        self.restricted.solve(&mut w);
        self.fix_pins(&mut w);
        w
    }

    /// Makes `v` a displacement that pins allow, the same of images and their owners.
    fn fix_pins(&self, v: &mut [Vec3]) {
        self.restricted.update_ghosts(v);
        let pins = self.pins;
        parallel::update(v, |i, v| {
            for a in 0..3 {
                if pins[i][a] {
                    v[a] = 0.0;
                }
            }
        });
    }

    /// Makes `w` orthogonal to `others`, which are orthonormal.
    fn orthogonalise<'v>(
        &self,
        w: &mut [Vec3],
        others: impl Iterator<Item = &'v Vec<Vec3>> + Clone,
    ) {
        for _ in 0..2 {
            for v in others.clone() {
                let share = self.inner(v, w);
                parallel::update(w, |i, w| *w -= share * v[i]);
            }
        }
    }

    /// Scales `w` to length 1; what it was.
    fn normalise(&self, w: &mut [Vec3]) -> f64 {
        let length = self.inner(w, w).sqrt();
        if length > 0.0 {
            parallel::update(w, |_, w| *w /= length);
        }
        length
    }
}

/// The `count` smallest eigenvalues of what `restricted` holds the factor of, ascending.
///
/// # Errors
/// [`SolveError::Modes`] if too few converge.
pub(super) fn smallest(
    restricted: &mut Restricted<'_>,
    pins: &Pins,
    count: usize,
    control: &Control,
) -> Result<Vec<Pair>, SolveError> {
    let rigid = restricted.rigid().to_vec();
    let pencil = &mut Pencil { restricted, pins };
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut found: Vec<Pair> = Vec::new();
    let mut start: Option<Vec<Vec3>> = None;
    for _ in 0..MAX_STARTS {
        let first = start.take().unwrap_or_else(|| {
            (0..pins.len()).map(|_| Vec3::from_fn(|_, _| random.random_range(-1.0..=1.0))).collect()
        });
        let wanted = count.saturating_sub(found.len()).max(1);
        let locked: Vec<&Vec<Vec3>> = rigid.iter().chain(found.iter().map(|(_, v)| v)).collect();
        let run = cycle(pencil, &locked, first, wanted, control)?;
        let complete = found.len() >= count;
        let largest = found.get(count.max(1) - 1).map_or(f64::NEG_INFINITY, |p| p.0);
        let nothing_smaller = run.pairs.first().is_none_or(|p| p.0 >= largest);
        if run.exhausted || (complete && nothing_smaller && !run.pairs.is_empty()) {
            if !complete {
                found.extend(run.pairs);
            }
            found.sort_by(|a, b| a.0.total_cmp(&b.0));
            found.truncate(count);
            return Ok(found);
        }
        if run.pairs.is_empty() {
            start = run.best;
            continue;
        }
        found.extend(run.pairs);
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    Err(SolveError::Modes { found: found.len().min(count), wanted: count })
}

/// What one Krylov space gave.
struct Cycle {
    /// The leading pairs that converged, ascending.
    pairs: Vec<Pair>,
    /// Where to continue if none did.
    best: Option<Vec<Vec3>>,
    /// Nothing is left outside of `pairs`.
    exhausted: bool,
}

/// Eigenpairs of the tridiagonal matrix with the diagonal `alpha` and the off-diagonals `beta`, and their order by
/// falling eigenvalue.
fn ritz(alpha: &[f64], beta: &[f64]) -> (SymmetricEigen<f64, Dyn>, Vec<usize>) {
    let m = alpha.len();
    let eigen = SymmetricEigen::new(DMatrix::from_fn(m, m, |a, b| match a.abs_diff(b) {
        0 => alpha[a],
        1 => beta[a.min(b)],
        _ => 0.0,
    }));
    let mut order: Vec<usize> = (0..m).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    (eigen, order)
}

/// The linear combination of the Lanczos vectors `basis` with the weights `share`.
fn combination(basis: &[Vec<Vec3>], share: impl Fn(usize) -> f64) -> Vec<Vec3> {
    let mut sum = vec![Vec3::zeros(); basis.first().map_or(0, Vec::len)];
    for (j, v) in basis.iter().enumerate() {
        let share = share(j);
        parallel::update(&mut sum, |i, s| *s += share * v[i]);
    }
    sum
}

/// Extends a Krylov space from `first`, orthogonal to `locked`, until its `wanted` leading pairs have converged, it is
/// exhausted, or full.
fn cycle(
    pencil: &mut Pencil<'_, '_>,
    locked: &[&Vec<Vec3>],
    first: Vec<Vec3>,
    wanted: usize,
    control: &Control,
) -> Result<Cycle, SolveError> {
    let mut v = first;
    pencil.fix_pins(&mut v);
    let raw = pencil.inner(&v, &v).sqrt();
    pencil.orthogonalise(&mut v, locked.iter().copied());
    let nothing = Cycle { pairs: Vec::new(), best: None, exhausted: true };
    if !(pencil.normalise(&mut v) > EXHAUSTED_LENGTH * raw) {
        return Ok(nothing);
    }
    let mut basis = vec![v];
    let (mut alpha, mut beta): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    loop {
        control.check()?;
        control.report(|| {
            format!("softest modes: {} vectors of at most {LONGEST_BASIS}", basis.len())
        });
        let last = &basis[basis.len() - 1];
        let mut w = pencil.apply(last);
        let size = pencil.inner(&w, &w).sqrt();
        alpha.push(pencil.inner(last, &w));
        pencil.orthogonalise(&mut w, locked.iter().copied().chain(&basis));
        let length = pencil.normalise(&mut w);
        let m = alpha.len();
        let exhausted = !(length > EXHAUSTED_LENGTH * size);
        let full = m >= LONGEST_BASIS.max(2 * wanted);
        if exhausted || full || m.is_multiple_of(TEST_INTERVAL) {
            let (eigen, order) = ritz(&alpha, &beta);
            let is_converged = |k: &&usize| {
                let theta = eigen.eigenvalues[**k];
                let left = length * eigen.eigenvectors[(m - 1, **k)].abs();
                theta > 0.0 && (exhausted || left <= TOLERANCE * theta)
            };
            let converged = order.iter().take_while(is_converged).take(wanted).count();
            if converged == wanted || exhausted || full {
                let vector = |k: usize| {
                    let mut sum = combination(&basis, |j| eigen.eigenvectors[(j, k)]);
                    pencil.orthogonalise(&mut sum, locked.iter().copied());
                    pencil.normalise(&mut sum);
                    sum
                };
                let pair = |&k: &usize| {
                    (1.0 / eigen.eigenvalues[k] - pencil.restricted.shift(), vector(k))
                };
                let pairs: Vec<Pair> = order[..converged].iter().map(pair).collect();
                let best = (converged == 0).then(|| vector(order[0]));
                // Multiple eigenvalues have one vector in an exhausted space; the next start finds the others.
                let exhausted = exhausted && converged == 0;
                return Ok(Cycle { pairs, best, exhausted });
            }
        }
        beta.push(length);
        basis.push(w);
    }
}
