//! The time limit of a member.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use crate::model::Evaluation;
use crate::num::Short;
use crate::output::Interrupt;
use crate::run::{Error, Observer, Result, StepInfo};

/// A run that has used this share of its time limit …
const SOON: f64 = 0.2;
/// … and not gone this share of its way is given up.
const LITTLE: f64 = 0.01;

/// Ends a run that takes too long.
#[derive(Default)]
pub(super) struct TimeLimit {
    /// The time that the run has reached, as bits.
    reached: AtomicU64,
    /// Whether it was ended, and whether for going too little of its way.
    expired: AtomicBool,
    early: AtomicBool,
}

impl TimeLimit {
    /// Asks the run to `until` to end when it has taken `limit` seconds, or sooner if it does not get on.
    pub(super) fn watch(limit: Option<u64>, until: f64, interrupt: Interrupt) -> Arc<Self> {
        let watch = Arc::new(Self::default());
        if let Some(limit) = limit {
            let watched = Arc::clone(&watch);
            thread::spawn(move || {
                let all = Duration::from_secs(limit);
                thread::sleep(all.mul_f64(SOON));
                if f64::from_bits(watched.reached.load(Ordering::SeqCst)) > LITTLE * until {
                    thread::sleep(all.mul_f64(1.0 - SOON));
                } else {
                    watched.early.store(true, Ordering::SeqCst);
                }
                watched.expired.store(true, Ordering::SeqCst);
                interrupt.request();
            });
        }
        watch
    }

    /// The error of a run that was ended at `time` because of the `limit`.
    pub(super) fn error(&self, time: f64, limit: Option<u64>) -> Option<Error> {
        let limit = limit.filter(|_| self.expired.load(Ordering::SeqCst))?;
        let time = Short(time);
        let why = match self.early.load(Ordering::SeqCst) {
            false => String::new(),
            true => format!("less than {} % of its way in {} % of ", 100.0 * LITTLE, 100.0 * SOON),
        };
        Some(Error::Incomplete(format!("given up at t = {time}: {why}{LIMIT}{limit} s")))
    }
}

/// How a run that took too long says so.
const LIMIT: &str = "the time limit of ";

/// The time limit, s, that a member which failed with `reason` was given up for, if that is why.
pub(crate) fn limit_of(reason: &str) -> Option<u64> {
    let (_, limit) = reason.split_once(LIMIT)?;
    limit.split_once(' ')?.0.parse().ok()
}

impl Observer for Arc<TimeLimit> {
    fn observe(&mut self, at: &mut Evaluation<'_>, _: &StepInfo<'_>) -> Result<()> {
        self.reached.store(at.state().time.to_bits(), Ordering::SeqCst);
        Ok(())
    }
}
