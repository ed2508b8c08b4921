//! Solvers: mechanical equilibrium, coupled stepping, linear systems.

/// Why a solver stopped without a result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// Placeholder.
    #[error("{0}")]
    Other(String),
}

/// The integrator of a scene that names none.
pub const DEFAULT_INTEGRATOR: &str = "staggered";

/// The equilibrium method of a scene that names none.
pub const DEFAULT_EQUILIBRIUM: &str = "lbfgs";

/// A way to advance in time as a scene names it.
#[typetag::serde(tag = "kind")]
pub trait IntegratorSpec: std::fmt::Debug + Send + Sync {
    /// What the integrator is called in results.
    fn name(&self) -> String;
}

/// A way to find mechanical equilibrium as a scene names it.
#[typetag::serde(tag = "method")]
pub trait EquilibriumSpec: std::fmt::Debug + Send + Sync {
    /// What the method is called in results.
    fn name(&self) -> String;
}
