//! GMRES with an incomplete LU factor without fill, for matrices that diffusion dominates.
//!
//! ILU(0) by rows on the pattern of the matrix; GMRES from the right, so that the residual that is
//! watched is the true one. Source: Saad, *Iterative Methods for Sparse Linear Systems* (2003),
//! algorithms 10.4 and 9.5.

use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};

use crate::num::index;
use crate::solve::SolveError;

/// Residual, relative to the right-hand side, at which a solution is good enough for Newton's
/// method, which corrects it. Rows are divided by their diagonals first, so that the unknowns count by
/// their own errors, whatever their units.
const TOLERANCE: f64 = 1e-2;
/// Iterations before the basis is dropped.
const BASIS: usize = 40;
/// Iterations after which the preconditioner has failed.
const MOST: usize = 400;

/// An incomplete factor with the memory of GMRES.
///
/// Rows are taken in the order of Cuthill and McKee, reversed: level by level from one end of the mesh
/// to the other, an incomplete factor drops much less than in an order that jumps about.
pub struct Ilu {
    /// Unknown of every row.
    order: Vec<usize>,
    start: Vec<usize>,
    column: Vec<u32>,
    /// Place of every entry, by rows, in the matrix by columns.
    from: Vec<usize>,
    diagonal: Vec<Option<usize>>,
    /// The matrix by rows, each divided by the size of its diagonal.
    matrix: Vec<f64>,
    /// Sizes of the diagonals.
    size: Vec<f64>,
    value: Vec<f64>,
    /// Iterations since the start.
    iterations: usize,
    work: Vec<f64>,
}

