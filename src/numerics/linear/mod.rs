//! Sparse symmetric matrices of 3×3 blocks (of 2×2 in a plane), their factors, and multigrid.

mod aggregates;
mod analysis;
mod assembly;
mod block_matrix;
mod block_pattern;
mod cholesky;
mod dense;
mod dissection;
mod factor;
mod field_split;
mod fronts;
mod gmres;
mod ilu;
mod incomplete_lu;
mod ldlt;
mod lists;
mod lu;
mod multifrontal;
mod multigrid;
mod panels;
mod periodic;
mod prolongator;
mod ritz;
mod row_pattern;
mod rows;
mod shifted;
mod solver;
mod sparse;
mod stencils;
mod strips;
mod substitution;
mod supernodes;
mod symmetric_rows;

pub use analysis::Precision;
pub use assembly::{Assembly, Contribution, Entries};
pub use block_matrix::{Block, BlockMatrix, BlockValues, RowMut};
pub use block_pattern::{BlockPattern, Neighbours};
pub use cholesky::{BlockCholesky, MixedPrecisionCholesky};
pub use dense::SmallLu;
pub use factor::{Factor, LinearChoice, Shifted};
pub use field_split::{Displacements, FieldSplit};
pub use gmres::{dot, norm};
pub use ilu::IluGmres;
pub use ldlt::BlockLdlt;
pub use lu::SparseLu;
pub use multigrid::Multigrid;
pub use periodic::PeriodicSolver;
pub use ritz::{EigenPair, largest_eigenvalues};
pub use row_pattern::Pattern;
pub use shifted::ShiftedJacobian;
pub use solver::LinearSolver;
pub use sparse::{Sparse, SumOfProduct};
pub use stencils::{Elements, LazyStencils, Packed, Rows, Sink, Stencils, pack};

/// A matrix that could not be factorised, or a system that could not be solved, and why.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct LinearError(String);

impl LinearError {
    /// With the reason in words.
    pub fn new(reason: impl Into<String>) -> Self {
        Self(reason.into())
    }
}

/// The matrix is not positive definite: information for the caller, not a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotPositive;
