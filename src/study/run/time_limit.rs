//! Time limits of members.

use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread;
use std::time::{Duration, Instant};

use crate::num::Short;
use crate::output::Interrupt;
use crate::run::Error;

/// Part of the message of a run that exceeded its time limit.
const LIMIT_MESSAGE: &str = "the time limit of ";

/// The time limit, s, that a member which failed with `reason` was given up for, if that is why.
pub(super) fn limit_of(reason: &str) -> Option<u64> {
    let (_, limit) = reason.split_once(LIMIT_MESSAGE)?;
    limit.split_once(' ')?.0.parse().ok()
}

/// Interrupts a run that takes longer than its limit, until it is dropped.
pub(super) struct TimeLimit {
    began: Instant,
    limit: Option<u64>,
    /// Closed when the run is over.
    _over: Sender<()>,
}

impl TimeLimit {
    /// Interrupts a run that takes longer than `limit`, s.
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

    /// The error of a run that was interrupted at `time`, if its limit did that.
    pub(super) fn error(&self, time: f64) -> Option<Error> {
        let limit = self.limit.filter(|limit| self.began.elapsed().as_secs() >= *limit)?;
        let time = Short(time);
        Some(Error::Incomplete(format!("given up at t = {time}: {LIMIT_MESSAGE}{limit} s")))
    }
}
