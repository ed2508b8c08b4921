//! An incomplete LU factor without fill, for matrices that diffusion dominates: ILU(0) by rows on the
//! pattern of the matrix. Source: Saad, *Iterative Methods for Sparse Linear Systems* (2003),
//! algorithm 10.4.

use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};

use super::LinearError;
use super::gmres::gmres;
use crate::num::index;

/// An incomplete factor, and the matrix in the same rows.
///
/// Rows are taken in the order of Cuthill and McKee, reversed: level by level from one end of the mesh
/// to the other, however a mesh file numbers its vertices. (On generated meshes, numbered along a Hilbert
/// curve, it takes as many iterations either way.)
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
        Self { order, start, column, from, diagonal, matrix, size, value, work }
    }

    /// Computes the incomplete factor of a matrix of the pattern.
    ///
    /// # Errors
    /// [`LinearError`] where a pivot vanishes or is not finite.
    pub fn factorise(
        &mut self,
        matrix: SparseColMatRef<'_, usize, f64>,
    ) -> Result<(), LinearError> {
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
                return Err(LinearError::new(format!(
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
    /// [`LinearError`] if the iteration does not converge.
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
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
        gmres(product, |v| self.substitute(v), &right, &mut solved)?;
        for (&unknown, value) in order.iter().zip(&solved) {
            x[unknown] = *value;
        }
        Ok(())
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
