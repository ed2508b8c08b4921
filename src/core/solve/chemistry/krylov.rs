//! What an exponential integrator needs: the action of φ functions of a large sparse matrix.

use nalgebra::DMatrix;

use crate::linear::{dot, norm};
use crate::num::real;

/// Largest Krylov space.
const MAX_DIMENSION: usize = 60;
/// The space is inspected whenever it has grown by this.
const CHECK_STRIDE: usize = 4;
/// Chain of polynomial terms: 1, τ, τ²/2.
const POLYNOMIAL_TERMS: usize = 3;

/// The solution at `h` of `u' = A u + w_0 + τ w_1 + τ²/2 w_2`, `u(0) = 0`, that is
/// `Σ_k h^{k+1} φ_{k+1}(hA) w_k`, to a root mean square error of `tolerance`; `None` if a Krylov
/// space of 60 does not hold it.
///
/// It is the exponential of the matrix that has the `w_k` beside A and a nilpotent block below
/// (Al-Mohy & Higham, SIAM J. Sci. Comput. 33 (2011) 488, doi:10.1137/100788860), applied by
/// Arnoldi's method; the error estimate is the first that the space leaves out (Saad, SIAM J.
/// Numer. Anal. 29 (1992) 209, doi:10.1137/0729014).
pub(super) fn polynomial_forcing(
    apply: impl Fn(&[f64], &mut [f64]),
    forcing: [&[f64]; POLYNOMIAL_TERMS],
    h: f64,
    tolerance: f64,
) -> Option<Vec<f64>> {
    let n = forcing[0].len();
    let powers = [1.0, h, h * h];
    // u is taken in units of the forcing's size, so that it weighs as much as the chain.
    let size = forcing.iter().zip(powers).map(|(w, power)| h * power * norm(w)).fold(0.0, f64::max);
    if size == 0.0 {
        return Some(vec![0.0; n]);
    }
    if !size.is_finite() {
        return None;
    }
    let whole = |v: &[f64], out: &mut [f64]| {
        apply(&v[..n], &mut out[..n]);
        let chain = &v[n..];
        for (k, w) in forcing.iter().enumerate() {
            // chain[POLYNOMIAL_TERMS-1-k] is (τ/h)^k / k!
            let factor = chain[POLYNOMIAL_TERMS - 1 - k] * powers[k] / size;
            if factor != 0.0 {
                for (out, w) in out[..n].iter_mut().zip(*w) {
                    *out += factor * w;
                }
            }
        }
        for k in 0..POLYNOMIAL_TERMS {
            out[n + k] = if k + 1 < POLYNOMIAL_TERMS { chain[k + 1] / h } else { 0.0 };
        }
        out.iter_mut().for_each(|out| *out *= h);
    };
    let mut first = vec![0.0; n + POLYNOMIAL_TERMS];
    first[n + POLYNOMIAL_TERMS - 1] = 1.0;
    let mut basis = vec![first];
    let mut hessenberg = DMatrix::<f64>::zeros(MAX_DIMENSION + 1, MAX_DIMENSION + 1);
    let scale = tolerance * real(n.max(1)).sqrt();
    for m in 1..=MAX_DIMENSION {
        let mut next = vec![0.0; n + POLYNOMIAL_TERMS];
        whole(&basis[m - 1], &mut next);
        let left = orthogonalise(&mut next, &basis, &mut hessenberg, m - 1);
        let breakdown = left <= 1e-14 * hessenberg.column(m - 1).norm();
        if m % CHECK_STRIDE == 0 || m == MAX_DIMENSION || breakdown {
            let exponential = augmented_exponential(&hessenberg, m);
            let error = size * left * exponential[(m - 1, m)].abs();
            if !error.is_finite() {
                return None;
            }
            if breakdown || error <= scale {
                let by = |j: usize| size * exponential[(j, 0)];
                return Some(combination(&basis, by, n));
            }
        }
        next.iter_mut().for_each(|next| *next /= left);
        basis.push(next);
    }
    None
}

/// The exponential of the leading m × m part of `hessenberg` with one column more, which gives the action of φ_1; its
/// last entry is the error estimate.
fn augmented_exponential(hessenberg: &DMatrix<f64>, m: usize) -> DMatrix<f64> {
    let mut small = DMatrix::<f64>::zeros(m + 1, m + 1);
    small.view_mut((0, 0), (m, m)).copy_from(&hessenberg.view((0, 0), (m, m)));
    small[(0, m)] = 1.0;
    small.exp()
}

/// Makes `next` orthogonal to `basis` by Gram-Schmidt, twice; its components and the norm of the rest, which is
/// returned, go to a column of `hessenberg`.
fn orthogonalise(
    next: &mut [f64],
    basis: &[Vec<f64>],
    hessenberg: &mut DMatrix<f64>,
    column: usize,
) -> f64 {
    for _ in 0..2 {
        for (i, v) in basis.iter().enumerate() {
            let by = dot(v, next);
            hessenberg[(i, column)] += by;
            for (next, v) in next.iter_mut().zip(v) {
                *next -= by * v;
            }
        }
    }
    let left = norm(next);
    hessenberg[(column + 1, column)] = left;
    left
}

/// The first `n` entries of the sum of `basis` with the weights `by`.
fn combination(basis: &[Vec<f64>], by: impl Fn(usize) -> f64, n: usize) -> Vec<f64> {
    let mut sum = vec![0.0; n];
    for (j, v) in basis.iter().enumerate() {
        let by = by(j);
        for (sum, v) in sum.iter_mut().zip(v) {
            *sum += by * v;
        }
    }
    sum
}
