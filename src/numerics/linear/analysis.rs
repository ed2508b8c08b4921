//! What factorisations by faer of block matrices of one pattern share: the order of elimination, the
//! symbolic factorisation, and the matrix in the layout that faer reads.

use std::sync::Arc;

use faer::Side;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};

use super::LinearError;
use super::dissection::{Elimination, Graph};
use super::{BlockMatrix, BlockPattern};
use crate::Vec3;
use crate::num::index;

/// Numbers of a factor.
pub trait Precision: faer::traits::RealField + Copy {
    /// Rounded from double precision.
    fn from_f64(value: f64) -> Self;

    /// In double precision.
    fn number(self) -> f64;
}

impl Precision for f64 {
    fn from_f64(value: f64) -> Self {
        value
    }

    fn number(self) -> f64 {
        self
    }
}

/// What is smaller counts as 0 in single precision, where the largest numbers are of order one: it is far below
/// round-off, and products of a few such numbers are denormal, which some processors take a hundred times as
/// long for (a flat sheet under pressure: 15 s instead of 3 s).
const NEGLIGIBLE_ENTRY: f64 = 1e-13;

impl Precision for f32 {
    #[expect(clippy::cast_possible_truncation, reason = "rounding is what is wanted")]
    fn from_f64(value: f64) -> Self {
        if value.abs() < NEGLIGIBLE_ENTRY { 0.0 } else { value as Self }
    }

    fn number(self) -> f64 {
        self.into()
    }
}

/// A pattern, ordered and analysed, with room for the values of one matrix.
pub(super) struct Analysis {
    pattern: Arc<BlockPattern>,
    symbolic: SymbolicCholesky<u32>,
    column_start: Vec<u32>,
    row_index: Vec<u32>,
    value: Vec<f64>,
}

impl Analysis {
    /// Orders and analyses `pattern`.
    ///
    /// # Errors
    /// [`LinearError`] if the pattern is too large for the index type or for memory.
    pub(super) fn new(
        pattern: Arc<BlockPattern>,
        parameters: CholeskySymbolicParams<'_>,
    ) -> Result<Self, LinearError> {
        let axes = pattern.axes();
        let n = axes * pattern.rows();
        let order = Elimination::new(&Graph::new(&pattern)?)?.order;
        let mut forward = vec![0u32; n];
        let mut inverse = vec![0u32; n];
        for (new, &old) in order.iter().enumerate() {
            let old = old as usize;
            for a in 0..axes {
                forward[axes * new + a] = index(axes * old + a);
                inverse[axes * old + a] = index(axes * new + a);
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
        let value = vec![0.0; row_index.len()];
        Ok(Self { pattern, symbolic, column_start, row_index, value })
    }

    /// The symbolic factorisation.
    pub(super) fn symbolic(&self) -> &SymbolicCholesky<u32> {
        &self.symbolic
    }

    /// Number of unknowns.
    pub(super) fn unknowns(&self) -> usize {
        self.axes() * self.pattern.rows()
    }

    /// Unknowns of a vertex.
    pub(super) fn axes(&self) -> usize {
        self.pattern.axes()
    }

    /// Takes over the values of `matrix`, which must have the pattern this was made for.
    pub(super) fn load(&mut self, matrix: &BlockMatrix) {
        let mut values = self.value.iter_mut();
        matrix.for_each_lower(|entry| {
            if let Some(value) = values.next() {
                *value = entry;
            }
        });
    }

    /// The values taken over, as the lower triangle in compressed columns.
    pub(super) fn matrix(&self) -> SparseColMatRef<'_, u32, f64> {
        let n = self.unknowns();
        let layout =
            SymbolicSparseColMatRef::new_checked(n, n, &self.column_start, None, &self.row_index);
        SparseColMatRef::new(layout, &self.value)
    }
}

/// Writes vectors as unknowns, `axes` of each vector.
pub(super) fn pack(axes: usize, v: &[Vec3], into: &mut [f64]) {
    for (place, v) in into.chunks_exact_mut(axes).zip(v) {
        for (place, v) in place.iter_mut().zip(v.as_slice()) {
            *place = *v;
        }
    }
}

/// Writes unknowns as vectors; directions that are none become 0.
pub(super) fn unpack(axes: usize, from: &[f64], v: &mut [Vec3]) {
    for (place, v) in from.chunks_exact(axes).zip(v) {
        *v = Vec3::zeros();
        for (v, place) in v.as_mut_slice().iter_mut().zip(place) {
            *v = *place;
        }
    }
}

/// The error for memory that is not there.
pub(super) fn out_of_memory(what: &str, unknowns: usize) -> LinearError {
    LinearError::new(format!("not enough memory to {what} {unknowns} unknowns"))
}

/// Compressed columns of the lower triangle: column (i, a) is row (i, a) of the stored blocks.
fn lower_triangle(pattern: &BlockPattern) -> (Vec<u32>, Vec<u32>) {
    let axes = pattern.axes();
    let mut column_start = vec![0u32];
    let mut row_index = Vec::new();
    for i in 0..pattern.rows() {
        for a in 0..axes {
            row_index.extend((a..axes).map(|b| index(axes * i + b)));
            for &j in &pattern.row(i)[1..] {
                row_index.extend((0..axes).map(|b| index(axes * j as usize + b)));
            }
            column_start.push(index(row_index.len()));
        }
    }
    (column_start, row_index)
}
