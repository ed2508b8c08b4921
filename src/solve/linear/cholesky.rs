//! Sparse Cholesky factors of block matrices, by faer.
//!
//! Ordering and symbolic factorisation are those of [`Analysis`]; every numeric factorisation
//! reuses both and its memory.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::{CholeskySymbolicParams, LltRef};
use faer::{Conj, MatMut, Par, Side, Spec};

use super::analysis::{Analysis, no_memory};
use super::{BlockMatrix, BlockPattern};
use crate::Vec3;
use crate::solve::SolveError;

/// The matrix is not positive definite: information for the caller, not a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotPositive;

/// Symbolic and numeric factorisation of matrices of one pattern.
pub struct BlockCholesky {
    analysis: Analysis,
    factor: Vec<f64>,
    rhs: Vec<f64>,
    factor_memory: MemBuffer,
    solve_memory: MemBuffer,
}

impl BlockCholesky {
    /// Orders and analyses `pattern`.
    ///
    /// # Errors
    /// [`SolveError::Factorisation`] if the pattern is too large for the index type or for memory.
    pub fn new(pattern: Arc<BlockPattern>) -> Result<Self, SolveError> {
        let analysis = Analysis::new(pattern, CholeskySymbolicParams::default())?;
        let (symbolic, n) = (analysis.symbolic(), analysis.unknowns());
        let factor_memory = MemBuffer::try_new(
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default()),
        )
        .map_err(|_| no_memory("factorise", n))?;
        let solve_memory = MemBuffer::try_new(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq))
            .map_err(|_| no_memory("solve for", n))?;
        Ok(Self {
            factor: vec![0.0; symbolic.len_val()],
            rhs: vec![0.0; n],
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
        self.analysis.load(matrix);
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
        for (place, v) in self.rhs.chunks_exact_mut(3).zip(rhs.iter()) {
            place.copy_from_slice(v.as_slice());
        }
        let n = self.rhs.len();
        LltRef::new(self.analysis.symbolic(), &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.rhs, n, 1),
            Par::Seq,
            MemStack::new(&mut self.solve_memory),
        );
        for (place, v) in self.rhs.chunks_exact(3).zip(rhs.iter_mut()) {
            v.copy_from_slice(place);
        }
    }
}
