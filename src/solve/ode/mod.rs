//! Systems `M dy/dt = F(t, y)` with sparse Jacobians, integrated by diffsol.
//!
//! This is the one place that knows diffsol. What it asks for and what it lacks is handled here:
//!
//! * its right-hand side returns nothing: the first error of F waits in a side channel, NaN goes
//!   to the solver, and the channel is looked at before a step counts;
//! * its explicit methods' error norm drops NaN, so every accepted step is checked for numbers that
//!   are not finite, and taken back;
//! * its sparse LU panics where a matrix is singular: [`NewtonSolver`] returns errors instead;
//! * it counts failures of Newton's method over its whole life, with a limit of 50: the limits are
//!   lifted, and the least step, which it takes as absolute, is scaled with the first one;
//! * it finds algebraic rows by zeros on the diagonal of M, and leaves M out of the first slope:
//!   rows with storage are divided by it, so that M has nothing but exact ones and zeros;
//! * it takes the start for consistent, and a time to stop at within round-off of where it is for an
//!   error: the first is made so, the second is where it is;
//! * its guess of the pattern by NaN is not used: pattern and values of ∂F/∂y are given.

mod consistent;
mod equations;
mod newton;
mod stepper;

pub use consistent::make_consistent;
pub use equations::{Equations, OdeProblem};
pub use newton::NewtonSolver;
pub use stepper::{Options, Stepper, problem};

use serde::{Deserialize, Serialize};

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
    /// What it is called in messages and results.
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
    pub fn is_implicit(self) -> bool {
        self != Self::Tsit45
    }
}

/// Work of an integration.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct OdeWork {
    /// Accepted steps.
    pub steps: usize,
    /// Tries that the error test or Newton's method rejected.
    pub rejected: usize,
    /// Iterations of Newton's method.
    pub iterations: usize,
    /// Factorisations or set-ups of the linear solver.
    pub factorisations: usize,
}
