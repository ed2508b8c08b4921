//! Reaction kinetics as the engine sees them: one trait, whoever wrote the law.

/// Why kinetics could not be loaded or evaluated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum KineticsError {
    /// Placeholder.
    #[error("{0}")]
    Other(String),
}
