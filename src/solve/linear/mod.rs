//! Sparse symmetric matrices of 3×3 blocks, their factors, and multigrid.

mod aggregates;
mod analysis;
mod block_matrix;
mod cholesky;
mod full_rows;
mod ldlt;
mod multigrid;
mod prolongator;
mod sparse;
mod stencils;

pub use analysis::Precision;
pub use block_matrix::{Block, BlockMatrix, BlockPattern, RowMut};
pub use cholesky::{BlockCholesky, FrugalCholesky, NotPositive};
pub use ldlt::BlockLdlt;
pub use multigrid::Multigrid;
pub use sparse::{Assembly, Entries, Sparse, SumOfProduct};
pub use stencils::{Elements, LazyStencils, Packed, Rows, Sink, Stencils, pack};
