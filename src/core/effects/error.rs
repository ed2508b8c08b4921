//! Errors of the parameters of effects, and of their values at a state.

/// A parameter of an effect that does not fit, with the key to blame.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct EffectError {
    /// The key in the effect's table.
    pub key: &'static str,
    /// What is wrong.
    pub message: String,
    /// What would be right.
    pub help: Option<String>,
}

/// An inadmissible coefficient or rate: not finite or, of a species by itself, negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WrongCoefficient {
    /// Number of the point.
    pub point: usize,
    /// The coefficient there.
    pub value: f64,
}
