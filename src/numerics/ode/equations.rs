//! A system as diffsol wants to see it.

use std::sync::{Arc, Mutex, PoisonError};

use diffsol::{
    ConstantOp, LinearOp, NonLinearOp, NonLinearOpJacobian, OdeEquations, OdeEquationsRef,
    OdeSolverProblem, Op, ParameterisedOp, UnitCallable, Vector, VectorCommon,
};

use super::OdeError;
use super::error_norm::Grouping;
use super::iteration_matrix::{Inner, IterationMatrix, Shared};
use super::unknowns::Unknowns;
use crate::ode::OdeProblem;

/// A problem with the side channel of errors.
pub(super) struct Equations {
    shared: Arc<Shared>,
    /// Until the first integrator has begun there.
    start: Mutex<Vec<f64>>,
    /// The slope of a start with unknowns without storage, and when that is.
    slope: Mutex<Option<(f64, Vec<f64>)>>,
    unknowns: usize,
    context: Grouping,
    nothing: Unknowns,
}

/// The absolute tolerances of a problem.
pub(super) fn tolerances(problem: &OdeSolverProblem<Equations>) -> &[f64] {
    problem.atol.inner().as_slice()
}

impl Equations {
    /// The equations of `problem` from `start`.
    pub(super) fn new(problem: Box<dyn OdeProblem>, start: Vec<f64>, context: Grouping) -> Self {
        let differential = problem.differential();
        let inner = Mutex::new(Inner { problem, error: None, failed_at: f64::NAN });
        Self {
            unknowns: start.len(),
            shared: Arc::new(Shared { inner, differential }),
            start: Mutex::new(start),
            slope: Mutex::new(None),
            nothing: Unknowns::zeros(0, context.clone()),
            context,
        }
    }

    /// What the linear solver needs.
    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    /// The start.
    pub(super) fn init_vector(&self) -> Unknowns {
        self.init().call(0.0)
    }

    /// Sets the slope of the unknowns at a start.
    pub(super) fn set_slope(&self, time: f64, slope: Option<Vec<f64>>) {
        let slope = slope.map(|slope| (time, slope));
        *self.slope.lock().unwrap_or_else(PoisonError::into_inner) = slope;
    }

    /// The slope of the start at `time`, where one was set.
    pub(super) fn slope_at(&self, time: f64) -> Option<Vec<f64>> {
        let slope = self.slope.lock().unwrap_or_else(PoisonError::into_inner);
        slope.as_ref().filter(|slope| slope.0 == time).map(|slope| slope.1.clone())
    }

    /// Every later integrator begins at a given state.
    pub(super) fn forget_start(&self) {
        *self.start.lock().unwrap_or_else(PoisonError::into_inner) = Vec::new();
    }

    /// Works with the problem.
    pub(super) fn with<R>(&self, f: impl FnOnce(&mut dyn OdeProblem) -> R) -> R {
        f(&mut *self.shared.lock().problem)
    }

    /// The first error since the last call.
    pub(super) fn take_error(&self) -> Option<OdeError> {
        self.shared.lock().error.take()
    }

    /// The time of the last error.
    pub(super) fn failed_at(&self) -> f64 {
        self.shared.lock().failed_at
    }

    /// Which rows have storage; `None` if all have.
    pub(super) fn differential(&self) -> Option<&[bool]> {
        self.shared.differential.as_deref()
    }

    fn evaluate(&self, y: &Unknowns, time: f64, out: &mut Unknowns) {
        let shared = &mut *self.shared.lock();
        let out = out.inner_mut().as_mut_slice();
        // After an error that no shorter step cures nothing more is worth evaluating.
        let hopeless = shared.error.as_ref().is_some_and(|e| !e.is_recoverable());
        let y = y.inner().as_slice();
        let done = if hopeless {
            out.fill(f64::NAN);
            return;
        } else if y.iter().all(|y| y.is_finite()) {
            shared.problem.rhs(time, y, out).map_err(OdeError::from)
        } else {
            Err(OdeError::NotFinite)
        };
        if let Err(error) = done {
            out.fill(f64::NAN);
            shared.failed_at = time;
            shared.error.get_or_insert(error);
        }
    }

    /// Evaluates ∂F/∂y where the problem keeps it; whether there is one.
    fn differentiate(&self, y: &Unknowns, time: f64) -> bool {
        let shared = &mut *self.shared.lock();
        if shared.error.as_ref().is_some_and(|e| !e.is_recoverable()) {
            return false;
        }
        match shared.problem.jacobian(time, y.inner().as_slice()) {
            Ok(_) => true,
            Err(error) => {
                shared.failed_at = time;
                shared.error.get_or_insert(error.into());
                false
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
            type V = Unknowns;
            type M = IterationMatrix;
            type C = Grouping;

            fn context(&self) -> &Grouping {
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
    fn call_inplace(&self, y: &Unknowns, time: f64, out: &mut Unknowns) {
        self.0.evaluate(y, time, out);
    }
}

impl NonLinearOpJacobian for RightHandSide<'_> {
    fn jac_mul_inplace(&self, y: &Unknowns, time: f64, v: &Unknowns, out: &mut Unknowns) {
        if self.0.differentiate(y, time) {
            let (v, out) = (v.inner().as_slice(), out.inner_mut().as_mut_slice());
            self.0.with(|problem| problem.last_jacobian().multiply(v, out));
        } else {
            out.fill(f64::NAN);
        }
    }

    fn jacobian_inplace(&self, y: &Unknowns, time: f64, matrix: &mut IterationMatrix) {
        let there = self.0.differentiate(y, time);
        matrix.set(&self.0.shared, [0.0, if there { 1.0 } else { f64::NAN }]);
    }
}

impl LinearOp for Mass<'_> {
    fn gemv_inplace(&self, x: &Unknowns, _: f64, beta: f64, y: &mut Unknowns) {
        let (x, y) = (x.inner().as_slice(), y.inner_mut().as_mut_slice());
        for (i, (x, y)) in x.iter().zip(y).enumerate() {
            *y = self.0.shared.mass(i) * x + beta * *y;
        }
    }

    fn matrix_inplace(&self, _: f64, matrix: &mut IterationMatrix) {
        matrix.set(&self.0.shared, [1.0, 0.0]);
    }
}

impl ConstantOp for Start<'_> {
    fn call_inplace(&self, _: f64, y: &mut Unknowns) {
        let start = self.0.start.lock().unwrap_or_else(PoisonError::into_inner);
        let y = y.inner_mut().as_mut_slice();
        if start.len() == y.len() {
            y.copy_from_slice(&start);
        }
    }
}

impl Op for Equations {
    type T = f64;
    type V = Unknowns;
    type M = IterationMatrix;
    type C = Grouping;

    fn context(&self) -> &Grouping {
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

type Unused<'a> = ParameterisedOp<'a, UnitCallable<IterationMatrix>>;

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
        self.shared.differential.is_some().then_some(Mass(self))
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

    fn set_params(&mut self, p: &Unknowns) {
        self.nothing.copy_from(p);
    }

    fn get_params(&self, p: &mut Unknowns) {
        p.copy_from(&self.nothing);
    }
}
