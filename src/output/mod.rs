//! What a run writes: frames for ParaView, a ledger, and where everything came from.

/// Why something could not be written or read back.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// Placeholder.
    #[error("{0}")]
    Other(String),
}
