//! A system as diffsol wants to see it.

use std::any::Any;
use std::sync::{Mutex, PoisonError};

use diffsol::{
    ConstantOp, FaerContext, FaerSparseMat, FaerVec, LinearOp, Matrix, NonLinearOp,
    NonLinearOpJacobian, OdeEquations, OdeEquationsRef, Op, ParameterisedOp, UnitCallable, Vector,
    VectorCommon,
};
use faer::sparse::SymbolicSparseColMat;

use super::{Failure, OdeError, Result};
use crate::linear::Sparse;

/// `M dy/dt = F(t, y)`, M diagonal with nothing but ones and zeros.
pub trait OdeProblem: Any + Send {
    /// Number of unknowns.
    fn unknowns(&self) -> usize;

    /// Which rows have storage; `None` if all have.
    fn stored(&self) -> Option<Vec<bool>>;

    /// Writes F.
    ///
    /// # Errors
    /// If F cannot be evaluated there.
    fn residual(&mut self, time: f64, y: &[f64], out: &mut [f64]) -> Result<(), Failure>;

    /// ∂F/∂y; the pattern is always the same.
    ///
    /// # Errors
    /// If it cannot be evaluated there.
    fn jacobian(&mut self, time: f64, y: &[f64]) -> Result<&Sparse, Failure>;
}

/// A problem with its pattern and the side channel of errors.
pub(super) struct Equations {
    shared: Mutex<Shared>,
    start: Vec<f64>,
    unknowns: usize,
    context: FaerContext,
    nothing: FaerVec<f64>,
    pattern: Option<SymbolicSparseColMat<usize>>,
    /// For every entry by columns its place by rows.
    place: Vec<u32>,
    stored: Option<Vec<bool>>,
}

struct Shared {
    problem: Box<dyn OdeProblem>,
    error: Option<OdeError>,
}

impl Equations {
    /// The equations of `problem` from `start` at `time`; with `jacobian` if the method is implicit.
    ///
    /// # Errors
    /// If the derivatives cannot be evaluated at the start.
    pub(super) fn new(
        mut problem: Box<dyn OdeProblem>,
        time: f64,
        start: Vec<f64>,
        jacobian: bool,
    ) -> Result<Self> {
        let context = FaerContext::default();
        let (mut pattern, mut place) = (None, Vec::new());
        if jacobian {
            let matrix = problem.jacobian(time, &start)?;
            let (starts, rows, places) = matrix.by_columns();
            let (n, m) = (matrix.rows(), matrix.columns());
            pattern = Some(SymbolicSparseColMat::new_checked(n, m, starts, None, rows));
            place = places;
        }
        Ok(Self {
            unknowns: start.len(),
            stored: problem.stored(),
            shared: Mutex::new(Shared { problem, error: None }),
            start,
            context,
            nothing: FaerVec::zeros(0, context),
            pattern,
            place,
        })
    }

    /// Works with the problem.
    pub(super) fn with<R>(&self, f: impl FnOnce(&mut dyn OdeProblem) -> R) -> R {
        f(&mut *self.lock().problem)
    }

    /// The first error since the last call.
    pub(super) fn take_error(&self) -> Option<OdeError> {
        self.lock().error.take()
    }

    /// Which rows have storage; `None` if all have.
    pub(super) fn stored(&self) -> Option<&[bool]> {
        self.stored.as_deref()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn evaluate(&self, y: &FaerVec<f64>, time: f64, out: &mut FaerVec<f64>) {
        let shared = &mut *self.lock();
        let out = out.inner_mut().col_as_slice_mut(0);
        // After an error that no shorter step cures nothing more is worth evaluating.
        let hopeless = shared.error.as_ref().is_some_and(|e| !e.is_recoverable());
        let y = y.inner().col_as_slice(0);
        let done = if hopeless {
            out.fill(f64::NAN);
            return;
        } else if y.iter().all(|y| y.is_finite()) {
            shared.problem.residual(time, y, out).map_err(OdeError::from)
        } else {
            Err(OdeError::NotFinite)
        };
        if let Err(error) = done {
            out.fill(f64::NAN);
            shared.error.get_or_insert(error);
        }
    }

    fn differentiate(&self, y: &FaerVec<f64>, time: f64, matrix: &mut FaerSparseMat<f64>) {
        let shared = &mut *self.lock();
        let values = matrix.inner_mut()[0].val_mut();
        let y = y.inner().col_as_slice(0);
        match shared.problem.jacobian(time, y) {
            Ok(jacobian) => {
                let from = jacobian.values();
                for (value, place) in values.iter_mut().zip(&self.place) {
                    *value = from[*place as usize];
                }
            }
            Err(error) => {
                values.fill(f64::NAN);
                shared.error.get_or_insert(error.into());
            }
        }
    }
}

macro_rules! operator {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        pub(super) struct $name<'a>(&'a Equations);

