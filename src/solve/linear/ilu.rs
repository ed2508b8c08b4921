//! GMRES with an incomplete LU factor without fill, for matrices that diffusion dominates.
//!
//! ILU(0) by rows on the pattern of the matrix; GMRES from the right, so that the residual that is
//! watched is the true one. Source: Saad, *Iterative Methods for Sparse Linear Systems* (2003),
//! algorithms 10.4 and 9.5.

use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};

use crate::solve::SolveError;

/// Residual, relative to the right-hand side, at which a solution is good enough for Newton's
/// method, whose own error is larger.
const TOLERANCE: f64 = 1e-6;
/// Iterations before the basis is dropped.
const BASIS: usize = 40;
/// Iterations after which the preconditioner has failed.
const MOST: usize = 400;

/// An incomplete factor with the memory of GMRES.
pub struct Ilu {
    start: Vec<usize>,
    column: Vec<usize>,
    /// Place of every entry, by rows, in the matrix by columns.
    from: Vec<usize>,
    diagonal: Vec<Option<usize>>,
    value: Vec<f64>,
    /// Iterations since the start.
    iterations: usize,
}

impl Ilu {
    /// For matrices of this pattern.
    #[must_use]
    pub fn new(pattern: SymbolicSparseColMatRef<'_, usize>) -> Self {
        let n = pattern.nrows();
        let mut start = vec![0usize; n + 1];
        for &i in pattern.row_idx() {
            start[i + 1] += 1;
        }
        for i in 0..n {
            start[i + 1] += start[i];
        }
        let mut next = start.clone();
        let count = pattern.row_idx().len();
        let (mut column, mut from) = (vec![0; count], vec![0; count]);
        let mut diagonal = vec![None; n];
        for j in 0..pattern.ncols() {
            for place in pattern.col_range(j) {
                let i = pattern.row_idx()[place];
                let at = next[i];
                next[i] += 1;
                column[at] = j;
                from[at] = place;
                if i == j {
                    diagonal[i] = Some(at);
                }
            }
        }
        Self { start, column, from, diagonal, value: vec![0.0; count], iterations: 0 }
    }

    /// Iterations of all solutions so far.
    #[must_use]
    pub fn iterations(&self) -> usize {
        self.iterations
    }

    /// Computes the incomplete factor of a matrix of the pattern.
    ///
    /// # Errors
    /// [`SolveError::Factorisation`] where a pivot vanishes or is not finite.
    pub fn factorise(&mut self, matrix: SparseColMatRef<'_, usize, f64>) -> Result<(), SolveError> {
        let Self { start, column, from, diagonal, value, .. } = self;
        for (value, &place) in value.iter_mut().zip(from.iter()) {
            *value = matrix.val()[place];
        }
        let n = start.len() - 1;
        let mut place_of = vec![usize::MAX; n];
        for i in 0..n {
            let row = start[i]..start[i + 1];
            for k in row.clone() {
                place_of[column[k]] = k;
            }
            for k in row.clone() {
                let j = column[k];
                if j >= i {
                    break;
                }
                let Some(pivot) = diagonal[j] else { continue };
                let factor = value[k] / value[pivot];
                value[k] = factor;
                for m in pivot + 1..start[j + 1] {
                    let at = place_of[column[m]];
                    if at != usize::MAX {
                        value[at] -= factor * value[m];
                    }
                }
            }
            for k in row {
                place_of[column[k]] = usize::MAX;
            }
            let pivot = diagonal[i].map_or(0.0, |at| value[at]);
            if pivot == 0.0 || !pivot.is_finite() {
                return Err(SolveError::Factorisation(format!(
                    "the incomplete factor of the Newton matrix has the pivot {pivot} in row {i}"
                )));
            }
        }
        Ok(())
    }

    /// Applies the inverse of the factor in place.
    pub(super) fn precondition(&self, x: &mut [f64]) {
        let n = x.len();
        for i in 0..n {
            let mut sum = x[i];
            for k in self.start[i]..self.start[i + 1] {
                let j = self.column[k];
                if j >= i {
                    break;
                }
                sum -= self.value[k] * x[j];
            }
            x[i] = sum;
        }
        for i in (0..n).rev() {
            let Some(pivot) = self.diagonal[i] else { continue };
            let mut sum = x[i];
            for k in pivot + 1..self.start[i + 1] {
                sum -= self.value[k] * x[self.column[k]];
            }
            x[i] = sum / self.value[pivot];
        }
    }

    /// Solves in place.
    ///
    /// # Errors
    /// [`SolveError::Factorisation`] if the iteration does not converge.
    pub fn solve(
        &mut self,
        matrix: SparseColMatRef<'_, usize, f64>,
        x: &mut [f64],
    ) -> Result<(), SolveError> {
        let multiply = |v: &[f64], out: &mut [f64]| multiply(matrix, v, out);
        let mut solved = x.to_vec();
        let precondition = |v: &mut [f64]| self.precondition(v);
        let done = gmres(multiply, precondition, x, &mut solved)?;
        self.iterations += done;
        x.copy_from_slice(&solved);
        Ok(())
    }
}

pub(super) fn multiply(matrix: SparseColMatRef<'_, usize, f64>, v: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    let (rows, values) = (matrix.symbolic().row_idx(), matrix.val());
    for (j, x) in v.iter().enumerate() {
        for k in matrix.symbolic().col_range(j) {
            out[rows[k]] += values[k] * x;
        }
    }
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Solves `A x = b` by restarted GMRES, preconditioned from the right, from x = 0; returns the
/// iterations.
///
/// # Errors
/// [`SolveError::Factorisation`] if the residual does not fall to [`TOLERANCE`].
pub(super) fn gmres(
    mut multiply: impl FnMut(&[f64], &mut [f64]),
    mut precondition: impl FnMut(&mut [f64]),
    b: &[f64],
    x: &mut [f64],
) -> Result<usize, SolveError> {
    let n = b.len();
    x.fill(0.0);
    let goal = TOLERANCE * norm(b);
    let mut residual = b.to_vec();
    let mut iterations = 0;
    let mut work = vec![0.0; n];
    loop {
        let size = norm(&residual);
        if size <= goal {
            return Ok(iterations);
        }
        if iterations >= MOST || !size.is_finite() {
            return Err(SolveError::Factorisation(format!(
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
                let h: f64 = v.iter().zip(&next).map(|(v, w)| v * w).sum();
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
