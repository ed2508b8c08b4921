//! Time limits of members, and of those that cost far more than all others.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::{Duration, Instant};

use crate::model::Evaluation;
use crate::num::Short;
use crate::output::{Interrupt, RunStatus, Standing};
use crate::run::{Error, Observer, Result, StepInfo, processor_time};
use crate::study::plan::{Plan, Point};

/// A run that has used this share of its time limit …
const EARLY_TIME_SHARE: f64 = 0.2;
/// … and not gone this share of its way is given up.
const MIN_PROGRESS_SHARE: f64 = 0.01;
/// Processor time, s, below which no run is dear.
const CHEAP: f64 = 5.0;
/// Interval between two comparisons of costs.
const INTERVAL: Duration = Duration::from_millis(500);
/// Part of the message of a run that exceeded its time limit.
const LIMIT_MESSAGE: &str = "the time limit of ";

/// The time limit, s, that a member which failed with `reason` was given up for, if that is why.
pub(crate) fn limit_of(reason: &str) -> Option<u64> {
    let (_, limit) = reason.split_once(LIMIT_MESSAGE)?;
    limit.split_once(' ')?.0.parse().ok()
}

/// Directories of the members that differ from member `number` in the first key alone.
pub(super) fn rivals(plan: &Plan, root: &Path, number: usize) -> Vec<PathBuf> {
    let case = |number: usize| plan.members[number].at.get(1..);
    let others = (0..plan.members.len()).filter(|other| *other != number);
    others.filter(|o| case(*o) == case(number)).map(|o| plan.directory(root, o)).collect()
}

/// Ends a run that takes too long.
#[derive(Default)]
pub(super) struct TimeLimit {
    /// The time that the run has reached, as bits.
    reached: AtomicU64,
    /// Why it was ended.
    why: OnceLock<String>,
    /// Whether it is over.
    over: AtomicBool,
}

impl TimeLimit {
    /// Asks the run of `point` to `until` to end when it has taken its time, or sooner if it does not get on, or costs far
    /// more than all `rivals`.
    pub(super) fn watch(
        (point, until): (&Point, f64),
        rivals: Vec<PathBuf>,
        interrupt: Interrupt,
    ) -> Arc<Self> {
        let watch = Arc::new(Self::default());
        let Some(limit) = point.limit else { return watch };
        let (watched, ratio) = (Arc::clone(&watch), point.dearest);
        thread::spawn(move || {
            let (began, all) = (Instant::now(), Duration::from_secs(limit));
            let mut early = Some(all.mul_f64(EARLY_TIME_SHARE));
            let why = loop {
                thread::sleep(INTERVAL.min(all.saturating_sub(began.elapsed())));
                if watched.over.load(Ordering::SeqCst) {
                    return;
                }
                if began.elapsed() >= all {
                    break String::new();
                }
                if early.take_if(|early| began.elapsed() >= *early).is_some()
                    && !watched.gets_on(until)
                {
                    let [way, time] = [MIN_PROGRESS_SHARE, EARLY_TIME_SHARE].map(|s| 100.0 * s);
                    break format!("less than {way} % of its way in {time} % of ");
                }
                if let Some(why) = ratio.and_then(|ratio| dear(processor_time()?, ratio, &rivals)) {
                    break why;
                }
            };
            let _ = watched.why.set(format!("{why}{LIMIT_MESSAGE}{limit} s"));
            interrupt.request();
        });
        watch
    }

    /// Whether the run to `until` has gone some of its way.
    fn gets_on(&self, until: f64) -> bool {
        f64::from_bits(self.reached.load(Ordering::SeqCst)) > MIN_PROGRESS_SHARE * until
    }

    /// The error of a run that is over at `time` because of its limit.
    pub(super) fn error(&self, time: f64) -> Option<Error> {
        self.over.store(true, Ordering::SeqCst);
        let why = self.why.get()?;
        Some(Error::Incomplete(format!("given up at t = {}: {why}", Short(time))))
    }
}

/// That a process which has `spent` this costs more than `ratio` times the dearest complete one of `rivals`.
fn dear(spent: f64, ratio: u64, rivals: &[PathBuf]) -> Option<String> {
    if spent <= CHEAP {
        return None;
    }
    let complete = |path: &PathBuf| {
        Standing::of(path).filter(|s| s.status == RunStatus::Complete).and_then(|s| s.cpu_seconds)
    };
    let dearest = rivals.iter().filter_map(complete).fold(0.0, f64::max);
    #[allow(clippy::cast_precision_loss)]
    let most = ratio as f64 * dearest;
    (dearest > 0.0 && spent > most).then(|| {
        format!(
            "more than {ratio} times the {dearest:.1} s of processor time of the dearest complete run, within "
        )
    })
}

impl Observer for Arc<TimeLimit> {
    fn observe(&mut self, at: &mut Evaluation<'_>, _: &StepInfo<'_>) -> Result<()> {
        self.reached.store(at.state().time.to_bits(), Ordering::SeqCst);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{dear, limit_of};

    #[test]
    fn a_run_is_dear_by_the_dearest_complete_one() {
        let root = tempfile::tempdir().expect("a directory");
        let member = |name: &str, status: &str, seconds: f64| {
            let path = root.path().join(name);
            std::fs::create_dir(&path).expect("a directory");
            let text = format!(r#"{{"status": "{status}", "cpu_seconds": {seconds}}}"#);
            std::fs::write(path.join("status.json"), text).expect("a file");
            path
        };
        let mut all = vec![member("other", "failed", 100.0), root.path().join("none")];
        assert_eq!(dear(1e6, 5, &all), None);
        all.extend([member("a", "complete", 1.0), member("b", "complete", 4.0)]);
        assert_eq!(dear(19.0, 5, &all), None);
        let why = dear(21.0, 5, &all).expect("dear");
        assert!(why.contains("5 times the 4.0 s"), "{why}");
        assert_eq!(
            limit_of(&format!("given up at t = 1: {why}the time limit of 300 s")),
            Some(300)
        );
        // What is cheap is never dear.
        all.truncate(3);
        assert_eq!(dear(4.9, 5, &all), None);
    }
}
