//! Sparse matrices by rows, each divided by the size of its diagonal, for products in parallel.

use std::sync::Arc;

use rayon::prelude::*;

use super::row_pattern::Pattern;
use super::shifted::ShiftedJacobian;
use crate::parallel;

/// A matrix by rows. Divided by their diagonals, rows count by the errors of their own unknowns, whatever
/// the units.
pub(super) struct ScaledRows {
    pattern: Arc<Pattern>,
    value: Vec<f64>,
    /// Sizes of the diagonals.
    size: Vec<f64>,
}

impl ScaledRows {
    /// For matrices of this pattern.
    pub(super) fn new(pattern: &Arc<Pattern>) -> Self {
        let (value, size) = (vec![0.0; pattern.entry_count()], vec![1.0; pattern.rows()]);
        Self { pattern: Arc::clone(pattern), value, size }
    }

    /// Takes over the values of a matrix of the pattern.
    pub(super) fn load(&mut self, matrix: ShiftedJacobian<'_>) {
        let Self { pattern, value, size } = self;
        parallel::fill(size, |i| matrix.diagonal_scale(i));
        pattern.cut(value).into_par_iter().for_each(|(rows, part)| {
            let entries = rows.flat_map(|i| matrix.row(i).map(move |(_, value)| (i, value)));
            for (place, (i, value)) in part.iter_mut().zip(entries) {
                *place = value / size[i];
            }
        });
    }

    /// Size of the diagonal of row `i`; 1 where there is none.
    pub(super) fn size(&self, i: usize) -> f64 {
        self.size[i]
    }

    /// Writes the product with `v`.
    pub(super) fn multiply(&self, v: &[f64], out: &mut [f64]) {
        parallel::fill(out, |i| {
            let columns = self.pattern.row(i).iter();
            let values = &self.value[self.pattern.places(i)];
            values.iter().zip(columns).map(|(value, &j)| value * v[j as usize]).sum()
        });
    }

    /// Takes from `out`, in the units of the matrix, what the columns from `first` on give with `tail`, which
    /// begins there.
    pub(super) fn subtract_tail(&self, first: usize, tail: &[f64], out: &mut [f64]) {
        parallel::update(out, |i, out| {
            let columns = self.pattern.row(i);
            let head = columns.partition_point(|&j| (j as usize) < first);
            let values = &self.value[self.pattern.places(i)][head..];
            let terms = values.iter().zip(&columns[head..]);
            let sum: f64 = terms.map(|(value, &j)| value * tail[j as usize - first]).sum();
            *out -= self.size[i] * sum;
        });
    }

    /// Divides a right-hand side by the sizes.
    pub(super) fn in_units_of_rows(&self, x: &[f64], rows: &mut [f64]) {
        parallel::fill(rows, |i| x[i] / self.size[i]);
    }

    /// Undoes the division by the sizes.
    pub(super) fn in_own_units(&self, rows: &mut [f64]) {
        parallel::update(rows, |i, value| *value *= self.size[i]);
    }
}
