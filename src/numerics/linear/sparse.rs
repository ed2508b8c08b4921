//! Sparse matrices in rows, filled by lists of entries and multiplied in fixed patterns.
//!
//! Who assembles a matrix names its entries in an order that depends on the mesh alone. The first
//! time their places are looked up ([`Assembly::new`]); from then on values are added without a
//! search or an allocation.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::full_rows::split;
use crate::num::index;
use crate::parallel;

/// Parts of a product that are computed side by side.
const PARTS: usize = 16;

/// Which entries a matrix by rows has.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pattern {
    columns: usize,
    start: Vec<u32>,
    column: Vec<u32>,
}

impl Pattern {
    /// Of rows of these lengths that `row` writes into an empty list, ascending.
    fn new(columns: usize, rows: usize, entries: usize, row: &mut PatternRow<'_>) -> Self {
        let (mut start, mut column) = (Vec::with_capacity(rows + 1), Vec::with_capacity(entries));
        start.push(0);
        let mut work = Vec::new();
        for i in 0..rows {
            work.clear();
            row(i, &mut work);
            column.extend_from_slice(&work);
            start.push(index(column.len()));
        }
        column.shrink_to_fit();
        Self { columns, start, column }
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    /// Number of entries.
    #[must_use]
    pub fn entries(&self) -> usize {
        self.column.len()
    }

    /// Places of the entries of row `i` among all.
    #[must_use]
    #[inline]
    pub fn places(&self, i: usize) -> Range<usize> {
        self.start[i] as usize..self.start[i + 1] as usize
    }

    /// Columns of row `i`, ascending.
    #[must_use]
    #[inline]
    pub fn row(&self, i: usize) -> &[u32] {
        &self.column[self.places(i)]
    }

    /// Cuts values, one for every entry, into those of blocks of rows.
    pub(super) fn cut<'a, T>(&self, value: &'a mut [T]) -> Vec<(Range<usize>, &'a mut [T])> {
        split(self.rows(), |i| self.start[i] as usize, value)
    }
}

/// Writes the columns of a row.
type PatternRow<'a> = dyn FnMut(usize, &mut Vec<u32>) + 'a;

/// A matrix by rows; copies share the pattern.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sparse {
    pattern: Arc<Pattern>,
    value: Vec<f64>,
}

impl Sparse {
    fn zeros(pattern: Pattern) -> Self {
        Self { value: vec![0.0; pattern.entries()], pattern: Arc::new(pattern) }
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
    pub fn entries(&self) -> usize {
        self.pattern.entries()
    }

    /// Which entries there are.
    #[must_use]
    pub fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// Columns and values of row `i`.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let columns = self.pattern.row(i).iter().map(|&j| j as usize);
        columns.zip(self.value[self.pattern.places(i)].iter().copied())
    }

    /// The values, row by row.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.value
    }

    /// Multiplies every row by a number.
    pub fn scale_rows(&mut self, by: &[f64]) {
        for (i, by) in by.iter().enumerate() {
            self.value[self.pattern.places(i)].iter_mut().for_each(|v| *v *= by);
        }
    }

    /// Writes the product with `x`.
    pub fn multiply(&self, x: &[f64], out: &mut [f64]) {
        parallel::fill(out, |i| self.row(i).map(|(j, value)| value * x[j]).sum());
    }

    /// The entries column by column: for every column its rows, and for every such entry its place in
    /// the order of rows.
    #[must_use]
    pub fn by_columns(&self) -> (Vec<usize>, Vec<usize>, Vec<u32>) {
        let pattern = &self.pattern;
        let mut start = vec![0usize; pattern.columns + 1];
        for &j in &pattern.column {
            start[j as usize + 1] += 1;
        }
        for j in 0..pattern.columns {
            start[j + 1] += start[j];
        }
        let mut next = start.clone();
        let mut row = vec![0usize; self.entries()];
        let mut place = vec![0u32; self.entries()];
        for i in 0..self.rows() {
            for k in pattern.places(i) {
                let at = &mut next[pattern.column[k] as usize];
                row[*at] = i;
                place[*at] = index(k);
                *at += 1;
            }
        }
        (start, row, place)
    }
}

/// Takes entries: their places at first, their values later.
pub struct Entries<'a>(Mode<'a>);

enum Mode<'a> {
    Collect(&'a mut Vec<(u32, u32)>),
    Fill { place: std::slice::Iter<'a, u32>, value: &'a mut [f64] },
    Keep(std::slice::IterMut<'a, f64>),
}

/// One of the lists that a matrix is filled from: it names its entries in an order of its own.
pub type Part<'a> = dyn Fn(&mut Entries<'_>) + Sync + 'a;

impl Entries<'_> {
    /// Adds `value` at (`row`, `column`).
    #[inline]
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        match &mut self.0 {
            Mode::Collect(all) => all.push((index(row), index(column))),
            Mode::Fill { place, value: all } => {
                let place = place.next();
                debug_assert!(place.is_some(), "more entries than at first");
                if let Some(place) = place {
                    all[*place as usize] += value;
                }
            }
            Mode::Keep(all) => {
                let place = all.next();
                debug_assert!(place.is_some(), "more entries than at first");
                if let Some(place) = place {
                    *place = value;
                }
            }
        }
    }
}

