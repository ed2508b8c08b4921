//! What every factorisation of block matrices of one pattern shares: the order of elimination, the
//! symbolic factorisation, and the matrix in the layout that faer reads.
//!
//! The ordering is nested dissection on the graph of the vertices (not of the three times as many
//! unknowns), found once for a pattern.

use std::sync::Arc;

use faer::Side;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use feral_metis::{CscPattern, metis_order};

use super::LinearError;
use super::{BlockMatrix, BlockPattern};
use crate::num::index;

/// Numbers of a factor.
pub trait Precision: faer::traits::RealField + Copy {
    /// Rounded from double precision.
    fn of(value: f64) -> Self;

    /// In double precision.
    fn number(self) -> f64;
}

impl Precision for f64 {
    fn of(value: f64) -> Self {
        value
    }

    fn number(self) -> f64 {
        self
    }
}

impl Precision for f32 {
    #[expect(clippy::cast_possible_truncation, reason = "rounding is what is wanted")]
    fn of(value: f64) -> Self {
        value as Self
    }

    fn number(self) -> f64 {
        self.into()
    }
}

/// A pattern, ordered and analysed, with room for the values of one matrix.
pub(super) struct Analysis<T: Precision = f64> {
    pattern: Arc<BlockPattern>,
    symbolic: SymbolicCholesky<u32>,
    column_start: Vec<u32>,
    row_index: Vec<u32>,
    value: Vec<T>,
}

impl<T: Precision> Analysis<T> {
    /// Orders and analyses `pattern`.
    ///
    /// # Errors
    /// [`LinearError`] if the pattern is too large for the index type or for memory.
    pub(super) fn new(
        pattern: Arc<BlockPattern>,
        parameters: CholeskySymbolicParams<'_>,
    ) -> Result<Self, LinearError> {
        let n = 3 * pattern.rows();
        let order = nested_dissection(&pattern)?;
        let mut forward = vec![0u32; n];
        let mut inverse = vec![0u32; n];
        for (new, &old) in order.iter().enumerate() {
            for a in 0..3 {
                forward[3 * new + a] = 3 * old + index(a);
                inverse[3 * old as usize + a] = index(3 * new + a);
            }
        }
        let (column_start, row_index) = lower_triangle(&pattern);
        let layout = SymbolicSparseColMatRef::new_checked(n, n, &column_start, None, &row_index);
        let symbolic = factorize_symbolic_cholesky(
            layout,
            Side::Lower,
            SymmetricOrdering::Custom(PermRef::new_checked(&forward, &inverse, n)),
            parameters,
        )
        .map_err(|e| LinearError::new(format!("symbolic factorisation of {n} unknowns: {e:?}")))?;
        let value = vec![T::of(0.0); row_index.len()];
        Ok(Self { pattern, symbolic, column_start, row_index, value })
    }

    /// The symbolic factorisation.
    pub(super) fn symbolic(&self) -> &SymbolicCholesky<u32> {
        &self.symbolic
    }

    /// Number of unknowns.
    pub(super) fn unknowns(&self) -> usize {
        3 * self.pattern.rows()
    }

    /// Takes over the values of `matrix`, which must have the pattern this was made for, times
    /// `scale`.
    pub(super) fn load(&mut self, matrix: &BlockMatrix, scale: f64) {
        let mut next = 0;
        for i in 0..self.pattern.rows() {
            let row = matrix.row(i);
            for a in 0..3 {
                for b in a..3 {
                    self.value[next] = T::of(scale * row[0][(a, b)]);
                    next += 1;
                }
                for block in &row[1..] {
                    for b in 0..3 {
                        self.value[next] = T::of(scale * block[(a, b)]);
                        next += 1;
                    }
                }
            }
        }
    }

    /// Adds `shift(i)` to the three diagonal entries of vertex i of the values taken over.
    pub(super) fn add_diagonal(&mut self, shift: impl Fn(usize) -> f64) {
        for i in 0..self.pattern.rows() {
            for a in 0..3 {
                let place = &mut self.value[self.column_start[3 * i + a] as usize];
                *place = T::of(place.number() + shift(i));
            }
        }
    }

    /// The values taken over, as the lower triangle in compressed columns.
    pub(super) fn matrix(&self) -> SparseColMatRef<'_, u32, T> {
        let n = self.unknowns();
        let layout =
            SymbolicSparseColMatRef::new_checked(n, n, &self.column_start, None, &self.row_index);
        SparseColMatRef::new(layout, &self.value)
    }
}

/// The error for memory that is not there.
pub(super) fn no_memory(what: &str, unknowns: usize) -> LinearError {
    LinearError::new(format!("not enough memory to {what} {unknowns} unknowns"))
}

/// Nested-dissection order of the vertices: position → vertex.
fn nested_dissection(pattern: &BlockPattern) -> Result<Vec<u32>, LinearError> {
    let n = pattern.rows();
    let failed = || LinearError::new(format!("no ordering for {n} vertices"));
    let mut neighbours: Vec<Vec<i32>> = vec![Vec::new(); n];
    for i in 0..n {
        for &j in pattern.row(i).iter().filter(|&&j| j as usize != i) {
            neighbours[i].push(i32::try_from(j).map_err(|_| failed())?);
            neighbours[j as usize].push(i32::try_from(i).map_err(|_| failed())?);
        }
    }
    let mut column_start = vec![0i32];
    let mut row_index = Vec::new();
    for list in &mut neighbours {
        list.sort_unstable();
        row_index.append(list);
        column_start.push(i32::try_from(row_index.len()).map_err(|_| failed())?);
    }
    let graph = CscPattern::new(n, &column_start, &row_index).ok_or_else(failed)?;
    let order = metis_order(&graph).map_err(|_| failed())?;
    order.into_iter().map(|v| u32::try_from(v).map_err(|_| failed())).collect()
}

/// Compressed columns of the lower triangle: column (i, a) is row (i, a) of the stored blocks.
fn lower_triangle(pattern: &BlockPattern) -> (Vec<u32>, Vec<u32>) {
    let mut column_start = vec![0u32];
    let mut row_index = Vec::new();
    for i in 0..pattern.rows() {
        for a in 0..3 {
            row_index.extend((a..3).map(|b| index(3 * i + b)));
            for &j in &pattern.row(i)[1..] {
                row_index.extend((0..3).map(|b| 3 * j + b));
            }
            column_start.push(index(row_index.len()));
        }
    }
    (column_start, row_index)
}
