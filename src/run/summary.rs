//! How a run ended, and what it did.

use std::time::Duration;

use super::{Error, Result};
use crate::output::{Claim, ResultDirectory, RunStatus, SelfIntersection, interrupt};
use crate::solve::SolveError;
use crate::tally::Spent;

/// Why a run ended.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Ending {
    /// The end time was reached.
    #[default]
    Reached,
    /// No species changed any more.
    Steady,
    /// The scene's number of steps was reached.
    Steps,
    /// An observer ended the run, for this reason.
    Observed(&'static str),
    /// The user asked to stop.
    Interrupted,
}

impl std::fmt::Display for Ending {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Reached => "the end time is reached",
            Self::Steady => "steady: nothing changes any more",
            Self::Steps => "the number of steps is reached",
            Self::Observed(reason) => reason,
            Self::Interrupted => "interrupted; the last accepted state is written",
        })
    }
}

/// What a run did.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Summary {
    /// Why it ended.
    pub ending: Ending,
    /// Time reached.
    pub time: f64,
    /// Frames written.
    pub frames: usize,
    /// Of a run that was interrupted the step from which it can be continued.
    pub resumable: Option<u64>,
    /// The last step.
    pub step: u64,
    /// Steps that ended at an output time before the end, and all steps, of this process.
    pub to_outputs: [u64; 2],
    /// What relaxing the start and all steps have cost.
    pub spent: Spent,
    /// Of these the start.
    pub start: Spent,
    /// Wall time of the whole run.
    pub wall: Duration,
    /// Wall time of writing.
    pub output: Duration,
    /// Of every law of nature that the scene lists the largest value, in words.
    pub invariants: Vec<String>,
    /// Share of the energy supplied that the drag which stabilises a quasi-static shape has taken up outside of snaps.
    pub drag_share: f64,
    /// Whether the sheet passes through itself in the last state; none where no shape moves.
    pub intersection: Option<SelfIntersection>,
}

/// Does `work`, which writes to `directory`, and leaves word there of how it ended.
///
/// # Errors
/// Those of `work`; a status that cannot be written.
pub fn with_status(
    directory: &ResultDirectory,
    work: impl FnOnce() -> Result<Summary>,
) -> Result<Summary> {
    let outcome = work();
    let claim = directory.claim();
    match &outcome {
        Ok(summary) if summary.ending == Ending::Interrupted => {
            claim.end(RunStatus::Interrupted, interrupt::reason())?;
        }
        Ok(summary) => claim.end(RunStatus::Complete, &summary.ending.to_string())?,
        // The first failure is the one to report.
        Err(error) => drop(claim.end(RunStatus::Failed, &error.to_string())),
    }
    outcome
}

/// Records in the directory of a study, claimed by `claim`, how the study ended there.
///
/// # Errors
/// That of `outcome`; a status that cannot be written.
pub(crate) fn end(claim: &Claim, outcome: Result<String>) -> Result<()> {
    let (standing, reason) = match &outcome {
        Ok(reason) => (RunStatus::Complete, reason.clone()),
        Err(Error::Solve(SolveError::Interrupted)) => {
            (RunStatus::Interrupted, interrupt::reason().to_owned())
        }
        Err(error) => (RunStatus::Failed, error.to_string()),
    };
    let ended = claim.end(standing, &reason);
    outcome?;
    Ok(ended?)
}