impl Ilu {
    /// For matrices of this pattern.
    #[must_use]
    pub fn new(pattern: SymbolicSparseColMatRef<'_, usize>) -> Self {
        let n = pattern.nrows();
        let order = cuthill_mckee(pattern);
        let mut rank = vec![0usize; n];
        for (row, &unknown) in order.iter().enumerate() {
            rank[unknown] = row;
        }
        let mut rows: Vec<Vec<(usize, usize)>> = vec![Vec::new(); n];
        for j in 0..pattern.ncols() {
            for place in pattern.col_range(j) {
                rows[rank[pattern.row_idx()[place]]].push((rank[j], place));
            }
        }
        let (mut start, mut column, mut from) = (vec![0], Vec::new(), Vec::new());
        let mut diagonal = vec![None; n];
        for (i, row) in rows.iter_mut().enumerate() {
            row.sort_unstable();
            for &(j, place) in row.iter() {
                if i == j {
                    diagonal[i] = Some(column.len());
                }
                column.push(index(j));
                from.push(place);
            }
            start.push(column.len());
        }
        let (value, work) = (vec![0.0; column.len()], vec![0.0; n]);
        let (matrix, size) = (value.clone(), vec![1.0; n]);
        Self { order, start, column, from, diagonal, matrix, size, value, iterations: 0, work }
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
        let Self { start, column, from, diagonal, matrix: own, size, value, .. } = self;
        // Row by row in units of its diagonal: the unknowns count by their own errors.
        for i in 0..size.len() {
            let entry = |k: usize| matrix.val()[from[k]];
            let diagonal = diagonal[i].map_or(0.0, |k| entry(k).abs());
            size[i] = if diagonal > 0.0 { diagonal } else { 1.0 };
            for k in start[i]..start[i + 1] {
                own[k] = entry(k) / size[i];
            }
        }
        value.copy_from_slice(own);
        let n = start.len() - 1;
        let mut place_of = vec![usize::MAX; n];
        for i in 0..n {
            let row = start[i]..start[i + 1];
            for k in row.clone() {
                place_of[column[k] as usize] = k;
            }
            for k in row.clone() {
                let j = column[k] as usize;
                if j >= i {
                    break;
                }
                let Some(pivot) = diagonal[j] else { continue };
                let factor = value[k] / value[pivot];
                value[k] = factor;
                for m in pivot + 1..start[j + 1] {
                    let at = place_of[column[m] as usize];
                    if at != usize::MAX {
                        value[at] -= factor * value[m];
                    }
                }
            }
            for k in row {
                place_of[column[k] as usize] = usize::MAX;
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
    pub(super) fn precondition(&mut self, x: &mut [f64]) {
        let mut work = std::mem::take(&mut self.work);
        for ((work, &unknown), size) in work.iter_mut().zip(&self.order).zip(&self.size) {
            *work = x[unknown] / size;
        }
        self.substitute(&mut work);
        for (&unknown, work) in self.order.iter().zip(&work) {
            x[unknown] = *work;
        }
        self.work = work;
    }

    /// Applies the inverse of the factor to rows in their own order and units.
    fn substitute(&self, x: &mut [f64]) {
        let Self { start, column, diagonal, value, .. } = self;
        let known = |row: std::ops::Range<usize>, x: &[f64]| -> f64 {
            let columns = &column[row.clone()];
            value[row].iter().zip(columns).map(|(v, &j)| v * x[j as usize]).sum()
        };
        for i in 0..x.len() {
            x[i] -= known(start[i]..diagonal[i].unwrap_or(start[i]), x);
        }
        for i in (0..x.len()).rev() {
            let Some(pivot) = diagonal[i] else { continue };
            x[i] = (x[i] - known(pivot + 1..start[i + 1], x)) / value[pivot];
        }
    }

    /// Solves in place with the last matrix factorised.
    ///
    /// # Errors
    /// [`SolveError::Factorisation`] if the iteration does not converge.
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), SolveError> {
        let Self { order, start, column, matrix, size, .. } = &*self;
        let right: Vec<f64> = order.iter().zip(size).map(|(&u, size)| x[u] / size).collect();
        let mut solved = vec![0.0; x.len()];
        let product = |v: &[f64], out: &mut [f64]| {
            for (i, out) in out.iter_mut().enumerate() {
                let row = start[i]..start[i + 1];
                let columns = &column[row.clone()];
                *out = matrix[row].iter().zip(columns).map(|(a, &j)| a * v[j as usize]).sum();
            }
        };
        let done = gmres(product, |v| self.substitute(v), &right, &mut solved)?;
        for (&unknown, value) in order.iter().zip(&solved) {
            x[unknown] = *value;
        }
        self.iterations += done;
        Ok(())
    }
}

/// Solves `A x = b` in place by GMRES on rows divided by their diagonals; returns the iterations.
///
/// # Errors
/// As [`gmres`].
pub(super) fn solve_scaled(
    matrix: SparseColMatRef<'_, usize, f64>,
    mut precondition: impl FnMut(&mut [f64]),
    x: &mut [f64],
) -> Result<usize, SolveError> {
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

fn norm(v: &[f64]) -> f64 {
    dot(v, v).sqrt()
}

/// Scalar product, in eight sums that do not wait for one another.
fn dot(a: &[f64], b: &[f64]) -> f64 {
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

/// The unknowns level by level from one end of the graph, the last level first.
fn cuthill_mckee(pattern: SymbolicSparseColMatRef<'_, usize>) -> Vec<usize> {
    let n = pattern.ncols();
    let neighbours = |j: usize| &pattern.row_idx()[pattern.col_range(j)];
    let mut seen = vec![0usize; n];
    let mut round = 0usize;
    // The level sets from a start; the last of them lie farthest away.
    let mut levels = |start: usize, order: &mut Vec<usize>, round: usize| {
        let first = order.len();
        order.push(start);
        seen[start] = round;
        let mut at = first;
        while at < order.len() {
            let from = order.len();
            for &i in neighbours(order[at]) {
                if seen[i] != round {
                    seen[i] = round;
                    order.push(i);
                }
            }
            order[from..].sort_by_key(|&i| neighbours(i).len());
            at += 1;
        }
    };
    let mut order = Vec::with_capacity(n);
    let mut placed = vec![false; n];
    for unknown in 0..n {
        if placed[unknown] {
            continue;
        }
        // Twice to the far end: nearly the longest way across.
        let mut start = unknown;
        for _ in 0..2 {
            let mut trial = Vec::new();
            round += 1;
            levels(start, &mut trial, round);
            start = trial.last().copied().unwrap_or(start);
        }
        let first = order.len();
        round += 1;
        levels(start, &mut order, round);
        order[first..].iter().for_each(|&i| placed[i] = true);
    }
    order.reverse();
    order
}
