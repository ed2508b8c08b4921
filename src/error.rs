//! The crate's error: every failure that a user, a file or a plugin can cause.

use crate::kinetics::KineticsError;
use crate::output::OutputError;
use crate::scene::SceneError;
use crate::sheet::SheetError;
use crate::simulation::run::Failure;
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
    /// A run could not go on; says when and where the last good state is.
    #[error(transparent)]
    Stopped(#[from] Failure),
    /// A command cannot do what it was asked, and why.
    #[error("{0}")]
    Refused(String),
}

/// Shorthand for results with the crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// Whether a shorter time step may do without this failure: a relaxation that got stuck on
    /// the way, a chemistry that changed too fast, a plugin that asks for it.
    #[must_use]
    pub fn may_vanish_with_the_step(&self) -> bool {
        match self {
            Self::Solve(error) => {
                !matches!(error, SolveError::Interrupted | SolveError::Pairing(_))
            }
            Self::Kinetics(error) => matches!(
                error,
                KineticsError::Retry { .. }
                    | KineticsError::BadOutput(_)
                    | KineticsError::BadInput { .. }
            ),
            // Optimal lengths that make no triangle.
            Self::Sheet(_) => true,
            Self::Scene(_) | Self::Output(_) | Self::Stopped(_) | Self::Refused(_) => false,
        }
    }
}
