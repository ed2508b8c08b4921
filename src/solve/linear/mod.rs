//! Sparse symmetric matrices of 3×3 blocks and their factors.

mod analysis;
mod block_matrix;
mod cholesky;
mod ldlt;
mod stencils;

pub use analysis::Precision;
pub use block_matrix::{Block, BlockMatrix, BlockPattern, RowMut};
pub use cholesky::{BlockCholesky, FrugalCholesky, NotPositive};
pub use ldlt::BlockLdlt;
pub use stencils::{LazyStencils, Sink, Stencils};
