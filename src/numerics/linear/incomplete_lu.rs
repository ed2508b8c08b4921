//! An incomplete LU factor without fill: ILU(0) by rows on the pattern of the matrix. Source: Saad,
//! *Iterative Methods for Sparse Linear Systems* (2003), algorithm 10.4.
//!
//! Rows are divided by the sizes of their diagonals, and in the order of [`Strips`].

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::LinearError;
use super::row_pattern::Pattern;
use super::shifted::ShiftedJacobian;
use super::sparse::Sparse;
use super::strips::{Block, Strips};
use crate::num::{index, single};
use crate::parallel;

/// The factor: strips of rows in parallel, then the seams. What it errs by in single precision is nothing beside
/// the fill that it leaves out.
pub(super) struct IncompleteLu {
    /// First unknown that it is of: it is the factor of the block from there on.
    first: usize,
    /// The order of its rows, and columns of whole rows, ascending, each with its diagonal. Shared with a
    /// matrix in this order.
    strips: Arc<Strips>,
    pattern: Arc<Pattern>,
    /// Where diagonals are.
    diagonal: Vec<u32>,
    /// Their values; on the diagonal inverse pivots.
    value: Vec<f32>,
    /// What the rows of the matrix are divided by: the sizes of their diagonals.
    row_scale: Vec<f64>,
}

/// The rows that one thread works on, with their values and scales.
struct Part<'a> {
    rows: Range<usize>,
    value: &'a mut [f32],
    row_scale: &'a mut [f64],
}

/// Numbers of a row on one side of the diagonal, with their columns.
type Half<'a> = (&'a [u32], &'a [f32]);

/// All numbers, as loops over rows read them.
#[derive(Clone, Copy)]
struct Rows<'a> {
    start: &'a [u32],
    column: &'a [u32],
    diagonal: &'a [u32],
    value: &'a [f32],
}

impl<'a> Rows<'a> {
    #[inline]
    fn slice(self, places: Range<u32>) -> Half<'a> {
        let places = places.start as usize..places.end as usize;
        (&self.column[places.clone()], &self.value[places])
    }

    #[inline]
    fn lower(self, i: usize) -> Half<'a> {
        self.slice(self.start[i]..self.diagonal[i])
    }

    #[inline]
    fn upper(self, i: usize) -> Half<'a> {
        self.slice(self.diagonal[i] + 1..self.start[i + 1])
    }

    #[inline]
    fn inverse_pivot(self, i: usize) -> f64 {
        self.value[self.diagonal[i] as usize].into()
    }
}

impl IncompleteLu {
    /// For matrices with this pattern, of which it is a factor of the block from the unknown `first` on.
    pub(super) fn new(matrix: &Sparse, first: usize) -> Self {
        let block = Block { pattern: matrix.pattern(), first };
        let (strips, pattern) = match &matrix.strips {
            Some(strips) => (Arc::clone(strips), Arc::clone(matrix.pattern())),
            None => {
                let strips = Strips::new(block);
                let pattern = strips.reorder(block);
                (Arc::new(strips), Arc::new(pattern))
            }
        };
        let left = |i: usize| pattern.row(i).partition_point(|&j| (j as usize) < i);
        let diagonal = (0..pattern.rows()).map(|i| index(pattern.places(i).start + left(i)));
        let diagonal = diagonal.collect();
        let (value, row_scale) = (vec![0.0; pattern.entry_count()], vec![1.0; pattern.rows()]);
        Self { first, strips, pattern, diagonal, value, row_scale }
    }

    /// Number of rows.
    pub(super) fn len(&self) -> usize {
        self.pattern.rows()
    }

    /// Number of entries, diagonals included.
    pub(super) fn entry_count(&self) -> usize {
        self.pattern.entry_count()
    }

    #[inline]
    fn begin(&self, i: usize) -> usize {
        self.pattern.start[i] as usize
    }

    /// Places of row `i` among all entries.
    #[inline]
    pub(super) fn places(&self, i: usize) -> Range<usize> {
        self.begin(i)..self.begin(i + 1)
    }

    /// Columns at these places.
    #[inline]
    pub(super) fn columns(&self, places: Range<usize>) -> &[u32] {
        &self.pattern.column[places]
    }

