//! The metric that L-BFGS starts from: a Cholesky factor, or multigrid where that is too large.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::Vec3;
use crate::solve::SolveError;
use crate::solve::linear::{BlockMatrix, BlockPattern, FrugalCholesky, Multigrid, NotPositive};

/// How the Hessian's positive part is inverted: `equilibrium.preconditioner` in a scene.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preconditioner {
    /// Exactly, by a sparse Cholesky factor, whose size grows faster than the sheet.
    Factor,
    /// Approximately, by one multigrid cycle, in memory that grows as the sheet does.
    Multigrid,
    /// The factor up to 50 000 vertices, multigrid beyond.
    #[default]
    Auto,
}

impl Preconditioner {
    /// In words, for reports.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Factor => "a Cholesky factor",
            Self::Multigrid => "multigrid",
            Self::Auto => "a Cholesky factor or, for large sheets, multigrid",
        }
    }
}

/// Vertices beyond which [`Preconditioner::Auto`] is multigrid. On the smoothly grown disc of the
/// scaling bench it is faster at every size, by a third at 30 000; on a sheet that crumples (race A, noise 1)
/// the factor is faster, and finds a lower minimum. It is kept where it is affordable.
const LARGE: usize = 50_000;

/// The preconditioner of one relaxation.
pub(super) enum Inverse {
    Factor(Box<FrugalCholesky>),
    Multigrid(Box<Multigrid>),
}

impl Inverse {
    /// Prepares what depends on the pattern only.
    pub(super) fn new(
        kind: Preconditioner,
        pattern: &Arc<BlockPattern>,
    ) -> Result<Self, SolveError> {
        let factor = match kind {
            Preconditioner::Factor => true,
            Preconditioner::Multigrid => false,
            Preconditioner::Auto => pattern.rows() <= LARGE,
        };
        Ok(if factor {
            Self::Factor(Box::new(FrugalCholesky::new(Arc::clone(pattern))?))
        } else {
            Self::Multigrid(Box::new(Multigrid::new(pattern)?))
        })
    }

    /// Takes over `matrix`, the Hessian or its positive part at `x`; with `insist` at some expense
    /// rather than fail.
    pub(super) fn factorise(
        &mut self,
        matrix: &BlockMatrix,
        x: &[Vec3],
        insist: bool,
    ) -> Result<(), NotPositive> {
        match self {
            Self::Factor(cholesky) => cholesky.factorise(matrix, insist),
            Self::Multigrid(multigrid) => multigrid.factorise(matrix, x, insist),
        }
    }

    /// Replaces `rhs` by the solution, or nearly.
    pub(super) fn solve(&mut self, rhs: &mut [Vec3]) {
        match self {
            Self::Factor(cholesky) => cholesky.solve(rhs),
            Self::Multigrid(multigrid) => multigrid.solve(rhs),
        }
    }
}
