//! Sparse Cholesky factors of block matrices, by faer.
//!
//! The ordering is nested dissection on the graph of the vertices (not of the three times as many
//! unknowns), found once for a pattern, as is the symbolic factorisation; every numeric
//! factorisation reuses both and its memory.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};
use feral_metis::{CscPattern, metis_order};

use super::{BlockMatrix, BlockPattern};
use crate::Vec3;
use crate::num::index;
use crate::solve::SolveError;

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

/// The matrix is not positive definite: information for the caller, not a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotPositive;

/// Symbolic and numeric factorisation of matrices of one pattern.
pub struct BlockCholesky<T: Precision = f64> {
    pattern: Arc<BlockPattern>,
    symbolic: SymbolicCholesky<u32>,
    column_start: Vec<u32>,
    row_index: Vec<u32>,
    value: Vec<T>,
    factor: Vec<T>,
    rhs: Vec<T>,
    /// What the matrix was divided by.
    unit: f64,
    factor_memory: MemBuffer,
    solve_memory: MemBuffer,
}

impl<T: Precision> BlockCholesky<T> {
    /// Orders and analyses `pattern`.
    ///
    /// # Errors
    /// [`SolveError::Factorisation`] if the pattern is too large for the index type or for memory.
    pub fn new(pattern: Arc<BlockPattern>) -> Result<Self, SolveError> {
        let n = 3 * pattern.rows();
        let failed = |what: String| SolveError::Factorisation(what);
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
            CholeskySymbolicParams::default(),
        )
        .map_err(|e| failed(format!("symbolic factorisation of {n} unknowns: {e:?}")))?;
        let factor_memory = MemBuffer::try_new(
            symbolic.factorize_numeric_llt_scratch::<T>(Par::Seq, Spec::default()),
        )
        .map_err(|_| failed(format!("no memory to factorise {n} unknowns")))?;
        let solve_memory = MemBuffer::try_new(symbolic.solve_in_place_scratch::<T>(1, Par::Seq))
            .map_err(|_| failed(format!("no memory to solve for {n} unknowns")))?;
        Ok(Self {
            value: vec![T::of(0.0); row_index.len()],
            factor: vec![T::of(0.0); symbolic.len_val()],
            rhs: vec![T::of(0.0); n],
            unit: 1.0,
            pattern,
            symbolic,
            column_start,
            row_index,
            factor_memory,
            solve_memory,
        })
    }

    /// Numbers in the factor.
    #[must_use]
    pub fn factor_size(&self) -> usize {
        self.factor.len()
    }

    /// Factorises `matrix`, which must have the pattern this was made for.
    ///
    /// # Errors
    /// [`NotPositive`] if it is not positive definite (or not finite); the factor is unusable then.
    pub fn factorise(&mut self, matrix: &BlockMatrix) -> Result<(), NotPositive> {
        let mut next = 0;
        // Entries are of order one in the factor, whatever the units.
        self.unit = matrix.mean_diagonal();
        if !(self.unit > 0.0 && self.unit.is_finite()) {
            return Err(NotPositive);
        }
        let scale = self.unit.recip();
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
        let n = 3 * self.pattern.rows();
        let layout =
            SymbolicSparseColMatRef::new_checked(n, n, &self.column_start, None, &self.row_index);
        self.symbolic
            .factorize_numeric_llt(
                &mut self.factor,
                SparseColMatRef::new(layout, &self.value),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut self.factor_memory),
                Spec::default(),
            )
            .map_err(|_| NotPositive)?;
        Ok(())
    }

    /// Replaces `rhs` by the solution for the last matrix factorised.
    pub fn solve(&mut self, rhs: &mut [Vec3]) {
        // Single precision has a narrow range.
        let largest = rhs.iter().map(nalgebra::Vector3::amax).fold(0.0, f64::max);
        if !(largest > 0.0 && largest.is_finite()) {
            return;
        }
        let (scale, back) = (largest.recip(), largest / self.unit);
        for (place, v) in self.rhs.chunks_exact_mut(3).zip(rhs.iter()) {
            for (place, v) in place.iter_mut().zip(v.as_slice()) {
                *place = T::of(scale * v);
            }
        }
        let n = self.rhs.len();
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.rhs, n, 1),
            Par::Seq,
            MemStack::new(&mut self.solve_memory),
        );
        for (place, v) in self.rhs.chunks_exact(3).zip(rhs.iter_mut()) {
            for (v, place) in v.as_mut_slice().iter_mut().zip(place) {
                *v = back * place.number();
            }
        }
    }
}

/// A factor in single precision for as long as that does, in double precision afterwards.
///
/// Single precision halves the time of a factorisation and of a solve, which both wait for memory;
/// to a method that corrects itself (quasi-Newton, conjugate gradients) the difference is nothing
/// until the matrix is worse conditioned than single precision can hold.
pub struct FrugalCholesky {
    pattern: Arc<BlockPattern>,
    single: Option<BlockCholesky<f32>>,
    double: Option<BlockCholesky<f64>>,
}

impl FrugalCholesky {
    /// Orders and analyses `pattern`.
    ///
    /// # Errors
    /// As [`BlockCholesky::new`].
    pub fn new(pattern: Arc<BlockPattern>) -> Result<Self, SolveError> {
        let single = Some(BlockCholesky::new(Arc::clone(&pattern))?);
        Ok(Self { pattern, single, double: None })
    }

    /// Factorises `matrix`; with `insist`, in double precision if single precision fails, and from
    /// then on always.
    ///
    /// # Errors
    /// [`NotPositive`] as [`BlockCholesky::factorise`], or if there is no memory for the larger
    /// factor.
    pub fn factorise(&mut self, matrix: &BlockMatrix, insist: bool) -> Result<(), NotPositive> {
        if let Some(double) = &mut self.double {
            return double.factorise(matrix);
        }
        if let Some(single) = &mut self.single {
            match single.factorise(matrix) {
                Err(_) if insist => self.single = None,
                result => return result,
            }
        }
        let mut double = BlockCholesky::new(Arc::clone(&self.pattern)).map_err(|_| NotPositive)?;
        let result = double.factorise(matrix);
        self.double = Some(double);
        result
    }

    /// Replaces `rhs` by the solution for the last matrix factorised.
    pub fn solve(&mut self, rhs: &mut [Vec3]) {
        if let Some(double) = &mut self.double {
            double.solve(rhs);
        } else if let Some(single) = &mut self.single {
            single.solve(rhs);
        }
    }

    /// Bytes of the factor.
    #[must_use]
    pub fn factor_bytes(&self) -> usize {
        self.single.as_ref().map_or(0, |f| 4 * f.factor_size())
            + self.double.as_ref().map_or(0, |f| 8 * f.factor_size())
    }
}

/// Nested-dissection order of the vertices: position → vertex.
fn nested_dissection(pattern: &BlockPattern) -> Result<Vec<u32>, SolveError> {
    let n = pattern.rows();
    let failed = || SolveError::Factorisation(format!("no ordering for {n} vertices"));
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
