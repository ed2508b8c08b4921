//! Sparse matrices by rows, each divided by the size of its diagonal, for products in parallel.

use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use rayon::prelude::*;

use super::full_rows::split;
use crate::num::index;
use crate::parallel;

/// A matrix by rows. Divided by their diagonals, rows count by the errors of their own unknowns, whatever
/// the units.
pub(super) struct ScaledRows {
    /// Unknown of every row, and row of every unknown.
    order: Vec<usize>,
    row: Vec<u32>,
    start: Vec<usize>,
    /// Columns in the order of the rows, ascending.
    column: Vec<u32>,
    /// Place of every entry in the matrix by columns.
    from: Vec<u32>,
    /// Place of the diagonal entry in every row.
    diagonal: Vec<Option<usize>>,
    value: Vec<f64>,
    /// Sizes of the diagonals.
    size: Vec<f64>,
}

impl ScaledRows {
    /// For matrices of this pattern, with the rows in this order.
    pub(super) fn new(pattern: SymbolicSparseColMatRef<'_, usize>, order: Vec<usize>) -> Self {
        let n = order.len();
        let mut row = vec![0; n];
        for (rank, &unknown) in order.iter().enumerate() {
            row[unknown] = index(rank);
        }
        let mut start = vec![0usize; n + 1];
        for &i in pattern.row_idx() {
            start[row[i] as usize + 1] += 1;
        }
        for i in 0..n {
            start[i + 1] += start[i];
        }
        let mut next = start.clone();
        let mut column = vec![0; start[n]];
        let mut from = vec![0u32; start[n]];
        let mut diagonal = vec![None; n];
        // Column by column in the new order, so that every row is filled in ascending order.
        for (j, &unknown) in order.iter().enumerate() {
            for place in pattern.col_range(unknown) {
                let i = row[pattern.row_idx()[place]] as usize;
                if i == j {
                    diagonal[i] = Some(next[i]);
                }
                column[next[i]] = index(j);
                from[next[i]] = index(place);
                next[i] += 1;
            }
        }
        let value = vec![0.0; start[n]];
        Self { order, row, start, column, from, diagonal, value, size: vec![1.0; n] }
    }

    /// Takes over the values of a matrix of the pattern.
    pub(super) fn load(&mut self, matrix: SparseColMatRef<'_, usize, f64>) {
        let Self { start, from, diagonal, value, size, .. } = self;
        parallel::fill(size, |i| {
            match diagonal[i].map(|place| matrix.val()[from[place] as usize].abs()) {
                Some(size) if size > 0.0 => size,
                _ => 1.0,
            }
        });
        split(start, value).into_par_iter().for_each(|(rows, part)| {
            let first = start[rows.start];
            for i in rows {
                for place in start[i]..start[i + 1] {
                    part[place - first] = matrix.val()[from[place] as usize] / size[i];
                }
            }
        });
    }

    /// Size of the diagonal of row `i`; 1 where there is none.
    pub(super) fn size(&self, i: usize) -> f64 {
        self.size[i]
    }

    /// Number of rows.
    pub(super) fn len(&self) -> usize {
        self.order.len()
    }

    /// Places of the entries of row `i`.
    pub(super) fn places(&self, i: usize) -> std::ops::Range<usize> {
        self.start[i]..self.start[i + 1]
    }

    /// Columns of all entries.
    pub(super) fn columns(&self) -> &[u32] {
        &self.column
    }

    /// Values of all entries.
    pub(super) fn values(&self) -> &[f64] {
        &self.value
    }

    /// Writes the product with `v`.
    pub(super) fn multiply(&self, v: &[f64], out: &mut [f64]) {
        parallel::fill(out, |i| {
            let columns = self.column[self.places(i)].iter();
            let values = &self.value[self.places(i)];
            values.iter().zip(columns).map(|(value, &j)| value * v[j as usize]).sum()
        });
    }

    /// Takes from `out`, in the units of the matrix, what the columns from `first` on give with `tail`, which
    /// begins there.
    pub(super) fn subtract_tail(&self, first: usize, tail: &[f64], out: &mut [f64]) {
        parallel::update(out, |i, out| {
            let places = self.places(i);
            let columns = &self.column[places.clone()];
            let head = columns.partition_point(|&j| (j as usize) < first);
            let values = &self.value[places][head..];
            let terms = values.iter().zip(&columns[head..]);
            let sum: f64 = terms.map(|(value, &j)| value * tail[j as usize - first]).sum();
            *out -= self.size[i] * sum;
        });
    }

    /// Writes a right-hand side in the order and the units of the rows.
    pub(super) fn take(&self, x: &[f64], rows: &mut [f64]) {
        parallel::fill(rows, |i| x[self.order[i]] / self.size[i]);
    }

    /// Writes a solution in the order of the unknowns.
    pub(super) fn give(&self, rows: &[f64], x: &mut [f64]) {
        parallel::fill(x, |unknown| rows[self.row[unknown] as usize]);
    }

    /// Undoes the division by the sizes.
    pub(super) fn in_own_units(&self, rows: &mut [f64]) {
        parallel::update(rows, |i, value| *value *= self.size[i]);
    }
}
