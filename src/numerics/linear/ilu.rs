//! An incomplete LU factor without fill, for matrices that diffusion dominates: ILU(0) by rows on the
//! pattern of the matrix. Source: Saad, *Iterative Methods for Sparse Linear Systems* (2003),
//! algorithm 10.4.

use std::ops::Range;

use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use rayon::prelude::*;

use super::LinearError;
use super::gmres::Krylov;
use super::rows::ScaledRows;
use super::strips::Strips;
use crate::num::index;

/// An incomplete factor, and the matrix in the same rows; strips of them in parallel, then the seams.
pub struct Ilu {
    rows: ScaledRows,
    strips: Vec<Range<usize>>,
    seams: Vec<Range<usize>>,
    lower: Triangle,
    upper: Triangle,
    /// Inverse pivots.
    inverse: Vec<f64>,
    pub(super) krylov: Krylov,
    work: Vec<f64>,
}

/// What lies on one side of the diagonal, row by row.
struct Triangle {
    start: Vec<usize>,
    column: Vec<u32>,
    value: Vec<f64>,
}

impl Triangle {
    /// Of the entries in the columns that `belongs` says.
    fn new(rows: &ScaledRows, belongs: impl Fn(usize, usize) -> bool) -> Self {
        let (mut start, mut column) = (vec![0], Vec::new());
        for i in 0..rows.len() {
            let all = rows.columns()[rows.places(i)].iter();
            column.extend(all.filter(|&&j| belongs(i, j as usize)));
            start.push(column.len());
        }
        Self { start, value: vec![0.0; column.len()], column }
    }

    fn row(&self, i: usize) -> (&[u32], &[f64]) {
        let places = self.start[i]..self.start[i + 1];
        (&self.column[places.clone()], &self.value[places])
    }

    /// Cuts the values into those of each range of rows.
    fn cut<'a>(&self, ranges: &[Range<usize>], mut value: &'a mut [f64]) -> Vec<&'a mut [f64]> {
        let mut parts = Vec::with_capacity(ranges.len());
        for range in ranges {
            let (part, rest) = value.split_at_mut(self.start[range.end] - self.start[range.start]);
            parts.push(part);
            value = rest;
        }
        parts
    }
}

/// The factor as far as it is known: of the rows of strips, while seams are worked on.
struct Known<'a> {
    upper: &'a [f64],
    inverse: &'a [f64],
}

/// A range of rows that is being factorised.
struct Part<'a> {
    rows: Range<usize>,
    lower: &'a mut [f64],
    upper: &'a mut [f64],
    inverse: &'a mut [f64],
}

impl Ilu {
    /// For matrices of this pattern.
    #[must_use]
    pub fn new(pattern: SymbolicSparseColMatRef<'_, usize>) -> Self {
        let Strips { order, strips, seams } = Strips::new(pattern);
        let rows = ScaledRows::new(pattern, order);
        let n = rows.len();
        Self {
            lower: Triangle::new(&rows, |i, j| j < i),
            upper: Triangle::new(&rows, |i, j| j > i),
            inverse: vec![0.0; n],
            krylov: Krylov::default(),
            work: vec![0.0; n],
            rows,
            strips,
            seams,
        }
    }

    /// Computes the incomplete factor of a matrix of the pattern.
    ///
    /// # Errors
    /// [`LinearError`] where a pivot vanishes or is not finite.
    pub fn factorise(
        &mut self,
        matrix: SparseColMatRef<'_, usize, f64>,
    ) -> Result<(), LinearError> {
        self.rows.load(matrix);
        let mut lower = std::mem::take(&mut self.lower.value);
        let mut upper = std::mem::take(&mut self.upper.value);
        let mut inverse = std::mem::take(&mut self.inverse);
        let result = self.factorise_into(&mut lower, &mut upper, &mut inverse);
        (self.lower.value, self.upper.value, self.inverse) = (lower, upper, inverse);
        result
    }

    fn factorise_into(
        &self,
        lower: &mut [f64],
        upper: &mut [f64],
        inverse: &mut [f64],
    ) -> Result<(), LinearError> {
        let inner = self.strips.last().map_or(0, |strip| strip.end);
        let (lower, lower_seams) = lower.split_at_mut(self.lower.start[inner]);
        let (upper, upper_seams) = upper.split_at_mut(self.upper.start[inner]);
        let (inverse, inverse_seams) = inverse.split_at_mut(inner);
        let nothing = Known { upper: &[], inverse: &[] };
        self.each(&self.strips, [&mut *lower, &mut *upper, &mut *inverse], &nothing)?;
        self.each(&self.seams, [lower_seams, upper_seams, inverse_seams], &Known { upper, inverse })
    }