        impl Op for $name<'_> {
            type T = f64;
            type V = FaerVec<f64>;
            type M = FaerSparseMat<f64>;
            type C = FaerContext;

            fn context(&self) -> &FaerContext {
                &self.0.context
            }
            fn nstates(&self) -> usize {
                self.0.unknowns
            }
            fn nout(&self) -> usize {
                self.0.unknowns
            }
            fn nparams(&self) -> usize {
                0
            }
        }
    };
}

operator!(
    /// F and ∂F/∂y.
    RightHandSide
);
operator!(
    /// M.
    Mass
);
operator!(
    /// The start.
    Start
);

impl NonLinearOp for RightHandSide<'_> {
    fn call_inplace(&self, y: &FaerVec<f64>, time: f64, out: &mut FaerVec<f64>) {
        self.0.evaluate(y, time, out);
    }
}

impl NonLinearOpJacobian for RightHandSide<'_> {
    fn jac_mul_inplace(
        &self,
        y: &FaerVec<f64>,
        time: f64,
        v: &FaerVec<f64>,
        out: &mut FaerVec<f64>,
    ) {
        let matrix = self.jacobian(y, time);
        matrix.gemv(1.0, v, 0.0, out);
    }

    fn jacobian_inplace(&self, y: &FaerVec<f64>, time: f64, matrix: &mut FaerSparseMat<f64>) {
        self.0.differentiate(y, time, matrix);
    }

    fn jacobian_sparsity(&self) -> Option<SymbolicSparseColMat<usize>> {
        self.0.pattern.clone()
    }
}

impl Mass<'_> {
    fn diagonal(&self, i: usize) -> f64 {
        self.0.stored.as_ref().map_or(1.0, |stored| if stored[i] { 1.0 } else { 0.0 })
    }
}

impl LinearOp for Mass<'_> {
    fn gemv_inplace(&self, x: &FaerVec<f64>, _: f64, beta: f64, y: &mut FaerVec<f64>) {
        let (x, y) = (x.inner().col_as_slice(0), y.inner_mut().col_as_slice_mut(0));
        for (i, (x, y)) in x.iter().zip(y).enumerate() {
            *y = self.diagonal(i) * x + beta * *y;
        }
    }

    fn matrix_inplace(&self, _: f64, matrix: &mut FaerSparseMat<f64>) {
        for (i, value) in matrix.inner_mut()[0].val_mut().iter_mut().enumerate() {
            *value = self.diagonal(i);
        }
    }

    fn sparsity(&self) -> Option<SymbolicSparseColMat<usize>> {
        let n = self.0.unknowns;
        let (starts, rows) = ((0..=n).collect(), (0..n).collect());
        Some(SymbolicSparseColMat::new_checked(n, n, starts, None, rows))
    }
}

impl ConstantOp for Start<'_> {
    fn call_inplace(&self, _: f64, y: &mut FaerVec<f64>) {
        y.inner_mut().col_as_slice_mut(0).copy_from_slice(&self.0.start);
    }
}

impl Op for Equations {
    type T = f64;
    type V = FaerVec<f64>;
    type M = FaerSparseMat<f64>;
    type C = FaerContext;

    fn context(&self) -> &FaerContext {
        &self.context
    }
    fn nstates(&self) -> usize {
        self.unknowns
    }
    fn nout(&self) -> usize {
        self.unknowns
    }
    fn nparams(&self) -> usize {
        0
    }
}

type Unused<'a> = ParameterisedOp<'a, UnitCallable<FaerSparseMat<f64>>>;

impl<'a> OdeEquationsRef<'a> for Equations {
    type Mass = Mass<'a>;
    type Rhs = RightHandSide<'a>;
    type Root = Unused<'a>;
    type Init = Start<'a>;
    type Out = Unused<'a>;
    type Reset = Unused<'a>;
}

impl OdeEquations for Equations {
    fn rhs(&self) -> RightHandSide<'_> {
        RightHandSide(self)
    }

    fn mass(&self) -> Option<Mass<'_>> {
        self.stored.is_some().then_some(Mass(self))
    }

    fn root(&self) -> Option<Unused<'_>> {
        None
    }

    fn out(&self) -> Option<Unused<'_>> {
        None
    }

    fn reset(&self) -> Option<Unused<'_>> {
        None
    }

    fn init(&self) -> Start<'_> {
        Start(self)
    }

    fn set_params(&mut self, p: &FaerVec<f64>) {
        self.nothing.copy_from(p);
    }

    fn get_params(&self, p: &mut FaerVec<f64>) {
        p.copy_from(&self.nothing);
    }
}
