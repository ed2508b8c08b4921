//! Sparse matrices in rows, filled by lists of entries and multiplied in fixed patterns.
//!
//! Who assembles a matrix names its entries in an order that depends on the mesh alone. The first
//! time their places are looked up ([`Assembly::new`]); from then on values are added without a
//! search or an allocation.

use std::ops::Range;

use rayon::prelude::*;

use crate::num::index;
use crate::parallel;

/// Parts of a product that are computed side by side.
const PARTS: usize = 16;

/// A matrix by rows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Sparse {
    columns: usize,
    start: Vec<usize>,
    column: Vec<u32>,
    value: Vec<f64>,
}

impl Sparse {
    /// A zero matrix with these columns in every row, each ascending.
    fn from_rows(columns: usize, rows: impl Iterator<Item = Vec<u32>>) -> Self {
        let mut matrix = Self { columns, start: vec![0], ..Self::default() };
        for row in rows {
            matrix.column.extend_from_slice(&row);
            matrix.start.push(matrix.column.len());
        }
        matrix.value = vec![0.0; matrix.column.len()];
        matrix
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    /// Number of columns.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of entries in the pattern.
    #[must_use]
    pub fn entries(&self) -> usize {
        self.column.len()
    }

    /// Columns of row `i`, ascending.
    #[must_use]
    pub fn pattern(&self, i: usize) -> &[u32] {
        &self.column[self.start[i]..self.start[i + 1]]
    }

    /// Columns and values of row `i`.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.start[i]..self.start[i + 1];
        self.column[range.clone()]
            .iter()
            .map(|&j| j as usize)
            .zip(self.value[range].iter().copied())
    }

    /// The values, row by row.
    #[must_use]
    pub fn values(&self) -> &[f64] {
        &self.value
    }

    /// Multiplies every row by a number.
    pub fn scale_rows(&mut self, by: &[f64]) {
        for (i, by) in by.iter().enumerate() {
            self.value[self.start[i]..self.start[i + 1]].iter_mut().for_each(|v| *v *= by);
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
        let mut start = vec![0usize; self.columns + 1];
        for &j in &self.column {
            start[j as usize + 1] += 1;
        }
        for j in 0..self.columns {
            start[j + 1] += start[j];
        }
        let mut next = start.clone();
        let mut row = vec![0usize; self.entries()];
        let mut place = vec![0u32; self.entries()];
        for i in 0..self.rows() {
            for k in self.start[i]..self.start[i + 1] {
                let at = &mut next[self.column[k] as usize];
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
        let mut of_row: Vec<Vec<u32>> = vec![Vec::new(); rows];
        for &(row, column) in &all {
            of_row[row as usize].push(column);
        }
        for columns in &mut of_row {
            columns.sort_unstable();
            columns.dedup();
        }
        let matrix = Sparse::from_rows(columns, of_row.into_iter());
        let mut place = vec![0; all.len()];
        parallel::fill(&mut place, |k| {
            let (row, column) = all[k];
            let row = row as usize;
            let found = matrix.pattern(row).binary_search(&column).unwrap_or_default();
            index(matrix.start[row] + found)
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
}

/// `A + B C` in a fixed pattern.
#[derive(Debug, Clone, Default)]
pub struct SumOfProduct(Sparse);

impl SumOfProduct {
    /// Makes the pattern.
    #[must_use]
    pub fn new(a: &Sparse, b: &Sparse, c: &Sparse) -> Self {
        let mut seen = vec![false; a.columns];
        Self(Sparse::from_rows(
            a.columns,
            (0..a.rows()).map(|i| {
                let mut row = a.pattern(i).to_vec();
                row.iter().for_each(|&j| seen[j as usize] = true);
                for &k in b.pattern(i) {
                    for &j in c.pattern(k as usize) {
                        if !std::mem::replace(&mut seen[j as usize], true) {
                            row.push(j);
                        }
                    }
                }
                row.sort_unstable();
                row.iter().for_each(|&j| seen[j as usize] = false);
                row
            }),
        ))
    }

    /// Computes the values.
    pub fn fill(&mut self, a: &Sparse, b: &Sparse, c: &Sparse) -> &Sparse {
        let Sparse { start, column, value, columns } = &mut self.0;
        let fill = |rows: Range<usize>, value: &mut [f64]| {
            let mut work = vec![0.0; *columns];
            let first = start[rows.start];
            for i in rows {
                for (j, value) in a.row(i) {
                    work[j] += value;
                }
                for (k, factor) in b.row(i) {
                    for (j, value) in c.row(k) {
                        work[j] += factor * value;
                    }
                }
                for k in start[i]..start[i + 1] {
                    value[k - first] = std::mem::take(&mut work[column[k] as usize]);
                }
            }
        };
        // Few parts: each needs a row of its own to work in.
        let step = a.rows().div_ceil(PARTS).max(1);
        let (mut parts, mut rest) = (Vec::new(), value.as_mut_slice());
        for begin in (0..a.rows()).step_by(step) {
            let end = (begin + step).min(a.rows());
            let (part, tail) = rest.split_at_mut(start[end] - start[begin]);
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
}
