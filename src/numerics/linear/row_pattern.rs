//! Which entries a matrix by rows has.

use std::ops::Range;

use super::symmetric_rows::split;
use crate::num::index;

/// Which entries a matrix by rows has.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pattern {
    pub(super) columns: usize,
    pub(super) start: Vec<u32>,
    pub(super) column: Vec<u32>,
}

impl Pattern {
    /// `row` writes each row into an empty list, columns ascending; `entries` is the capacity that is reserved.
    pub(super) fn new(
        columns: usize,
        rows: usize,
        entries: usize,
        row: &mut PatternRow<'_>,
    ) -> Self {
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
    pub fn entry_count(&self) -> usize {
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
pub(super) type PatternRow<'a> = dyn FnMut(usize, &mut Vec<u32>) + 'a;
