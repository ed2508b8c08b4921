//! The crate's error: every failure that a user, a file or a plugin can cause.

use crate::kinetics::KineticsError;
use crate::output::OutputError;
use crate::scene::SceneError;
use crate::sheet::SheetError;
use crate::solve::SolveError;

/// Anything that can go wrong, with its place in the message.
#[derive(Debug, thiserror::Error)]
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
    Solve(#[from] SolveError),
    /// A result could not be written or a state not be read.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Shorthand for results with the crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;
