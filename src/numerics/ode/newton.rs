//! The linear systems of implicit methods: `(M - c ∂F/∂y) δ = r`.

use std::cell::RefCell;
use std::sync::{Arc, Mutex, PoisonError};

use diffsol::{
    FaerContext, FaerSparseMat, FaerVec, LaError, LaLinearOp, Matrix, MatrixCommon, Vector,
};
use diffsol_la::LinearSolver;

use super::{OdeError, Result};
use crate::linear::{Displacements, Factor, LinearChoice};
use crate::tally::{Meter, Tally};

/// Where a solver leaves its factor for the next one of the same pattern: ordering and symbolic
/// analysis serve again, the numbers are new.
pub(super) type Spare = Arc<Mutex<Option<Factor>>>;

/// A linear solver for diffsol that returns errors.
#[derive(Default)]
pub(super) struct NewtonSolver {
    choice: LinearChoice,
    displacements: Option<Displacements>,
    matrix: Option<FaerSparseMat<f64>>,
    /// The solver, or why there is none; made with the first matrix.
    factor: RefCell<Option<Result<Factor>>>,
    spare: Spare,
    /// Where its work is counted.
    tally: Tally,
    /// Of the factor and of the solutions.
    meters: Option<[Meter; 2]>,
}

impl Drop for NewtonSolver {
    fn drop(&mut self) {
        if let Some(Ok(factor)) = self.factor.take() {
            *self.spare.lock().unwrap_or_else(PoisonError::into_inner) = Some(factor);
        }
    }
}

impl NewtonSolver {
    /// A solver of this kind.
    pub(super) fn new(
        choice: LinearChoice,
        displacements: Option<Displacements>,
        spare: Spare,
        tally: &Tally,
    ) -> Self {
        let meters = Some([
            tally.meter("solver", "factors of coupled systems", &[]),
            tally.meter("solver", "solutions of coupled systems", &[]),
        ]);
        let (matrix, factor) = (None, RefCell::default());
        Self { choice, displacements, matrix, factor, spare, tally: tally.clone(), meters }
    }

    fn factorised(&self, matrix: &FaerSparseMat<f64>) -> Result<Factor> {
        let _scope = self.meters.as_ref().map(|[factor, _]| factor.scope(0));
        let matrix = matrix.inner()[0].as_ref();
        // The Jacobian could not be evaluated: no time is lost on its factor.
        if matrix.val().iter().any(|value| !value.is_finite()) {
            return Err(OdeError::NotFinite);
        }
        let spare = || self.spare.lock().unwrap_or_else(PoisonError::into_inner).take();
        let mut factor = match self.factor.take() {
            Some(Ok(factor)) => factor,
            _ => match spare() {
                Some(factor) => factor,
                None => Factor::new(self.choice, matrix.symbolic(), self.displacements.as_ref())?,
            },
        };
        factor.factorise(matrix, &self.tally)?;
        Ok(factor)
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
        self.factor = RefCell::new(Some(self.factorised(&matrix)));
        self.matrix = Some(matrix);
    }

    fn solve_in_place(&self, x: &mut FaerVec<f64>) -> Result<(), LaError> {
        let _scope = self.meters.as_ref().map(|[_, solution]| solution.scope(0));
        let x = x.inner_mut().col_as_slice_mut(0);
        match &mut *self.factor.borrow_mut() {
            Some(Ok(factor)) => {
                factor.solve(x, &self.tally).map_err(|error| LaError::Other(error.to_string()))
            }
            Some(Err(error)) => Err(LaError::Other(error.to_string())),
            None => Err(LaError::Other("there is no factor".into())),
        }
    }

    fn solve_transpose_in_place(&self, _: &mut FaerVec<f64>) -> Result<(), LaError> {
        Err(LaError::Other("transposed systems are not solved".into()))
    }
}
