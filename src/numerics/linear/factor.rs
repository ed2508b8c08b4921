//! A solver for general sparse matrices: chosen once, then factorised and solved with again and again.

use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use serde::{Deserialize, Serialize};

use super::LinearError;
use super::{Displacements, Ilu, SparseLu, TwoFields};

/// How linear systems are solved.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LinearChoice {
    /// By the number of unknowns and what they are.
    #[default]
    Auto,
    /// Sparse LU.
    Lu,
    /// GMRES with an incomplete factor without fill; for chemistry alone.
    Ilu,
    /// GMRES with a Cholesky factor for the shape and an incomplete one for the chemistry.
    Blocks,
}

/// Unknowns up to which LU is chosen: below, a factor costs less than the set-up of anything else.
const DIRECT: usize = 3000;

/// One of the solvers, for matrices of one pattern.
pub enum Factor {
    /// Sparse LU.
    Lu(Box<SparseLu>),
    /// GMRES with an incomplete factor.
    Ilu(Box<Ilu>),
    /// GMRES with factors for two fields.
    Blocks(Box<TwoFields>),
}

impl Factor {
    /// The solver of this choice; `displacements` if some of the unknowns are.
    ///
    /// # Errors
    /// [`LinearError`] if the factor is too large.
    pub fn new(
        choice: LinearChoice,
        pattern: SymbolicSparseColMatRef<'_, usize>,
        displacements: Option<&Displacements>,
    ) -> Result<Self, LinearError> {
        let choice = match choice {
            LinearChoice::Auto if pattern.ncols() <= DIRECT => LinearChoice::Lu,
            LinearChoice::Auto if displacements.is_some() => LinearChoice::Blocks,
            LinearChoice::Auto => LinearChoice::Ilu,
            choice => choice,
        };
        Ok(match (choice, displacements) {
            (LinearChoice::Blocks, Some(displacements)) => {
                Self::Blocks(Box::new(TwoFields::new(pattern, displacements)?))
            }
            (LinearChoice::Lu, _) => Self::Lu(Box::new(SparseLu::new(pattern)?)),
            _ => Self::Ilu(Box::new(Ilu::new(pattern))),
        })
    }

    /// Records a matrix of the pattern.
    ///
    /// # Errors
    /// [`LinearError`] if it is singular.
    pub fn factorise(
        &mut self,
        matrix: SparseColMatRef<'_, usize, f64>,
    ) -> Result<(), LinearError> {
        match self {
            Self::Lu(lu) => lu.factorise(matrix),
            Self::Ilu(ilu) => ilu.factorise(matrix),
            Self::Blocks(blocks) => blocks.factorise(matrix),
        }
    }

    /// Solves in place with the last matrix.
    ///
    /// # Errors
    /// [`LinearError`] if the matrix is singular or the iteration does not converge.
    pub fn solve(&mut self, x: &mut [f64]) -> Result<(), LinearError> {
        match self {
            Self::Lu(lu) => lu.solve(x),
            Self::Ilu(ilu) => ilu.solve(x),
            Self::Blocks(blocks) => blocks.solve(x),
        }
    }
}
