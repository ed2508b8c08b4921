//! Sparse Cholesky factors of block matrices, by faer.
//!
//! Ordering and symbolic factorisation are those of [`Analysis`]; every numeric factorisation
//! reuses both and its memory.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::{CholeskySymbolicParams, LltRef};
use faer::{Conj, MatMut, Par, Side, Spec};

use super::LinearError;
use super::analysis::{Analysis, Precision, no_memory, pack, unpack};
use super::{BlockMatrix, BlockPattern, NotPositive};
use crate::Vec3;



/// Symbolic and numeric factorisation of matrices of one pattern.
pub struct OldCholesky<T: Precision = f64> {
    analysis: Analysis<T>,
    factor: Vec<T>,
    rhs: Vec<T>,
    /// What the matrix was divided by.
    unit: f64,
    factor_memory: MemBuffer,
    solve_memory: MemBuffer,
}

impl<T: Precision> OldCholesky<T> {
    /// Orders and analyses `pattern`.
    ///
    /// # Errors
    /// [`LinearError`] if the pattern is too large for the index type or for memory.
    pub fn new(pattern: Arc<BlockPattern>) -> Result<Self, LinearError> {
        let analysis = Analysis::new(pattern, CholeskySymbolicParams::default())?;
        let (symbolic, n) = (analysis.symbolic(), analysis.unknowns());
        let factor_memory = MemBuffer::try_new(
            symbolic.factorize_numeric_llt_scratch::<T>(Par::Seq, Spec::default()),
        )
        .map_err(|_| no_memory("factorise", n))?;
        let solve_memory = MemBuffer::try_new(symbolic.solve_in_place_scratch::<T>(1, Par::Seq))
            .map_err(|_| no_memory("solve for", n))?;
        Ok(Self {
            factor: vec![T::of(0.0); symbolic.len_val()],
            rhs: vec![T::of(0.0); n],
            unit: 1.0,
            analysis,
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
        // Entries are of order one in the factor, whatever the units.
        self.unit = matrix.mean_diagonal();
        if !(self.unit > 0.0 && self.unit.is_finite()) {
            return Err(NotPositive);
        }
        self.analysis.load(matrix, self.unit.recip());
        self.analysis
            .symbolic()
            .factorize_numeric_llt(
                &mut self.factor,
                self.analysis.matrix(),
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
        let axes = self.analysis.axes();
        pack(axes, rhs, scale, &mut self.rhs);
        let n = self.rhs.len();
        LltRef::new(self.analysis.symbolic(), &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.rhs, n, 1),
            Par::Seq,
            MemStack::new(&mut self.solve_memory),
        );
        unpack(axes, &self.rhs, back, rhs);
    }
}

