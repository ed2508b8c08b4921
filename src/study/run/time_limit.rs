//! Time limits of members.

use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

use crate::model::Evaluation;
use crate::num::Short;
use crate::output::Interrupt;
use crate::run::run::Ending;
use crate::run::{Error, Observer, Result, StepInfo};

/// Part of the message of a run that exceeded its time limit.
const LIMIT_MESSAGE: &str = "the time limit of ";

/// The time limit, s, that a member which failed with `reason` was given up for, if that is why.
pub(super) fn exceeded_time_limit(reason: &str) -> Option<u64> {
    let (_, limit) = reason.split_once(LIMIT_MESSAGE)?;
    limit.split_once(' ')?.0.parse().ok()
}

/// Ends a run that takes longer than its limit, with an error; a step that is under way is interrupted.
pub(super) struct TimeLimit {
    began: Instant,
    limit: Option<u64>,
    /// Closed when the run is over.
    _over: Sender<()>,
}

impl TimeLimit {
    /// Watches a run that may take `limit`, s, until it is dropped.
    pub(super) fn watch(limit: Option<u64>, interrupt: Interrupt) -> Self {
        let (over, ended) = mpsc::channel::<()>();
        if let Some(limit) = limit {
            thread::spawn(move || {
                let waited = ended.recv_timeout(Duration::from_secs(limit));
                if waited == Err(RecvTimeoutError::Timeout) {
                    interrupt.request();
                }
            });
        }
        Self { began: Instant::now(), limit, _over: over }
    }
}

impl Observer for TimeLimit {
    fn observe(&mut self, _: &mut Evaluation<'_>, _: &StepInfo<'_>) -> Result<()> {
        Ok(())
    }

    fn stop(&mut self, at: &mut Evaluation<'_>) -> Result<Option<Ending>> {
        match self.limit.filter(|limit| self.began.elapsed().as_secs() >= *limit) {
            None => Ok(None),
            Some(limit) => {
                let time = Short(at.state().time);
                let why = format!("given up at t = {time}: {LIMIT_MESSAGE}{limit} s");
                Err(Error::Incomplete(why))
            }
        }
    }
}
