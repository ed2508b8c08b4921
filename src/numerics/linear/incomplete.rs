//! An incomplete LU factor without fill: ILU(0) by rows on the pattern of the matrix. Source: Saad,
//! *Iterative Methods for Sparse Linear Systems* (2003), algorithm 10.4.
//!
//! Rows are divided by the sizes of their diagonals, and in the order of [`Strips`].

use std::ops::Range;

use rayon::prelude::*;

use super::LinearError;
use super::shifted::Difference;
use super::sparse::Sparse;
use super::strips::{Block, Strips};
use crate::num::index;
use crate::parallel;

/// What lies on one side of the diagonal, row by row.
pub(super) struct Triangle {
    start: Vec<u32>,
    column: Vec<u32>,
    value: Vec<f64>,
}

impl Triangle {
    fn with_capacity(rows: usize, entries: usize) -> Self {
        let mut start = Vec::with_capacity(rows + 1);
        start.push(0);
        Self { start, column: Vec::with_capacity(entries), value: Vec::new() }
    }

    fn push_row(&mut self, columns: &[u32]) {
        self.column.extend_from_slice(columns);
        self.start.push(index(self.column.len()));
    }

    #[inline]
    fn first(&self, i: usize) -> usize {
        self.start[i] as usize
    }

    #[inline]
    fn places(&self, i: usize) -> Range<usize> {
        self.first(i)..self.first(i + 1)
    }

    #[inline]
    fn columns(&self, i: usize) -> &[u32] {
        &self.column[self.places(i)]
    }

    /// Columns and values of row `i`.
    #[inline]
    pub(super) fn row(&self, i: usize) -> (&[u32], &[f64]) {
        let places = self.places(i);
        (&self.column[places.clone()], &self.value[places])
    }
}

/// The factor: strips of rows in parallel, then the seams.
pub(super) struct Incomplete {
    /// First unknown that it is of: it is the factor of the block from there on.
    first: usize,
    /// Unknown of every row, and row of every unknown, counted from the first.
    order: Vec<u32>,
    row: Vec<u32>,
    strips: Vec<Range<usize>>,
    seams: Vec<Range<usize>>,
    pub(super) lower: Triangle,
    pub(super) upper: Triangle,
    /// Diagonals, or inverse pivots.
    pub(super) pivot: Vec<f64>,
    /// Sizes of the diagonals of the matrix.
    size: Vec<f64>,
}

/// Rows on which one thread works: their own numbers, …
struct Part<'a> {
    rows: Range<usize>,
    lower: &'a mut [f64],
    upper: &'a mut [f64],
    pivot: &'a mut [f64],
    size: &'a mut [f64],
}

/// … and those of the strips, while seams are worked on.
struct Known<'a> {
    upper: &'a [f64],
    pivot: &'a [f64],
}

impl Incomplete {
    /// For matrices with this pattern, of which it is a factor of the block from the unknown `first` on.
    pub(super) fn new(matrix: &Sparse, first: usize) -> Self {
        let block = Block { pattern: matrix.pattern(), first };
        let Strips { order, strips, seams } = Strips::new(block);
        let n = order.len();
        let mut row = vec![0; n];
        for (rank, &unknown) in order.iter().enumerate() {
            row[unknown as usize] = index(rank);
        }
        let mut below = 0;
        for (i, &unknown) in order.iter().enumerate() {
            let columns = block.row(unknown as usize);
            below += columns.filter(|&j| (row[j] as usize) < i).count();
        }
        let entries: usize = (0..n).map(|unknown| block.row(unknown).count()).sum();
        let mut lower = Triangle::with_capacity(n, below);
        let mut upper = Triangle::with_capacity(n, entries - below);
        let mut columns: Vec<u32> = Vec::new();
        for (i, &unknown) in order.iter().enumerate() {
            columns.clear();
            columns.extend(block.row(unknown as usize).map(|j| row[j]));
            columns.sort_unstable();
            let middle = columns.partition_point(|&j| (j as usize) < i);
            lower.push_row(&columns[..middle]);
            let after = middle + usize::from(columns.get(middle) == Some(&index(i)));
            upper.push_row(&columns[after..]);
        }
        lower.value = vec![0.0; lower.column.len()];
        upper.value = vec![0.0; upper.column.len()];
        let (pivot, size) = (vec![0.0; n], vec![1.0; n]);
        Self { first, order, row, strips, seams, lower, upper, pivot, size }
    }

    /// Number of rows.
    pub(super) fn len(&self) -> usize {
        self.order.len()
    }

    /// Places of row `i` where all rows lie one after the other, each with its diagonal.
    #[inline]
    pub(super) fn places(&self, i: usize) -> Range<usize> {
        let first = |i: usize| self.lower.first(i) + i + self.upper.first(i);
        first(i)..first((i + 1).min(self.len()))
    }

