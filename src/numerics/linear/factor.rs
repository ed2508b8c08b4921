//! A solver for general sparse matrices: chosen once, then factorised and solved with again and again.

use serde::{Deserialize, Serialize};

use super::LinearError;
use super::{Displacements, FieldSplit, IluGmres, ShiftedJacobian, SmallLu, Sparse, SparseLu};
use crate::tally::Tally;

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

/// Unknowns up to which LU is chosen where there are no displacements: below, a factor costs less than the set-up of
/// anything else. Of shapes factors are dense: there LU is slower from 60 vertices on (`kind = "monolithic"`,
/// `linear = "lu"` against `"blocks"` on `models/policies/dome.toml`).
const MAX_DIRECT_UNKNOWNS: usize = 3000;

impl LinearChoice {
    /// What is chosen for so many unknowns, with displacements among them or not.
    #[must_use]
    pub fn resolve(self, unknowns: usize, displacements: bool) -> Self {
        match self {
            Self::Auto if displacements => Self::Blocks,
            Self::Auto if unknowns <= MAX_DIRECT_UNKNOWNS => Self::Lu,
            Self::Blocks if displacements => Self::Blocks,
            Self::Auto | Self::Blocks => Self::Ilu,
            choice => choice,
        }
    }
}

/// One of the solvers, for matrices of one pattern.
pub enum Factor {
    /// LU of few unknowns, without a pattern.
    Small(SmallLu),
    /// Sparse LU.
    Lu(Box<SparseLu>),
    /// GMRES with an incomplete factor.
    Ilu(Box<IluGmres>),
    /// GMRES with factors for two fields.
    Blocks(Box<FieldSplit>),
}

impl Factor {
    /// The solver of this choice for matrices with the pattern of this one; `displacements` if some of the
    /// unknowns are.
    ///
    /// # Errors
    /// [`LinearError`] if the factor is too large.
    pub fn new(
        choice: LinearChoice,
        matrix: &Sparse,
        displacements: Option<&Displacements>,
    ) -> Result<Self, LinearError> {
        let choice = choice.resolve(matrix.columns(), displacements.is_some());
        Ok(match (choice, displacements) {
            (LinearChoice::Blocks, Some(displacements)) => {
                Self::Blocks(Box::new(FieldSplit::new(matrix, displacements)?))
            }
            (LinearChoice::Lu, _) if matrix.rows() <= SmallLu::MAX_ROWS => {
                Self::Small(SmallLu::default())
            }
            (LinearChoice::Lu, _) => Self::Lu(Box::new(SparseLu::new(matrix)?)),
            _ => Self::Ilu(Box::new(IluGmres::new(matrix))),
        })
    }

    /// Records a matrix of the pattern; counted with `tally`.
    ///
    /// # Errors
    /// [`LinearError`] if it is singular.
    pub fn factorise(
        &mut self,
        matrix: ShiftedJacobian<'_>,
        tally: &Tally,
    ) -> Result<(), LinearError> {
        tally.count(|work| work.factorisations += 1);
        match self {
            Self::Small(lu) => lu.factorise(matrix),
            Self::Lu(lu) => lu.factorise(matrix),
            Self::Ilu(ilu) => ilu.factorise(matrix),
            Self::Blocks(blocks) => blocks.factorise(matrix),
        }
    }

    /// Solves in place with the last matrix; counted with `tally`.
    ///
    /// # Errors
    /// [`LinearError`] if the matrix is singular or the iteration does not converge.
    pub fn solve(&mut self, x: &mut [f64], tally: &Tally) -> Result<(), LinearError> {
        let (result, iterations) = match self {
            Self::Small(lu) => (lu.solve(x), 0),
            Self::Lu(lu) => (lu.solve(x), 0),
            Self::Ilu(ilu) => (ilu.solve(x), ilu.krylov.iterations),
            Self::Blocks(blocks) => (blocks.solve(x), blocks.krylov.iterations),
        };
        tally.count(|work| {
            work.solves += 1;
            work.krylov_iterations += iterations;
        });
        result
    }
}

/// A solver for such matrices with Jacobians of one pattern.
pub struct Shifted {
    factor: Factor,
}

impl Shifted {
    /// For Jacobians with the pattern of this one; `displacements` if some of the unknowns are.
    ///
    /// # Errors
    /// [`LinearError`] if the factor is too large.
    pub fn new(
        jacobian: &Sparse,
        choice: LinearChoice,
        displacements: Option<&Displacements>,
    ) -> Result<Self, LinearError> {
        Ok(Self { factor: Factor::new(choice, jacobian, displacements)? })
    }

    /// Solves `(D - W J) x = b` in place; `diagonals` gives the entries of D and W. One iteration of Newton's method,
    /// counted with `tally`.
    ///
    /// # Errors
    /// [`LinearError`] if the matrix is singular or the iteration does not converge.
    pub fn solve(
        &mut self,
        jacobian: &Sparse,
        diagonals: impl Fn(usize) -> (f64, f64) + Sync,
        x: &mut [f64],
        tally: &Tally,
    ) -> Result<(), LinearError> {
        tally.count(|work| work.newton_iterations += 1);
        self.factor.factorise(ShiftedJacobian::new(jacobian, &diagonals), tally)?;
        self.factor.solve(x, tally)
    }

    /// Solves in place with the matrix of the last [`Self::solve`].
    ///
    /// # Errors
    /// As for that.
    pub fn solve_again(&mut self, x: &mut [f64], tally: &Tally) -> Result<(), LinearError> {
        self.factor.solve(x, tally)
    }
}
