//! Systems `M dy/dt = F(t, y)` with sparse Jacobians, integrated by diffsol.
//!
//! This is the one place that knows diffsol. What it asks for and what it lacks is handled here:
//!
//! * its right-hand side returns nothing: the first error of F waits in a side channel, NaN goes
//!   to the solver, and the channel is inspected before a step counts;
//! * its explicit methods' error norm drops NaN, so every accepted step is checked for numbers that
//!   are not finite, and taken back;
//! * its sparse LU panics where a matrix is singular: `NewtonSolver` returns errors instead;
//! * it counts failures of Newton's method over its whole life, with a limit of 50: the limits are
//!   lifted, and the least step, which it takes as absolute, is scaled with the first one;
//! * it finds algebraic rows by zeros on the diagonal of M, and leaves M out of the first slope:
//!   rows with storage are divided by it, so that M has nothing but exact ones and zeros;
//! * it takes the start for consistent, and a time to stop at within round-off of where it is for an
//!   error: the first is made so, the second is where it is;
//! * it would keep three matrices, with 64-bit indices and a pattern each: it is given combinations of M
//!   and ∂F/∂y without numbers, and the linear solver reads ∂F/∂y where it was evaluated.

mod consistent;
mod equations;
mod error_norm;
mod integration;
mod iteration_matrix;
mod newton;
mod stepper;
mod unknown_columns;
mod unknowns;

use std::any::Any;

use serde::{Deserialize, Serialize};

use crate::linear::{Displacements, LinearChoice, LinearError, Sparse};
use crate::tally::Tally;

pub use integration::Integration;

/// Integration methods.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OdeMethod {
    /// Backward differences of variable order 1 to 5.
    #[default]
    Bdf,
    /// Trapezoidal rule and second backward difference, order 2, L-stable.
    TrBdf2,
    /// Singly diagonally implicit Runge-Kutta of order 3, L-stable.
    Esdirk34,
    /// Explicit Runge-Kutta of Tsitouras, order 5.
    Tsit45,
}

impl OdeMethod {
    /// Its name in messages and results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Bdf => "BDF",
            Self::TrBdf2 => "TR-BDF2",
            Self::Esdirk34 => "ESDIRK34",
            Self::Tsit45 => "Tsit45",
        }
    }

    /// Whether it solves linear systems.
    #[must_use]
    pub(crate) fn is_implicit(self) -> bool {
        self != Self::Tsit45
    }
}

/// Why an integration stopped, or a value was not found.
#[derive(Debug, thiserror::Error)]
pub enum OdeError {
    /// The problem has no value or no derivatives somewhere, or refuses a solution.
    #[error(transparent)]
    Problem {
        /// What it says.
        #[from]
        cause: Failure,
    },
    /// Unknowns or values that are not finite.
    #[error("a value is not a finite number")]
    NotFinite,
    /// A linear system could not be solved.
    #[error(transparent)]
    Linear(#[from] LinearError),
    /// The first rates ask for a step that no other leads on from.
    #[error("the first rates ask for a step of {step:.1e}")]
    TooFast {
        /// The step.
        step: f64,
    },
    /// diffsol gave up.
    #[error("the {method} integrator stopped at time {time}: {message}")]
    Stopped {
        /// Name of the method.
        method: &'static str,
        /// Time reached.
        time: f64,
        /// What it says.
        message: String,
    },
}

/// What a problem says where it has no value.
#[derive(Debug, thiserror::Error)]
#[error("{cause}")]
pub struct Failure {
    /// The reason.
    pub cause: Box<dyn std::error::Error + Send + Sync>,
    /// Whether a smaller step may do without this failure.
    pub recoverable: bool,
}

impl OdeError {
    /// Whether a smaller step may do without this failure.
    #[must_use]
    pub fn is_recoverable(&self) -> bool {
        match self {
            Self::Problem { cause } => cause.recoverable,
            Self::NotFinite | Self::Linear(_) | Self::Stopped { .. } => true,
            Self::TooFast { .. } => false,
        }
    }
}

/// Counts of rejected step attempts.
#[derive(Debug, Default)]
pub struct Rejected {
    /// How many by the error estimate.
    pub error: u64,
    /// How many in Newton's method, with no word of the problem's.
    pub newton: u64,
    /// What the problem had no value for, or refused.
    pub refused: Vec<OdeError>,
}

impl Rejected {
    /// How many they are.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.error + self.newton + self.refused.len() as u64
    }
}

/// Shorthand for results with [`OdeError`].
pub type Result<T, E = OdeError> = std::result::Result<T, E>;

/// Takes a new solution, at a time, or refuses it.
pub type Accept<'a> = dyn FnMut(f64, &[f64]) -> Result<(), Failure> + 'a;

/// `M dy/dt = F(t, y)`, M diagonal with nothing but ones and zeros.
pub trait OdeProblem: Any + Send {
    /// Number of unknowns.
    fn unknowns(&self) -> usize;

    /// Which rows are differential equations, with a one in M; `None` if all are. The others are algebraic.
    fn differential(&self) -> Option<Vec<bool>>;

    /// Writes F.
    ///
    /// # Errors
    /// If F cannot be evaluated there.
    fn rhs(&mut self, time: f64, y: &[f64], out: &mut [f64]) -> Result<(), Failure>;

    /// ∂F/∂y; the pattern is always the same.
    ///
    /// # Errors
    /// If it cannot be evaluated there.
    fn jacobian(&mut self, time: f64, y: &[f64]) -> Result<&Sparse, Failure>;

    /// ∂F/∂y as it was last evaluated.
    fn last_jacobian(&self) -> &Sparse;
}

/// How a problem is to be integrated.
#[derive(Debug, Clone)]
pub struct Options {
    /// The method.
    pub method: OdeMethod,
    /// The linear solver of implicit methods.
    pub linear: LinearChoice,
    /// Unknowns that are displacements, if there are any.
    pub displacements: Option<Displacements>,
    /// Relative tolerance.
    pub rtol: f64,
    /// Absolute tolerances; taken out where an integration begins.
    pub atol: Vec<f64>,
    /// First step; chosen by the first slopes if not given.
    pub step: Option<f64>,
    /// A length of time that matters at first, for the least step and where slopes say nothing.
    pub span: f64,
    /// Where the work of Newton's method is counted.
    pub tally: Tally,
}