    /// Does `what` with ranges of rows in parallel, the seams after the strips, and lets it look up what is
    /// known of the strips; the first that fails counts.
    fn each(
        &mut self,
        what: impl Fn(&Self, Part<'_>, &Known<'_>) -> Result<(), LinearError> + Sync,
    ) -> Result<(), LinearError> {
        let mut lower = std::mem::take(&mut self.lower.value);
        let mut upper = std::mem::take(&mut self.upper.value);
        let mut pivot = std::mem::take(&mut self.pivot);
        let mut size = std::mem::take(&mut self.size);
        let inner = self.strips.last().map_or(0, |strip| strip.end);
        let (lower_strips, lower_seams) = lower.split_at_mut(self.lower.first(inner));
        let (upper_strips, upper_seams) = upper.split_at_mut(self.upper.first(inner));
        let (pivot_strips, pivot_seams) = pivot.split_at_mut(inner);
        let (size_strips, size_seams) = size.split_at_mut(inner);
        let nothing = Known { upper: &[], pivot: &[] };
        let run = |parts: Vec<Part<'_>>, known: &Known<'_>| {
            let done: Vec<Result<(), LinearError>> =
                parts.into_par_iter().map(|part| what(self, part, known)).collect();
            done.into_iter().collect::<Result<(), LinearError>>()
        };
        let all = [&mut *lower_strips, &mut *upper_strips, &mut *pivot_strips, size_strips];
        let done = run(self.cut(&self.strips, all), &nothing).and_then(|()| {
            let known = Known { upper: upper_strips, pivot: pivot_strips };
            let all = [lower_seams, upper_seams, pivot_seams, size_seams];
            run(self.cut(&self.seams, all), &known)
        });
        (self.lower.value, self.upper.value) = (lower, upper);
        (self.pivot, self.size) = (pivot, size);
        done
    }