    /// The values, row by row: those of the matrix once it is loaded, then those of its factor.
    pub(super) fn values(&self) -> &[f32] {
        &self.value
    }

    #[inline]
    fn rows(&self) -> Rows<'_> {
        let Pattern { start, column, .. } = &*self.pattern;
        Rows { start, column, diagonal: &self.diagonal, value: &self.value }
    }

    /// Does `what` with ranges of rows in parallel, the seams after the strips, and lets it look up the values of
    /// the strips; the first that fails counts.
    fn for_each_part(
        &mut self,
        what: impl Fn(&Self, Part<'_>, &[f32]) -> Result<(), LinearError> + Sync,
    ) -> Result<(), LinearError> {
        let mut value = std::mem::take(&mut self.value);
        let mut row_scale = std::mem::take(&mut self.row_scale);
        let inner = self.strips.strips.last().map_or(0, |strip| strip.end);
        let (strips, seams) = value.split_at_mut(self.begin(inner));
        let (scale_strips, scale_seams) = row_scale.split_at_mut(inner);
        let run = |parts: Vec<Part<'_>>, known: &[f32]| {
            let done: Vec<Result<(), LinearError>> =
                parts.into_par_iter().map(|part| what(self, part, known)).collect();
            done.into_iter().collect::<Result<(), LinearError>>()
        };
        let done = run(self.cut(&self.strips.strips, strips, scale_strips), &[])
            .and_then(|()| run(self.cut(&self.strips.seams, seams, scale_seams), strips));
        (self.value, self.row_scale) = (value, row_scale);
        done
    }

    /// Cuts numbers into those of each range of rows.
    fn cut<'a>(
        &self,
        ranges: &[Range<usize>],
        mut value: &'a mut [f32],
        mut row_scale: &'a mut [f64],
    ) -> Vec<Part<'a>> {
        let mut parts = Vec::with_capacity(ranges.len());
        for rows in ranges {
            let (own, rest) = value.split_at_mut(self.begin(rows.end) - self.begin(rows.start));
            let (scales, others) = row_scale.split_at_mut(rows.len());
            parts.push(Part { rows: rows.clone(), value: own, row_scale: scales });
            (value, row_scale) = (rest, others);
        }
        parts
    }

    /// Takes over the values of a matrix of the pattern.
    pub(super) fn load(&mut self, matrix: ShiftedJacobian<'_>) {
        let in_strips = matrix.jacobian().strips.is_some();
        let loaded = self.for_each_part(|factor, part, _| {
            let Part { rows, value, row_scale } = part;
            let from = factor.begin(rows.start);
            value.fill(0.0);
            for i in rows.clone() {
                // A matrix in strips has the same rows with the same entries.
                let unknown = factor.first + factor.strips.order[i] as usize;
                let row = if in_strips { i } else { unknown };
                let divisor = matrix.diagonal_scale(row);
                row_scale[i - rows.start] = divisor;
                let own = &mut value[factor.begin(i) - from..factor.begin(i + 1) - from];
                if in_strips {
                    let entries = matrix.row(i).map(|(_, entry)| single(entry / divisor));
                    own.iter_mut().zip(entries).for_each(|(own, entry)| *own = entry);
                    continue;
                }
                let columns = factor.columns(factor.places(i));
                for (j, entry) in matrix.row(row) {
                    let Some(j) = j.checked_sub(factor.first) else { continue };
                    let found = columns.binary_search(&factor.strips.row[j]).unwrap_or_default();
                    own[found] = single(entry / divisor);
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
        self.for_each_part(Self::eliminate_part)
    }

    fn eliminate_part(&self, part: Part<'_>, known: &[f32]) -> Result<(), LinearError> {
        let Part { rows, value, .. } = part;
        let from = self.begin(rows.start);
        let mut work: Vec<f64> = Vec::new();
        for i in rows.clone() {
            let places = self.places(i);
            let own = places.start - from..places.end - from;
            let left = self.diagonal[i] as usize - places.start;
            let columns = self.columns(places);
            work.clear();
            work.extend(value[own.clone()].iter().map(|v| f64::from(*v)));
            for k in 0..left {
                let j = columns[k] as usize;
                let above = self.diagonal[j] as usize..self.begin(j + 1);
                let values = match j < rows.start {
                    true => &known[above.clone()],
                    false => &value[above.start - from..above.end - from],
                };
                let Some((inverse, values)) = values.split_first() else { continue };
                let factor = work[k] * f64::from(*inverse);
                work[k] = factor;
                // Both rows ascend.
                let mut at = k + 1;
                let others = self.columns(above.start + 1..above.end);
                for (&column, value) in others.iter().zip(values) {
                    while at < columns.len() && columns[at] < column {
                        at += 1;
                    }
                    if at < columns.len() && columns[at] == column {
                        work[at] -= factor * f64::from(*value);
                    }
                }
            }
            let found = work[left];
            if found == 0.0 || !single(found.recip()).is_finite() || !found.is_finite() {
                return Err(LinearError::new(format!(
                    "the incomplete factor of the Newton matrix has the pivot {found} in row {i}"
                )));
            }
            work[left] = found.recip();
            value[own].iter_mut().zip(&work).for_each(|(value, work)| *value = single(*work));
        }
        Ok(())
    }

    /// Writes a right-hand side in the order and the units of the rows.
    pub(super) fn rhs_to_rows(&self, x: &[f64], rows: &mut [f64]) {
        parallel::fill(rows, |i| x[self.strips.order[i] as usize] / self.row_scale[i]);
    }

    /// Writes a solution in the order of the unknowns.
    pub(super) fn rows_to_unknowns(&self, rows: &[f64], x: &mut [f64]) {
        parallel::fill(x, |unknown| rows[self.strips.row[unknown] as usize]);
    }

    /// Applies the inverse of the factor to rows in their own order and units. What was computed last comes last in
    /// every sum, so that all else of it can be done before.
    pub(super) fn substitute(&self, x: &mut [f64]) {
        let inner = self.strips.strips.last().map_or(0, |strip| strip.end);
        let (strips, seams) = x.split_at_mut(inner);
        let all = self.rows();
        parts(&self.strips.strips, strips).into_par_iter().for_each(|(rows, x)| {
            for i in rows.clone() {
                let (columns, values) = all.lower(i);
                let known = values.iter().zip(columns);
                let known = known.map(|(v, &j)| f64::from(*v) * x[j as usize - rows.start]);
                x[i - rows.start] = known.fold(x[i - rows.start], |rest, known| rest - known);
            }
        });
        parts(&self.strips.seams, seams).into_par_iter().for_each(|(rows, x)| {
            for i in rows.clone() {
                let (columns, values) = all.lower(i);
                let known = values.iter().zip(columns).map(|(v, &j)| match j as usize {
                    j if j < inner => f64::from(*v) * strips[j],
                    j => f64::from(*v) * x[j - rows.start],
                });
                x[i - rows.start] = known.fold(x[i - rows.start], |rest, known| rest - known);
            }
            for i in rows.clone().rev() {
                let (columns, values) = all.upper(i);
                let known = values.iter().zip(columns).rev();
                let known = known.map(|(v, &j)| f64::from(*v) * x[j as usize - rows.start]);
                let rest = known.fold(x[i - rows.start], |rest, known| rest - known);
                x[i - rows.start] = rest * all.inverse_pivot(i);
            }
        });
        parts(&self.strips.strips, strips).into_par_iter().for_each(|(rows, x)| {
            for i in rows.clone().rev() {
                let (columns, values) = all.upper(i);
                let known = values.iter().zip(columns).rev().map(|(v, &j)| match j as usize {
                    j if j < inner => f64::from(*v) * x[j - rows.start],
                    j => f64::from(*v) * seams[j - inner],
                });
                let rest = known.fold(x[i - rows.start], |rest, known| rest - known);
                x[i - rows.start] = rest * all.inverse_pivot(i);
            }
        });
    }

    /// Writes the product of `v` with the matrix of these values in the rows.
    pub(super) fn multiply(&self, value: &[f32], v: &[f64], out: &mut [f64]) {
        let all = Rows { value, ..self.rows() };
        parallel::fill(out, |i| {
            let (columns, values) = all.slice(all.start[i]..all.start[i + 1]);
            values.iter().zip(columns).map(|(value, &j)| f64::from(*value) * v[j as usize]).sum()
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
