//! The linear systems of implicit methods: `(M - c ∂F/∂y) δ = r`.

use std::cell::RefCell;

use diffsol::{
    FaerContext, FaerSparseMat, FaerVec, LaError, LaLinearOp, Matrix, MatrixCommon, Vector,
};
use diffsol_la::LinearSolver;
use serde::{Deserialize, Serialize};

use crate::solve::SolveError;
use crate::solve::linear::{Displacements, Ilu, SparseLu, TwoFields};

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

/// A linear solver for diffsol that returns errors.
#[derive(Default)]
pub struct NewtonSolver {
    choice: LinearChoice,
    displacements: Option<Displacements>,
    matrix: Option<FaerSparseMat<f64>>,
    factor: RefCell<Factor>,
}

#[derive(Default)]
enum Factor {
    #[default]
    None,
    Lu(Box<SparseLu>),
    Ilu(Box<Ilu>),
    Blocks(Box<TwoFields>),
    Failed(String),
}

impl NewtonSolver {
    /// A solver of this kind.
    #[must_use]
    pub fn new(choice: LinearChoice, displacements: Option<Displacements>) -> Self {
        Self { choice, displacements, ..Self::default() }
    }

    fn prepare(&self, matrix: &FaerSparseMat<f64>) -> Result<Factor, SolveError> {
        let pattern = matrix.inner()[0].symbolic();
        let choice = match (self.choice, &self.displacements) {
            (LinearChoice::Auto, _) if pattern.ncols() <= DIRECT => LinearChoice::Lu,
            (LinearChoice::Auto, Some(_)) => LinearChoice::Blocks,
            (LinearChoice::Auto, None) => LinearChoice::Ilu,
            (choice, _) => choice,
        };
        Ok(match (choice, &self.displacements) {
            (LinearChoice::Blocks, Some(displacements)) => {
                Factor::Blocks(Box::new(TwoFields::new(pattern, displacements)?))
            }
            (LinearChoice::Lu, _) => Factor::Lu(Box::new(SparseLu::new(pattern)?)),
            _ => Factor::Ilu(Box::new(Ilu::new(pattern))),
        })
    }

    fn factorise(&self, matrix: &FaerSparseMat<f64>) -> Result<(), SolveError> {
        let mut factor = self.factor.borrow_mut();
        if matches!(*factor, Factor::None | Factor::Failed(_)) {
            *factor = self.prepare(matrix)?;
        }
        let matrix = matrix.inner()[0].as_ref();
        match &mut *factor {
            Factor::Lu(lu) => lu.factorise(matrix),
            Factor::Ilu(ilu) => ilu.factorise(matrix),
            Factor::Blocks(blocks) => blocks.factorise(matrix),
            Factor::None | Factor::Failed(_) => Ok(()),
        }
    }
}

impl LinearSolver<FaerSparseMat<f64>> for NewtonSolver {
    fn set_sparsity<
        C: LaLinearOp<V = FaerVec<f64>, T = f64, M = FaerSparseMat<f64>, C = FaerContext>,
    >(
        &mut self,
        op: &C,
    ) {
        let (rows, columns) = (op.nrows(), op.ncols());
        self.matrix =
            Some(FaerSparseMat::new_from_sparsity(rows, columns, op.sparsity(), *op.context()));
        self.factor = RefCell::default();
    }

    fn set_linearisation<
        C: LaLinearOp<V = FaerVec<f64>, T = f64, M = FaerSparseMat<f64>, C = FaerContext>,
    >(
        &mut self,
        op: &C,
    ) {
        let Some(mut matrix) = self.matrix.take() else { return };
        op.matrix_inplace(&mut matrix);
        // The solution says what went wrong; there is no other way to tell.
        if let Err(error) = self.factorise(&matrix) {
            self.factor = RefCell::new(Factor::Failed(error.to_string()));
        }
        self.matrix = Some(matrix);
    }

    fn solve_in_place(&self, x: &mut FaerVec<f64>) -> Result<(), LaError> {
        let Some(matrix) = &self.matrix else { return Err(LaError::Other("no matrix".into())) };
        let x = x.inner_mut().col_as_slice_mut(0);
        let solved = match &mut *self.factor.borrow_mut() {
            Factor::Lu(lu) => lu.solve(x),
            Factor::Ilu(ilu) => ilu.solve(x),
            Factor::Blocks(blocks) => blocks.solve(matrix.inner()[0].as_ref(), x),
            Factor::Failed(why) => Err(SolveError::Factorisation(why.clone())),
            Factor::None => Err(SolveError::Factorisation("there is no factor".into())),
        };
        solved.map_err(|error| LaError::Other(error.to_string()))
    }

    fn solve_transpose_in_place(&self, _: &mut FaerVec<f64>) -> Result<(), LaError> {
        Err(LaError::Other("transposed systems are not solved".into()))
    }
}
