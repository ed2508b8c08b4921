//! Sparse LU with column ordering: faer's factorisation, with errors in place of panics.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::lu::{LuRef, NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par};

use super::shifted::ShiftedJacobian;
use super::{LinearError, Sparse};

/// An LU factor of matrices in one pattern.
pub struct SparseLu {
    /// The matrix by columns, and for every entry its place by rows.
    matrix: SparseColMat<usize, f64>,
    place: Vec<u32>,
    symbolic: SymbolicLu<usize>,
    numeric: NumericLu<usize, f64>,
    memory: MemBuffer,
    ready: bool,
}

impl SparseLu {
    /// Orders the columns and prepares the factor for matrices with the pattern of this one.
    ///
    /// # Errors
    /// [`LinearError`] if the memory does not suffice.
    pub fn new(matrix: &Sparse) -> Result<Self, LinearError> {
        let (starts, rows, place) = matrix.by_columns();
        let (n, m) = (matrix.rows(), matrix.columns());
        let pattern = SymbolicSparseColMat::new_checked(n, m, starts, None, rows);
        let refuse = |why: &dyn std::fmt::Debug| {
            LinearError::new(format!("the matrix cannot be factorised: {why:?}"))
        };
        let symbolic =
            factorize_symbolic_lu(pattern.as_ref(), Default::default()).map_err(|e| refuse(&e))?;
        let need = symbolic
            .factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default())
            .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq))
            .or(symbolic.solve_transpose_in_place_scratch::<f64>(1, Par::Seq));
        let memory = MemBuffer::try_new(need).map_err(|e| refuse(&e))?;
        let matrix = SparseColMat::new(pattern, vec![0.0; place.len()]);
        Ok(Self { matrix, place, symbolic, numeric: NumericLu::new(), memory, ready: false })
    }

    /// Factorises a matrix of the pattern.
    ///
    /// # Errors
    /// [`LinearError`] for a matrix that is singular by its pattern, or with numbers
    /// that are not finite. One that is singular by its numbers shows in the solution.
    pub fn factorise(&mut self, matrix: ShiftedJacobian<'_>) -> Result<(), LinearError> {
        self.ready = false;
        for j in 0..self.matrix.ncols() {
            for k in self.matrix.col_range(j) {
                let (i, place) = (self.matrix.row_idx()[k], self.place[k] as usize);
                self.matrix.val_mut()[k] = matrix.entry(i, place, i == j);
            }
        }
        if !self.matrix.val().iter().all(|v| v.is_finite()) {
            let text = "the Newton matrix has entries that are not finite";
            return Err(LinearError::new(text));
        }
        let Self { matrix, symbolic, numeric, memory, .. } = self;
        let stack = MemStack::new(memory);
        symbolic
            .factorize_numeric_lu(numeric, matrix.as_ref(), Par::Seq, stack, Default::default())
            .map_err(|e| LinearError::new(format!("the Newton matrix is singular: {e:?}")))?;
        self.ready = true;
        Ok(())
    }

    /// Solves in place.
    ///
    /// # Errors
    /// [`LinearError`] if the solution is not finite: the matrix is singular.
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        self.substitute(x, false)
    }

    /// Solves with the transposed matrix in place.
    ///
    /// # Errors
    /// As for [`Self::solve`].
    pub fn solve_transposed(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        self.substitute(x, true)
    }

    fn substitute(&mut self, x: &mut [f64], transposed: bool) -> Result<(), LinearError> {
        if !self.ready {
            return Err(LinearError::new("the matrix is not factorised"));
        }
        let Self { symbolic, numeric, memory, .. } = self;
        // The numeric part belongs to the symbolic one: both are made here.
        let factor = LuRef::new_unchecked(symbolic, numeric);
        let n = x.len();
        let right = MatMut::from_column_major_slice_mut(x, n, 1);
        let stack = MemStack::new(memory);
        match transposed {
            true => factor.solve_transpose_in_place_with_conj(Conj::No, right, Par::Seq, stack),
            false => factor.solve_in_place_with_conj(Conj::No, right, Par::Seq, stack),
        }
        if x.iter().all(|v| v.is_finite()) {
            Ok(())
        } else {
            Err(LinearError::new("the Newton matrix is singular"))
        }
    }
}