/// A matrix that is filled from a list of entries.
#[derive(Debug, Clone, Default)]
pub struct Assembly {
    place: Vec<u32>,
    matrix: Sparse,
    /// Where the list of every part ends.
    ends: Vec<usize>,
    /// The values that parts name, and which of them every entry of the matrix is the sum of.
    named: Vec<f64>,
    sum_start: Vec<u32>,
    sum: Vec<u32>,
}

impl Assembly {
    /// Looks up the places of the entries that `name` gives.
    #[must_use]
    pub fn new(rows: usize, columns: usize, name: impl FnOnce(&mut Entries<'_>)) -> Self {
        Self::in_parts(rows, columns, &[], name)
    }

    /// The same for `parts`, which are filled in parallel, and for `name` after them.
    #[must_use]
    pub fn in_parts(
        rows: usize,
        columns: usize,
        parts: &[&Part<'_>],
        name: impl FnOnce(&mut Entries<'_>),
    ) -> Self {
        let (mut all, mut ends) = (Vec::new(), Vec::new());
        for part in parts {
            part(&mut Entries(Mode::Collect(&mut all)));
            ends.push(all.len());
        }
        name(&mut Entries(Mode::Collect(&mut all)));
        // The list row by row, then every row sorted and without repetition.
        let mut first = vec![0u32; rows + 1];
        all.iter().for_each(|&(row, _)| first[row as usize + 1] += 1);
        for i in 0..rows {
            first[i + 1] += first[i];
        }
        let mut next = first.clone();
        let mut listed = vec![0u32; all.len()];
        for &(row, column) in &all {
            let at = &mut next[row as usize];
            listed[*at as usize] = column;
            *at += 1;
        }
        drop(next);
        let pattern = Pattern::new(columns, rows, all.len(), &mut |i, row| {
            row.extend_from_slice(&listed[first[i] as usize..first[i + 1] as usize]);
            row.sort_unstable();
            row.dedup();
        });
        drop((first, listed));
        let matrix = Sparse::zeros(pattern);
        let mut place = vec![0; all.len()];
        parallel::fill(&mut place, |k| {
            let (row, column) = all[k];
            let row = row as usize;
            let found = matrix.pattern.row(row).binary_search(&column).unwrap_or_default();
            index(matrix.pattern.places(row).start + found)
        });
        let named = vec![0.0; ends.last().copied().unwrap_or(0)];
        let (mut sum_start, mut sum) = (Vec::new(), Vec::new());
        if !named.is_empty() {
            sum_start = vec![0; matrix.entries() + 1];
            sum = vec![0; named.len()];
            let listed = &place[..named.len()];
            listed.iter().for_each(|&k| sum_start[k as usize + 1] += 1);
            for k in 0..matrix.entries() {
                sum_start[k + 1] += sum_start[k];
            }
            let mut next = sum_start.clone();
            for (number, &k) in listed.iter().enumerate() {
                sum[next[k as usize] as usize] = index(number);
                next[k as usize] += 1;
            }
        }
        place.drain(..named.len());
        place.shrink_to_fit();
        Self { place, matrix, ends, named, sum_start, sum }
    }

    /// Fills the matrix with the values that `name` gives, in the same order as at first.
    pub fn fill(&mut self, name: impl FnOnce(&mut Entries<'_>)) {
        self.fill_in_parts(&[], name);
    }

    /// The same for `parts`, as many as at first.
    pub fn fill_in_parts(&mut self, parts: &[&Part<'_>], name: impl FnOnce(&mut Entries<'_>)) {
        let (mut lists, mut rest, mut begin) = (Vec::new(), &mut *self.named, 0);
        for (part, &end) in parts.iter().zip(&self.ends) {
            let (list, tail) = rest.split_at_mut(end - begin);
            lists.push((part, list));
            (rest, begin) = (tail, end);
        }
        lists.into_par_iter().for_each(|(part, list)| {
            part(&mut Entries(Mode::Keep(list.iter_mut())));
        });
        let Self { named, sum_start, sum, matrix: Sparse { value, .. }, place, .. } = self;
        if named.is_empty() {
            value.fill(0.0);
        } else {
            parallel::fill(value, |k| {
                let own = &sum[sum_start[k] as usize..sum_start[k + 1] as usize];
                own.iter().map(|&number| named[number as usize]).sum()
            });
        }
        name(&mut Entries(Mode::Fill { place: place.iter(), value }));
    }

    /// The matrix.
    #[must_use]
    pub fn matrix(&self) -> &Sparse {
        &self.matrix
    }

    /// The matrix, to be changed until it is filled again.
    pub fn matrix_mut(&mut self) -> &mut Sparse {
        &mut self.matrix
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
        Self(Sparse::zeros(Pattern::new(a.columns(), a.rows(), a.entries(), row)))
    }

    /// Computes the values.
    pub fn fill(&mut self, a: &Sparse, b: &Sparse, c: &Sparse) -> &Sparse {
        let Sparse { pattern, value } = &mut self.0;
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
