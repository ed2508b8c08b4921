//! Restarted GMRES, preconditioned from the right, so that the residual that is watched is the true
//! one. Source: Saad, *Iterative Methods for Sparse Linear Systems* (2003), algorithm 9.5.

use faer::sparse::SparseColMatRef;

use super::LinearError;

/// Residual, relative to the right-hand side, at which a solution is good enough for Newton's
/// method, which corrects it. Rows are divided by their diagonals first, so that the unknowns count by
/// their own errors, whatever their units.
const TOLERANCE: f64 = 1e-2;
/// Iterations before the basis is dropped.
const BASIS: usize = 40;
/// Iterations after which the preconditioner has failed.
const MOST: usize = 400;

/// Solves `A x = b` in place by GMRES on rows divided by their diagonals.
///
/// # Errors
/// As [`gmres`].
pub(super) fn solve_scaled(
    matrix: SparseColMatRef<'_, usize, f64>,
    mut precondition: impl FnMut(&mut [f64]),
    x: &mut [f64],
) -> Result<(), LinearError> {
    let size: Vec<f64> = (0..x.len()).map(|j| diagonal(matrix, j)).collect();
    let mut right = x.to_vec();
    let scale = |v: &mut [f64]| v.iter_mut().zip(&size).for_each(|(v, s)| *v /= s);
    scale(&mut right);
    let product = |v: &[f64], out: &mut [f64]| {
        multiply(matrix, v, out);
        scale(out);
    };
    let back = |v: &mut [f64]| {
        v.iter_mut().zip(&size).for_each(|(v, s)| *v *= s);
        precondition(v);
    };
    gmres(product, back, &right, x)
}

/// Size of a diagonal entry; 1 where there is none.
fn diagonal(matrix: SparseColMatRef<'_, usize, f64>, j: usize) -> f64 {
    let range = matrix.symbolic().col_range(j);
    let found = matrix.symbolic().row_idx()[range.clone()].binary_search(&j);
    match found.map(|k| matrix.val()[range.start + k].abs()) {
        Ok(size) if size > 0.0 => size,
        _ => 1.0,
    }
}

/// Writes the product with `v`.
pub(super) fn multiply(matrix: SparseColMatRef<'_, usize, f64>, v: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    let (rows, values) = (matrix.symbolic().row_idx(), matrix.val());
    for (j, x) in v.iter().enumerate() {
        for k in matrix.symbolic().col_range(j) {
            out[rows[k]] += values[k] * x;
        }
    }
}

/// Euclidean norm.
pub fn norm(v: &[f64]) -> f64 {
    dot(v, v).sqrt()
}

/// Scalar product, in eight sums that do not wait for one another.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (whole_a, whole_b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = whole_a.remainder().iter().zip(whole_b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in whole_a.zip(whole_b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Solves `A x = b` by restarted GMRES, preconditioned from the right, from x = 0.
///
/// # Errors
/// [`LinearError`] if the residual does not fall to [`TOLERANCE`].
pub(super) fn gmres(
    mut multiply: impl FnMut(&[f64], &mut [f64]),
    mut precondition: impl FnMut(&mut [f64]),
    b: &[f64],
    x: &mut [f64],
) -> Result<(), LinearError> {
    let n = b.len();
    x.fill(0.0);
    let goal = TOLERANCE * norm(b);
    let mut residual = b.to_vec();
    let mut iterations = 0;
    let mut work = vec![0.0; n];
    loop {
        let size = norm(&residual);
        if size <= goal {
            return Ok(());
        }
        if iterations >= MOST || !size.is_finite() {
            return Err(LinearError::new(format!(
                "the linear solver has a residual of {:.1e} after {iterations} iterations",
                size / (goal / TOLERANCE)
            )));
        }
        // Arnoldi's basis, and the triangle that Givens rotations make of its Hessenberg matrix.
        let mut basis: Vec<Vec<f64>> = vec![residual.iter().map(|r| r / size).collect()];
        let mut triangle: Vec<Vec<f64>> = Vec::new();
        let mut rotation: Vec<(f64, f64)> = Vec::new();
        let mut right = vec![size];
        for k in 0..BASIS {
            work.copy_from_slice(&basis[k]);
            precondition(&mut work);
            let mut next = vec![0.0; n];
            multiply(&work, &mut next);
            iterations += 1;
            let mut column = Vec::with_capacity(k + 2);
            for v in &basis {
                let h = dot(v, &next);
                next.iter_mut().zip(v).for_each(|(w, v)| *w -= h * v);
                column.push(h);
            }
            let last = norm(&next);
            for (i, (c, s)) in rotation.iter().enumerate() {
                let (a, b) = (column[i], column[i + 1]);
                column[i] = c * a + s * b;
                column[i + 1] = c * b - s * a;
            }
            let length = column[k].hypot(last);
            let (c, s) =
                if length > 0.0 { (column[k] / length, last / length) } else { (1.0, 0.0) };
            column[k] = length;
            rotation.push((c, s));
            triangle.push(column);
            right.push(-s * right[k]);
            right[k] *= c;
            if right[k + 1].abs() <= goal || last == 0.0 || !last.is_finite() {
                break;
            }
            next.iter_mut().for_each(|w| *w /= last);
            basis.push(next);
        }
        // Back substitution, then the update through the preconditioner.
        let m = triangle.len();
        let mut y = right[..m].to_vec();
        for i in (0..m).rev() {
            for j in i + 1..m {
                y[i] -= triangle[j][i] * y[j];
            }
            y[i] /= triangle[i][i];
        }
        work.fill(0.0);
        for (v, y) in basis.iter().zip(&y) {
            work.iter_mut().zip(v).for_each(|(w, v)| *w += y * v);
        }
        precondition(&mut work);
        x.iter_mut().zip(&work).for_each(|(x, w)| *x += w);
        multiply(x, &mut work);
        for i in 0..n {
            residual[i] = b[i] - work[i];
        }
    }
}
