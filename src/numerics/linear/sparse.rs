//! Sparse matrices in rows, filled by lists of entries and multiplied in fixed patterns.
//!
//! Who assembles a matrix names its entries in an order that depends on the mesh alone. The first
//! time their places are looked up ([`Assembly::new`]); from then on values are added without a
//! search or an allocation.

use crate::num::index;
use crate::parallel;

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
}

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
        }
    }
}

/// A matrix that is filled from a list of entries.
#[derive(Debug, Clone, Default)]
pub struct Assembly {
    place: Vec<u32>,
    matrix: Sparse,
}

impl Assembly {
    /// Looks up the places of the entries that `name` gives.
    #[must_use]
    pub fn new(rows: usize, columns: usize, name: impl FnOnce(&mut Entries<'_>)) -> Self {
        let mut all = Vec::new();
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
        Self { place, matrix }
    }

    /// Fills the matrix with the values that `name` gives, in the same order as at first.
    pub fn fill(&mut self, name: impl FnOnce(&mut Entries<'_>)) {
        self.matrix.value.fill(0.0);
        let value = &mut self.matrix.value;
        name(&mut Entries(Mode::Fill { place: self.place.iter(), value }));
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
        let mut work = vec![0.0; *columns];
        for i in 0..a.rows() {
            for (j, value) in a.row(i) {
                work[j] += value;
            }
            for (k, factor) in b.row(i) {
                for (j, value) in c.row(k) {
                    work[j] += factor * value;
                }
            }
            for k in start[i]..start[i + 1] {
                value[k] = std::mem::take(&mut work[column[k] as usize]);
            }
        }
        &self.0
    }

    /// The matrix.
    #[must_use]
    pub fn matrix(&self) -> &Sparse {
        &self.0
    }
}
