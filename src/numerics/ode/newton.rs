//! The linear systems of implicit methods: `(M - c ∂F/∂y) δ = r`.

use std::cell::RefCell;
use std::sync::{Arc, Mutex, PoisonError};

use diffsol::{LaError, LaLinearOp, Matrix, Vector};
use diffsol_la::LinearSolver;

use super::error_norm::Grouping;
use super::iteration_matrix::{IterationMatrix, Shared};
use super::unknowns::Unknowns;
use super::{OdeError, Options, Result};
use crate::linear::{Factor, LinearChoice, ShiftedJacobian};
use crate::tally::{Meter, Tally};

/// Where a solver leaves its factor for the next one of the same pattern: ordering and symbolic
/// analysis serve again, the numbers are new.
pub(super) type SharedFactor = Arc<Mutex<Option<Factor>>>;

/// Below so many unknowns a solve costs no more than the clock.
const UNTIMED_UNKNOWNS: usize = 24;

/// A linear solver for diffsol that returns errors.
#[derive(Default)]
pub(super) struct NewtonSolver {
    options: Option<Arc<Options>>,
    /// Where the numbers of the matrix are.
    shared: Option<Arc<Shared>>,
    /// The solver, or why there is none; made with the first matrix.
    factor: RefCell<Option<Result<Factor>>>,
    spare: SharedFactor,
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
    /// A solver for Newton matrices of these equations.
    pub(super) fn new(shared: &Arc<Shared>, options: &Arc<Options>, spare: SharedFactor) -> Self {
        let tally = options.tally.clone();
        let meters = Some([
            tally.meter("solver", "factors of coupled systems"),
            tally.meter("solver", "solutions of coupled systems"),
        ]);
        Self {
            options: Some(Arc::clone(options)),
            shared: Some(Arc::clone(shared)),
            factor: RefCell::default(),
            spare,
            tally,
            meters,
        }
    }

    fn factorised(&self, matrix: ShiftedJacobian<'_>) -> Result<Factor> {
        let _scope = self.meters.as_ref().map(|[factor, _]| factor.uncounted_scope());
        if !matrix.is_finite() {
            return Err(OdeError::NotFinite);
        }
        let spare = || self.spare.lock().unwrap_or_else(PoisonError::into_inner).take();
        let mut factor = match self.factor.take() {
            Some(Ok(factor)) => factor,
            _ => match spare() {
                Some(factor) => factor,
                None => {
                    let options = self.options.as_deref();
                    let choice = options.map_or_else(LinearChoice::default, |o| o.linear);
                    let displacements = options.and_then(|o| o.displacements.as_ref());
                    Factor::new(choice, matrix.jacobian(), displacements)?
                }
            },
        };
        factor.factorise(matrix, &self.tally)?;
        Ok(factor)
    }
}

impl LinearSolver<IterationMatrix> for NewtonSolver {
    fn set_sparsity<C: LaLinearOp<V = Unknowns, T = f64, M = IterationMatrix, C = Grouping>>(
        &mut self,
        _: &C,
    ) {
        self.factor = RefCell::default();
    }

    fn set_linearisation<
        C: LaLinearOp<V = Unknowns, T = f64, M = IterationMatrix, C = Grouping>,
    >(
        &mut self,
        op: &C,
    ) {
        let Some(shared) = &self.shared else { return };
        let mut matrix = IterationMatrix::zeros(op.nrows(), op.ncols(), op.context().clone());
        op.matrix_inplace(&mut matrix);
        let factors = matrix.factors();
        // The Jacobian could not be evaluated: no time is lost on its factor.
        let factor = if factors.iter().all(|factor| factor.is_finite()) {
            shared.with_matrix(factors, |matrix| self.factorised(matrix))
        } else {
            Err(OdeError::NotFinite)
        };
        // The failure is signalled through the solution, diffsol's only channel.
        self.factor = RefCell::new(Some(factor));
    }

    fn solve_in_place(&self, x: &mut Unknowns) -> Result<(), LaError> {
        let x = x.inner_mut().as_mut_slice();
        let begin = |meter: &Meter| {
            if x.len() <= UNTIMED_UNKNOWNS {
                meter.sampled_scope()
            } else {
                meter.uncounted_scope()
            }
        };
        let _scope = self.meters.as_ref().map(|[_, solution]| begin(solution));
        match &mut *self.factor.borrow_mut() {
            Some(Ok(factor)) => {
                factor.solve(x, &self.tally).map_err(|error| LaError::Other(error.to_string()))
            }
            Some(Err(error)) => Err(LaError::Other(error.to_string())),
            None => Err(LaError::Other("the matrix is not factorised".into())),
        }
    }

    fn solve_transpose_in_place(&self, _: &mut Unknowns) -> Result<(), LaError> {
        Err(LaError::Other("transposed systems are not solved".into()))
    }
}
