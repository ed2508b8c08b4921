//! Solvers: mechanical equilibrium, coupled stepping, linear systems.

/// Why a solver stopped without a result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// Placeholder.
    #[error("{0}")]
    Other(String),
}
