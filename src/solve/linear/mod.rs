//! Sparse symmetric matrices of 3×3 blocks and their Cholesky factors.

mod block_matrix;
mod cholesky;
mod stencils;

pub use block_matrix::{Block, BlockMatrix, BlockPattern, RowMut};
pub use cholesky::{BlockCholesky, FrugalCholesky, NotPositive, Precision};
pub use stencils::{LazyStencils, Sink, Stencils};
