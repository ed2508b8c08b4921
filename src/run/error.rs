//! The error of whole runs: every failure that a user, a file or a plugin can cause.

use std::path::PathBuf;

use super::invariants::BrokenInvariant;
use crate::kinetics::KineticsError;
use crate::model::ModelError;
use crate::output::OutputError;
use crate::scene::SceneError;
use crate::sheet::SheetError;
use crate::solve::SolveError;

/// Anything that can go wrong, with its place in the message.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The scene file is wrong; carries the place in the file.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A mesh could not be made, read or accepted.
    #[error(transparent)]
    Sheet(#[from] SheetError),
    /// A plugin could not be loaded, or one of its calls failed.
    #[error(transparent)]
    Kinetics(#[from] KineticsError),
    /// A solver stopped without a result.
    #[error(transparent)]
    Solve(SolveError),
    /// A law of nature that no step keeps.
    #[error(transparent)]
    Broken(Box<BrokenInvariant>),
    /// A result could not be written or a state not be read.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A run failed; with its time and the place of the last good state.
    #[error(transparent)]
    Stopped(#[from] Failure),
    /// Another rank has failed, and says why.
    #[error("another rank has failed")]
    Elsewhere,
    /// A command cannot do what it was asked, and why.
    #[error("{0}")]
    Refused(String),
    /// Of several runs some did not come to their end.
    #[error("{0}")]
    Incomplete(String),
}

/// As a command prints it: this is what a `main` that returns errors prints.
impl std::fmt::Debug for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Scene(error) => write!(f, "{error:?}"),
            other => write!(f, "{other}"),
        }
    }
}

/// Shorthand for results with the crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl From<ModelError> for Error {
    fn from(error: ModelError) -> Self {
        match error {
            ModelError::Kinetics(error) => Self::Kinetics(error),
            ModelError::Sheet(error) => Self::Sheet(error),
            ModelError::Elsewhere { .. } => Self::Elsewhere,
            other => Self::Solve(SolveError::Model(other)),
        }
    }
}

impl From<BrokenInvariant> for Error {
    fn from(broken: BrokenInvariant) -> Self {
        Self::Broken(Box::new(broken))
    }
}

impl From<SolveError> for Error {
    fn from(error: SolveError) -> Self {
        match error {
            SolveError::Model(error) => error.into(),
            other => Self::Solve(other),
        }
    }
}

/// A run that failed, with what is to be known of it on the disk.
#[derive(Debug, thiserror::Error)]
#[error("{error}\nthe run stopped at time {time}, step {step}; why, and the last good state, are in {}", folder.display())]
pub struct Failure {
    /// What went wrong.
    pub error: Box<Error>,
    /// Time of the last good state.
    pub time: f64,
    /// Step of the last good state.
    pub step: u64,
    /// The vertex to blame.
    pub vertex: Option<usize>,
    /// What was written about it.
    pub folder: PathBuf,
}
