//! Sparse symmetric indefinite factors `P A Pᵀ = L D Lᵀ` of block matrices, by faer, and what D says.
//!
//! By Sylvester's law of inertia A has as many negative eigenvalues as D. D has blocks of one or two:
//! rows are exchanged (Bunch & Kaufman, Math. Comp. 31 (1977) 163, doi:10.2307/2005787) within the
//! dense diagonal blocks of supernodes only, so the fill is that of a Cholesky factor. That does not
//! bound the growth of entries as full pivoting would; callers who need certainty compare `A x` with
//! the right-hand side after a solve.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::lblt::factor::{LbltParams, PivotingStrategy};
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, IntranodeLbltRef, SymbolicCholeskyRaw,
};
use faer::{Auto, Conj, MatMut, Par, Side, Spec};

use super::LinearError;
use super::analysis::{Analysis, out_of_memory, pack, unpack};
use super::{BlockMatrix, BlockPattern};
use crate::Vec3;

/// How pivots are chosen: rook pivoting bounds the entries of L. (The default of faer 0.24, which
/// looks along the diagonal first, gave wrong factors: a residual of 0.14 for one of the Hessians in
/// the tests, where rook pivoting leaves 2·10⁻¹⁵.)
fn pivoting() -> Spec<LbltParams, f64> {
    let mut parameters = <LbltParams as Auto<f64>>::auto();
    parameters.pivoting = PivotingStrategy::Rook;
    Spec::new(parameters)
}

/// Symbolic and numeric factorisation of symmetric indefinite matrices of one pattern.
pub struct BlockLdlt {
    analysis: Analysis,
    factor: Vec<f64>,
    /// Off-diagonal entry of a block of two in D, at its first row; 0 for a block of one.
    off_diagonal: Vec<f64>,
    forward: Vec<u32>,
    inverse: Vec<u32>,
    rhs: Vec<f64>,
    factor_memory: MemBuffer,
    solve_memory: MemBuffer,
    negative: Option<usize>,
}

impl BlockLdlt {
    /// Orders and analyses `pattern`.
    ///
    /// # Errors
    /// [`LinearError`] if the pattern is too large for the index type or for memory.
    pub fn new(pattern: Arc<BlockPattern>) -> Result<Self, LinearError> {
        // Only supernodes have dense blocks to exchange rows in.
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..CholeskySymbolicParams::default()
        };
        let analysis = Analysis::new(pattern, parameters)?;
        let (symbolic, n) = (analysis.symbolic(), analysis.unknowns());
        let factor_memory = MemBuffer::try_new(
            symbolic.factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, pivoting()),
        )
        .map_err(|_| out_of_memory("factorise", n))?;
        let solve_memory = MemBuffer::try_new(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq))
            .map_err(|_| out_of_memory("solve for", n))?;
        Ok(Self {
            factor: vec![0.0; symbolic.len_val()],
            off_diagonal: vec![0.0; n],
            forward: vec![0; n],
            inverse: vec![0; n],
            rhs: vec![0.0; n],
            negative: None,
            analysis,
            factor_memory,
            solve_memory,
        })
    }

    /// Negative eigenvalues of the last matrix.
    #[must_use]
    pub fn negative(&self) -> Option<usize> {
        self.negative
    }

    /// Numbers in the factor.
    #[must_use]
    pub fn factor_size(&self) -> usize {
        self.factor.len()
    }

    /// Factorises `matrix`, and counts its negative eigenvalues.
    ///
    /// # Errors
    /// [`LinearError`] for a matrix with entries that are not finite, or one so
    /// singular that a pivot vanishes.
    pub fn factorise(&mut self, matrix: &BlockMatrix) -> Result<usize, LinearError> {
        self.analysis.load(matrix);
        self.analysis.symbolic().factorize_numeric_intranode_lblt(
            &mut self.factor,
            &mut self.off_diagonal,
            &mut self.forward,
            &mut self.inverse,
            self.analysis.matrix(),
            Side::Lower,
            Par::Seq,
            MemStack::new(&mut self.factor_memory),
            pivoting(),
        );
        self.negative = self.negative_pivots();
        self.negative
            .ok_or_else(|| LinearError::new("a pivot of the Hessian is zero or not finite"))
    }

    /// Negative eigenvalues of D; `None` if one is zero or not finite.
    fn negative_pivots(&self) -> Option<usize> {
        let SymbolicCholeskyRaw::Supernodal(symbolic) = self.analysis.symbolic().raw() else {
            return None;
        };
        let (begin, end) = (symbolic.supernode_begin(), symbolic.supernode_end());
        let mut negative = 0;
        for s in 0..symbolic.n_supernodes() {
            let (begin, end) = (begin[s] as usize, end[s] as usize);
            let rows = end - begin + symbolic.supernode(s).pattern().len();
            let block = &self.factor[symbolic.col_ptr_for_val()[s] as usize..];
            let mut j = begin;
            while j < end {
                let at = |k: usize| block[(k - begin) * (rows + 1)];
                let coupling = self.off_diagonal[j];
                if coupling == 0.0 {
                    let pivot = at(j);
                    if !(pivot.is_finite() && pivot != 0.0) {
                        return None;
                    }
                    negative += usize::from(pivot < 0.0);
                    j += 1;
                } else {
                    let (a, c) = (at(j), at(j + 1));
                    let determinant = a * c - coupling * coupling;
                    if !(determinant.is_finite() && determinant != 0.0) {
                        return None;
                    }
                    negative += match (determinant < 0.0, a < 0.0) {
                        (true, _) => 1,
                        (false, true) => 2,
                        (false, false) => 0,
                    };
                    j += 2;
                }
            }
        }
        Some(negative)
    }

    /// Replaces `rhs` by the solution for the last matrix factorised.
    pub fn solve(&mut self, rhs: &mut [Vec3]) {
        let axes = self.analysis.axes();
        pack(axes, rhs, &mut self.rhs);
        let n = self.rhs.len();
        IntranodeLbltRef::new(
            self.analysis.symbolic(),
            &self.factor,
            &self.off_diagonal,
            PermRef::new_checked(&self.forward, &self.inverse, n),
        )
        .solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.rhs, n, 1),
            Par::Seq,
            MemStack::new(&mut self.solve_memory),
        );
        unpack(axes, &self.rhs, rhs);
    }
}
