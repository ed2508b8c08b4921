//! Sparse matrices in rows, and their products in fixed patterns.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::lists::CompressedLists;
use super::strips::{Block, Strips};
use crate::linear::Pattern;
use crate::num::{index, single};
use crate::parallel;

/// Parts of a product that are computed side by side.
const PARTS: usize = 16;

/// The values of a matrix: in double precision; or, for an incomplete factor, which has no more, in single precision and
/// divided by a scale, so that they are near 1 in any units.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum StoredValues {
    Double(Vec<f64>),
    Single { all: Vec<f32>, scale: f64, measured: bool },
}

impl Default for StoredValues {
    fn default() -> Self {
        Self::Double(Vec::new())
    }
}

impl StoredValues {
    #[inline]
    fn get(&self, place: usize) -> f64 {
        match self {
            Self::Double(all) => all[place],
            Self::Single { all, scale, .. } => scale * f64::from(all[place]),
        }
    }

    #[inline]
    fn change(&mut self, place: usize, new: impl FnOnce(f64) -> f64) {
        match self {
            Self::Double(all) => all[place] = new(all[place]),
            Self::Single { all, scale, .. } => {
                all[place] = single(new(*scale * f64::from(all[place])) / *scale);
            }
        }
    }
}

/// A matrix by rows; copies share the pattern.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sparse {
    pub(super) pattern: Arc<Pattern>,
    pub(super) value: StoredValues,
    /// Which unknown each row is of, and each column; none where they are in their own order.
    pub(super) strips: Option<Arc<Strips>>,
}

impl Sparse {
    pub(super) fn zeros(pattern: Pattern) -> Self {
        let value = StoredValues::Double(vec![0.0; pattern.entry_count()]);
        Self { value, pattern: Arc::new(pattern), strips: None }
    }

    /// A square matrix of this pattern in single precision, its rows and columns in the order of strips.
    pub(super) fn zeros_for_incomplete_factor(pattern: &Pattern) -> Self {
        let block = Block { pattern, first: 0 };
        let strips = Strips::new(block);
        let pattern = strips.reorder(block);
        let all = vec![0.0; pattern.entry_count()];
        let value = StoredValues::Single { all, scale: 1.0, measured: false };
        Self { value, pattern: Arc::new(pattern), strips: Some(Arc::new(strips)) }
    }

    /// Sets all values to 0. A matrix in single precision without a scale takes as its scale the largest magnitude of
    /// the values to come, which `find_largest` writes.
    pub(super) fn clear_and_scale(&mut self, find_largest: impl FnOnce(&mut f64)) {
        match &mut self.value {
            StoredValues::Double(all) => all.fill(0.0),
            StoredValues::Single { all, scale, measured } => {
                all.fill(0.0);
                // Scaled once, by the first values that are not all 0: later ones have a similar magnitude.
                if !*measured {
                    let mut largest = 0.0;
                    find_largest(&mut largest);
                    *measured = largest > 0.0 && largest.is_finite();
                    *scale = if *measured { largest } else { 1.0 };
                }
            }
        }
    }

    /// Adds to the entry at these unknowns; whether there is one.
    #[inline]
    pub(super) fn add(&mut self, row: usize, column: usize, value: f64) -> bool {
        let own = |unknown: usize| match &self.strips {
            Some(strips) => strips.row[unknown],
            None => index(unknown),
        };
        let (row, column) = (own(row) as usize, own(column));
        let Ok(offset) = self.pattern.row(row).binary_search(&column) else { return false };
        self.value.change(self.pattern.start[row] as usize + offset, |old| old + value);
        true
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.pattern.rows()
    }

