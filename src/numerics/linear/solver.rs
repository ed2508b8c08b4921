//! Solvers of symmetric systems over the vertices of a mesh.
//!
//! ```text
//! A u = b        A: blocks of 3×3 (2×2 in a plane) over the vertices, in a fixed pattern
//! ```
//!
//! Equilibrium methods and stability know this trait only. A crate of a user brings another solver by one implementation and one
//! registration (`rumple::register_linear_solver!`).

use super::cholesky::{BlockCholesky, MixedPrecisionCholesky};
use super::{BlockLdlt, BlockMatrix, Multigrid, NotPositive};
use crate::Vec3;
use crate::record::{Malformed, Record};

/// A solver for matrices of one pattern: analysed when it is made, then factorised and solved with any number of times.
///
/// Results must have the same bits on any number of threads, or runs have not.
pub trait LinearSolver: Send {
    /// Takes over `matrix`, of the pattern it was made for. `x` are the positions of the vertices where
    /// [`Self::reads_shape`], empty otherwise; with `insist` it succeeds at some expense rather than fail.
    ///
    /// # Errors
    /// [`NotPositive`] if the matrix is not finite, or not positive definite where [`Self::detects_indefinite`]; it is
    /// then unusable until the next one.
    fn factorise(
        &mut self,
        matrix: &BlockMatrix,
        x: &[Vec3],
        insist: bool,
    ) -> Result<(), NotPositive>;

    /// Replaces `rhs` by the solution, or nearly, for the last matrix.
    fn solve(&mut self, rhs: &mut [Vec3]);

    /// Whether it fails for every matrix that is not positive definite, as a Cholesky factorisation does.
    fn detects_indefinite(&self) -> bool {
        false
    }

    /// Negative eigenvalues of the last matrix, where indefinite ones are factorised and their inertia is known: what the
    /// stability of shapes is judged with.
    fn negative_eigenvalues(&self) -> Option<usize> {
        None
    }

    /// Whether it solves over all ranks of a sheet that is spread: it then reads what is owned of a right-hand side, and
    /// writes that of the solution.
    fn is_distributed(&self) -> bool {
        false
    }

    /// Whether [`Self::factorise`] reads positions.
    fn reads_shape(&self) -> bool {
        false
    }

    /// What the next factorisation depends on besides its matrix.
    fn memory(&self) -> Record {
        Record::default()
    }

    /// Takes over the memory of one for the same pattern.
    ///
    /// # Errors
    /// [`Malformed`] for anything else.
    fn restore(&mut self, _memory: &Record) -> Result<(), Malformed> {
        Ok(())
    }
}

impl LinearSolver for BlockCholesky<f64> {
    fn factorise(&mut self, matrix: &BlockMatrix, _: &[Vec3], _: bool) -> Result<(), NotPositive> {
        Self::factorise(self, matrix)
    }

    fn solve(&mut self, rhs: &mut [Vec3]) {
        Self::solve(self, rhs);
    }

    fn detects_indefinite(&self) -> bool {
        true
    }
}

impl LinearSolver for BlockLdlt {
    fn factorise(&mut self, matrix: &BlockMatrix, _: &[Vec3], _: bool) -> Result<(), NotPositive> {
        Self::factorise(self, matrix).map(|_| ()).map_err(|_| NotPositive)
    }

    fn solve(&mut self, rhs: &mut [Vec3]) {
        Self::solve(self, rhs);
    }

    fn negative_eigenvalues(&self) -> Option<usize> {
        self.negative()
    }
}

impl LinearSolver for MixedPrecisionCholesky {
    fn factorise(
        &mut self,
        matrix: &BlockMatrix,
        _: &[Vec3],
        insist: bool,
    ) -> Result<(), NotPositive> {
        Self::factorise(self, matrix, insist)
    }

    fn solve(&mut self, rhs: &mut [Vec3]) {
        Self::solve(self, rhs);
    }

    fn detects_indefinite(&self) -> bool {
        true
    }

    /// Single precision may have been given up.
    fn memory(&self) -> Record {
        Record::encode(&self.is_double())
    }

    fn restore(&mut self, memory: &Record) -> Result<(), Malformed> {
        self.set_double(memory.read()?).map_err(|_| Malformed)
    }
}

impl LinearSolver for Multigrid {
    fn factorise(
        &mut self,
        matrix: &BlockMatrix,
        x: &[Vec3],
        insist: bool,
    ) -> Result<(), NotPositive> {
        Self::factorise(self, matrix, x, insist)
    }

    fn solve(&mut self, rhs: &mut [Vec3]) {
        Self::solve(self, rhs);
    }

    fn reads_shape(&self) -> bool {
        true
    }
}