    /// Factorises ranges of rows in parallel; the first that fails counts.
    fn each(
        &self,
        ranges: &[Range<usize>],
        [lower, upper, inverse]: [&mut [f64]; 3],
        known: &Known<'_>,
    ) -> Result<(), LinearError> {
        let lower = self.lower.cut(ranges, lower);
        let upper = self.upper.cut(ranges, upper);
        let mut rest = inverse;
        let mut parts = Vec::with_capacity(ranges.len());
        for ((rows, lower), upper) in ranges.iter().zip(lower).zip(upper) {
            let (inverse, tail) = rest.split_at_mut(rows.len());
            rest = tail;
            parts.push(Part { rows: rows.clone(), lower, upper, inverse });
        }
        let done: Vec<Result<(), LinearError>> =
            parts.into_par_iter().map(|part| self.eliminate(part, known)).collect();
        done.into_iter().collect()
    }

    fn eliminate(&self, part: Part<'_>, known: &Known<'_>) -> Result<(), LinearError> {
        let Part { rows: range, lower, upper, inverse } = part;
        let (lower_from, upper_from) =
            (self.lower.start[range.start], self.upper.start[range.start]);
        let mut work: Vec<f64> = Vec::new();
        for i in range.clone() {
            let places = self.rows.places(i);
            let columns = &self.rows.columns()[places.clone()];
            work.clear();
            work.extend_from_slice(&self.rows.values()[places]);
            let left = self.lower.start[i + 1] - self.lower.start[i];
            for k in 0..left {
                let j = columns[k] as usize;
                let pivots = self.upper.start[j]..self.upper.start[j + 1];
                let (pivot, values) = if j < range.start {
                    (known.inverse[j], &known.upper[pivots.clone()])
                } else {
                    let own = pivots.start - upper_from..pivots.end - upper_from;
                    (inverse[j - range.start], &upper[own])
                };
                let factor = work[k] * pivot;
                work[k] = factor;
                // Both rows ascend.
                let mut at = k + 1;
                for (&column, value) in self.upper.column[pivots].iter().zip(values) {
                    while at < columns.len() && columns[at] < column {
                        at += 1;
                    }
                    if at < columns.len() && columns[at] == column {
                        work[at] -= factor * value;
                    }
                }
            }
            let has_diagonal = columns.get(left) == Some(&index(i));
            let pivot = if has_diagonal { work[left] } else { 0.0 };
            if pivot == 0.0 || !pivot.is_finite() {
                return Err(LinearError::new(format!(
                    "the incomplete factor of the Newton matrix has the pivot {pivot} in row {i}"
                )));
            }
            inverse[i - range.start] = pivot.recip();
            let at = self.lower.start[i] - lower_from;
            lower[at..at + left].copy_from_slice(&work[..left]);
            let at = self.upper.start[i] - upper_from;
            upper[at..at + work.len() - left - 1].copy_from_slice(&work[left + 1..]);
        }
        Ok(())
    }

    /// Applies the inverse of the factor in place.
    pub(super) fn precondition(&mut self, x: &mut [f64]) {
        let mut work = std::mem::take(&mut self.work);
        self.rows.take(x, &mut work);
        self.substitute(&mut work);
        self.rows.give(&work, x);
        self.work = work;
    }

    /// Applies the inverse of the factor to rows in their own order and units.
    fn substitute(&self, x: &mut [f64]) {
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
                x[i - rows.start] = (x[i - rows.start] - known.sum::<f64>()) * self.inverse[i];
            }
        });
        parts(&self.strips, strips).into_par_iter().for_each(|(rows, x)| {
            for i in rows.clone().rev() {
                let (columns, values) = self.upper.row(i);
                let known = values.iter().zip(columns).map(|(v, &j)| match j as usize {
                    j if j < inner => v * x[j - rows.start],
                    j => v * seams[j - inner],
                });
                x[i - rows.start] = (x[i - rows.start] - known.sum::<f64>()) * self.inverse[i];
            }
        });
    }

    /// Solves in place with the last matrix factorised.
    ///
    /// # Errors
    /// [`LinearError`] if the iteration does not converge.
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        let mut krylov = std::mem::take(&mut self.krylov);
        let mut right = std::mem::take(&mut self.work);
        self.rows.take(x, &mut right);
        let product = |v: &[f64], out: &mut [f64]| self.rows.multiply(v, out);
        let result = krylov.solve(product, |v| self.substitute(v), &mut right);
        if result.is_ok() {
            self.rows.give(&right, x);
        }
        (self.krylov, self.work) = (krylov, right);
        result
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
