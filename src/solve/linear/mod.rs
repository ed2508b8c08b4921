//! Sparse symmetric matrices of 3×3 blocks and their factors.

mod analysis;
mod block_matrix;
mod cholesky;
mod ldlt;

pub use block_matrix::{Block, BlockMatrix, BlockPattern, RowMut};
pub use cholesky::{BlockCholesky, NotPositive};
pub use ldlt::BlockLdlt;