    /// Cuts numbers into those of each range of rows.
    fn cut<'a>(
        &self,
        ranges: &[Range<usize>],
        [mut lower, mut upper, mut pivot, mut size]: [&'a mut [f64]; 4],
    ) -> Vec<Part<'a>> {
        let mut parts = Vec::with_capacity(ranges.len());
        let take = |from: &mut &'a mut [f64], length: usize| -> &'a mut [f64] {
            let (part, rest) = std::mem::take(from).split_at_mut(length);
            *from = rest;
            part
        };
        for rows in ranges {
            let of = |t: &Triangle| t.first(rows.end) - t.first(rows.start);
            parts.push(Part {
                rows: rows.clone(),
                lower: take(&mut lower, of(&self.lower)),
                upper: take(&mut upper, of(&self.upper)),
                pivot: take(&mut pivot, rows.len()),
                size: take(&mut size, rows.len()),
            });
        }
        parts
    }

    /// Takes over the values of a matrix of the pattern.
    pub(super) fn load(&mut self, matrix: Difference<'_>) {
        let loaded = self.each(|factor, part, _| {
            let Part { rows, lower, upper, pivot, size } = part;
            let (lower_from, upper_from) =
                (factor.lower.first(rows.start), factor.upper.first(rows.start));
            for i in rows.clone() {
                let unknown = factor.first + factor.order[i] as usize;
                let divisor = matrix.size(unknown);
                size[i - rows.start] = divisor;
                pivot[i - rows.start] = 0.0;
                for (j, value) in matrix.row(unknown) {
                    let Some(j) = j.checked_sub(factor.first) else { continue };
                    let (j, value) = (factor.row[j], value / divisor);
                    let place = |side: &Triangle| {
                        let found = side.columns(i).binary_search(&j).unwrap_or_default();
                        side.first(i) + found
                    };
                    match (j as usize).cmp(&i) {
                        std::cmp::Ordering::Less => {
                            lower[place(&factor.lower) - lower_from] = value
                        }
                        std::cmp::Ordering::Equal => pivot[i - rows.start] = value,
                        std::cmp::Ordering::Greater => {
                            upper[place(&factor.upper) - upper_from] = value;
                        }
                    }
                }
            }
            Ok(())
        });
        debug_assert!(loaded.is_ok());
    }

    /// Turns the matrix that was loaded into its incomplete factor.
    ///
    /// # Errors
    /// [`LinearError`] where a pivot vanishes or is not finite.
    pub(super) fn eliminate(&mut self) -> Result<(), LinearError> {
        self.each(Self::eliminate_part)
    }

    fn eliminate_part(&self, part: Part<'_>, known: &Known<'_>) -> Result<(), LinearError> {
        let Part { rows, lower, upper, pivot, .. } = part;
        let (lower_from, upper_from) = (self.lower.first(rows.start), self.upper.first(rows.start));
        let (mut columns, mut work): (Vec<u32>, Vec<f64>) = (Vec::new(), Vec::new());
        for i in rows.clone() {
            let left = self.lower.places(i).len();
            let own_lower = self.lower.first(i) - lower_from..self.lower.first(i + 1) - lower_from;
            let own_upper = self.upper.first(i) - upper_from..self.upper.first(i + 1) - upper_from;
            columns.clear();
            columns.extend_from_slice(self.lower.columns(i));
            columns.push(index(i));
            columns.extend_from_slice(self.upper.columns(i));
            work.clear();
            work.extend_from_slice(&lower[own_lower.clone()]);
            work.push(pivot[i - rows.start]);
            work.extend_from_slice(&upper[own_upper.clone()]);
            for k in 0..left {
                let j = columns[k] as usize;
                let places = self.upper.places(j);
                let (inverse, values) = if j < rows.start {
                    (known.pivot[j], &known.upper[places])
                } else {
                    let own = places.start - upper_from..places.end - upper_from;
                    (pivot[j - rows.start], &upper[own])
                };
                let factor = work[k] * inverse;
                work[k] = factor;
                // Both rows ascend.
                let mut at = k + 1;
                for (&column, value) in self.upper.columns(j).iter().zip(values) {
                    while at < columns.len() && columns[at] < column {
                        at += 1;
                    }
                    if at < columns.len() && columns[at] == column {
                        work[at] -= factor * value;
                    }
                }
            }
            let found = work[left];
            if found == 0.0 || !found.is_finite() {
                return Err(LinearError::new(format!(
                    "the incomplete factor of the Newton matrix has the pivot {found} in row {i}"
                )));
            }
            pivot[i - rows.start] = found.recip();
            lower[own_lower].copy_from_slice(&work[..left]);
            upper[own_upper].copy_from_slice(&work[left + 1..]);
        }
        Ok(())
    }

    /// Writes a right-hand side in the order and the units of the rows.
    pub(super) fn take(&self, x: &[f64], rows: &mut [f64]) {
        parallel::fill(rows, |i| x[self.order[i] as usize] / self.size[i]);
    }

    /// Writes a solution in the order of the unknowns.
    pub(super) fn give(&self, rows: &[f64], x: &mut [f64]) {
        parallel::fill(x, |unknown| rows[self.row[unknown] as usize]);
    }

    /// Applies the inverse of the factor to rows in their own order and units.
    pub(super) fn substitute(&self, x: &mut [f64]) {
        let inner = self.strips.last().map_or(0, |strip| strip.end);
        let (strips, seams) = x.split_at_mut(inner);
        parts(&self.strips, strips).into_par_iter().for_each(|(rows, x)| {
            for i in rows.clone() {
                let (columns, values) = self.lower.row(i);
                let known =
                    values.iter().zip(columns).map(|(v, &j)| v * x[j as usize - rows.start]);
                x[i - rows.start] -= known.sum::<f64>();
            }
        });
        parts(&self.seams, seams).into_par_iter().for_each(|(rows, x)| {
            for i in rows.clone() {
                let (columns, values) = self.lower.row(i);
                let known = values.iter().zip(columns).map(|(v, &j)| match j as usize {
                    j if j < inner => v * strips[j],
                    j => v * x[j - rows.start],
                });
                x[i - rows.start] -= known.sum::<f64>();
            }
            for i in rows.clone().rev() {
                let (columns, values) = self.upper.row(i);
                let known =
                    values.iter().zip(columns).map(|(v, &j)| v * x[j as usize - rows.start]);
                x[i - rows.start] = (x[i - rows.start] - known.sum::<f64>()) * self.pivot[i];
            }
        });
        parts(&self.strips, strips).into_par_iter().for_each(|(rows, x)| {
            for i in rows.clone().rev() {
                let (columns, values) = self.upper.row(i);
                let known = values.iter().zip(columns).map(|(v, &j)| match j as usize {
                    j if j < inner => v * x[j - rows.start],
                    j => v * seams[j - inner],
                });
                x[i - rows.start] = (x[i - rows.start] - known.sum::<f64>()) * self.pivot[i];
            }
        });
    }
}

/// The rows of every range, which lie one after the other.
fn parts<'a>(ranges: &[Range<usize>], mut x: &'a mut [f64]) -> Vec<(Range<usize>, &'a mut [f64])> {
    let mut all = Vec::with_capacity(ranges.len());
    for range in ranges {
        let (part, rest) = x.split_at_mut(range.len());
        all.push((range.clone(), part));
        x = rest;
    }
    all
}