    /// Number of columns.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.pattern.columns
    }

    /// Number of entries in the pattern.
    #[must_use]
    pub fn entry_count(&self) -> usize {
        self.pattern.entry_count()
    }

    /// Which entries there are.
    #[must_use]
    pub fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// The unknown that row `i` is of, which is `i` itself but in a matrix for incomplete factors
    /// ([`Assembly::for_incomplete_factor`](super::Assembly::for_incomplete_factor)).
    #[must_use]
    #[inline]
    pub fn unknown(&self, i: usize) -> usize {
        self.strips.as_ref().map_or(i, |strips| strips.order[i] as usize)
    }

    /// Columns and values of row `i`.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let columns = self.pattern.row(i).iter().map(|&j| j as usize);
        columns.zip(self.pattern.places(i).map(|place| self.value.get(place)))
    }

    /// The value at this place of the pattern.
    #[must_use]
    #[inline]
    pub fn value(&self, place: usize) -> f64 {
        self.value.get(place)
    }

    /// The largest size of an entry.
    #[must_use]
    pub fn largest(&self) -> f64 {
        (0..self.entry_count()).fold(0.0, |most: f64, place| most.max(self.value(place).abs()))
    }

    /// Multiplies every row by the number of its unknown.
    pub fn scale_rows(&mut self, by: &[f64]) {
        for i in 0..self.rows() {
            let by = by[self.unknown(i)];
            self.pattern.places(i).for_each(|place| self.value.change(place, |v| v * by));
        }
    }

    /// Writes the product with `x`.
    pub fn multiply(&self, x: &[f64], out: &mut [f64]) {
        match &self.strips {
            None => parallel::fill(out, |i| self.row(i).map(|(j, value)| value * x[j]).sum()),
            Some(strips) => parallel::fill(out, |unknown| {
                let row = self.row(strips.row[unknown] as usize);
                row.map(|(j, value)| value * x[strips.order[j] as usize]).sum()
            }),
        }
    }

    /// The product of the transposed matrix with `x`.
    #[must_use]
    pub fn multiply_transposed(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.columns()];
        for (i, x) in x.iter().enumerate() {
            self.row(i).for_each(|(j, value)| out[j] += value * x);
        }
        out
    }

    /// The pattern by columns (CSC): where each column starts, and for every entry its row and its place in the
    /// order of rows.
    #[must_use]
    pub fn by_columns(&self) -> (Vec<usize>, Vec<usize>, Vec<u32>) {
        let pattern = &self.pattern;
        let entries = || {
            (0..self.rows()).flat_map(|i| {
                pattern.places(i).map(move |k| (pattern.column[k] as usize, (i, index(k))))
            })
        };
        let CompressedLists { start, item } = CompressedLists::sorted(pattern.columns, entries);
        let (row, place) = item.into_iter().unzip();
        (start, row, place)
    }
}

/// `A + B C` in a fixed pattern.
#[derive(Debug, Clone, Default)]
pub struct SumOfProduct(Sparse);

impl SumOfProduct {
    /// Makes the pattern.
    #[must_use]
    pub fn new(a: &Sparse, b: &Sparse, c: &Sparse) -> Self {
        let mut seen = vec![false; a.columns()];
        let row = &mut |i: usize, row: &mut Vec<u32>| {
            row.extend_from_slice(a.pattern.row(i));
            row.iter().for_each(|&j| seen[j as usize] = true);
            for &k in b.pattern.row(i) {
                for &j in c.pattern.row(k as usize) {
                    if !std::mem::replace(&mut seen[j as usize], true) {
                        row.push(j);
                    }
                }
            }
            row.sort_unstable();
            row.iter().for_each(|&j| seen[j as usize] = false);
        };
        Self(Sparse::zeros(Pattern::new(a.columns(), a.rows(), a.entry_count(), row)))
    }

    /// Computes the values.
    pub fn fill(&mut self, a: &Sparse, b: &Sparse, c: &Sparse) -> &Sparse {
        let Sparse { pattern, value: StoredValues::Double(value), .. } = &mut self.0 else {
            unreachable!("made in double precision")
        };
        let fill = |rows: Range<usize>, value: &mut [f64]| {
            let mut work = vec![0.0; pattern.columns];
            let first = pattern.places(rows.start).start;
            for i in rows {
                for (j, value) in a.row(i) {
                    work[j] += value;
                }
                for (k, factor) in b.row(i) {
                    for (j, value) in c.row(k) {
                        work[j] += factor * value;
                    }
                }
                for k in pattern.places(i) {
                    value[k - first] = std::mem::take(&mut work[pattern.column[k] as usize]);
                }
            }
        };
        // Few parts: each needs a row of its own to work in.
        let step = a.rows().div_ceil(PARTS).max(1);
        let (mut parts, mut rest) = (Vec::new(), value.as_mut_slice());
        for begin in (0..a.rows()).step_by(step) {
            let end = (begin + step).min(a.rows());
            let length = (pattern.start[end] - pattern.start[begin]) as usize;
            let (part, tail) = rest.split_at_mut(length);
            parts.push((begin..end, part));
            rest = tail;
        }
        parts.into_par_iter().for_each(|(rows, part)| fill(rows, part));
        &self.0
    }

    /// The matrix.
    #[must_use]
    pub fn matrix(&self) -> &Sparse {
        &self.0
    }

    /// The matrix, to be changed until it is filled again.
    pub fn matrix_mut(&mut self) -> &mut Sparse {
        &mut self.0
    }
}
