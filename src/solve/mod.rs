//! Solvers: mechanical equilibrium, coupled stepping, linear systems.

pub mod equilibrium;
pub mod linear;

/// Why a solver stopped without a result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// A sparse factorisation could not be set up or done.
    #[error("{0}")]
    Factorisation(String),
    /// Energy or force is not a number.
    #[error(
        "energy or force is not a finite number: a triangle has no area, or positions are not finite"
    )]
    NotFinite,
    /// The force tolerance was not reached.
    #[error(
        "relaxation stopped after {iterations} iterations with a largest force of {residual:.3e} \
         (tolerance {tolerance:.1e}, in units of Y times the edge length)"
    )]
    NotConverged {
        /// Iterations taken.
        iterations: usize,
        /// Largest force left.
        residual: f64,
        /// Force asked for.
        tolerance: f64,
    },
    /// No step goes downhill without collapsing a triangle.
    #[error(
        "relaxation can go no further after {iterations} iterations: no step lowers the energy \
         without collapsing a triangle (largest force {residual:.3e}, tolerance {tolerance:.1e})"
    )]
    Stalled {
        /// Iterations taken.
        iterations: usize,
        /// Largest force left.
        residual: f64,
        /// Force asked for.
        tolerance: f64,
    },
    /// The user asked to stop.
    #[error("interrupted")]
    Interrupted,
}
