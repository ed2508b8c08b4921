//! Ends the program when a plugin does not come back, and says so when one ends it.

use std::thread;
use std::time::Duration;

use crate::kinetics::{ended, guard, leave, overdue};
use crate::output::{RunStatus, claim};

/// Between two looks.
const PAUSE: Duration = Duration::from_millis(50);

/// Begins to watch, for good; a call may take `limit` seconds, or for ever if that is not a time.
pub(super) fn start(limit: f64) {
    let limit = Duration::try_from_secs_f64(limit).unwrap_or(Duration::MAX);
    let watch = move || loop {
        thread::sleep(PAUSE);
        if let Some(end) = ended() {
            stop(&end.to_string(), "");
        }
        if let Some(call) = overdue(limit) {
            stop(&call.to_string(), " (--plugin-limit)");
        }
    };
    // Without a thread to spare there is no watch, and nothing else is lost.
    if thread::Builder::new().name("watchdog".into()).spawn(watch).is_ok() {
        guard();
    }
}

/// A thread inside a plugin can be stopped no other way. What a run has written until then is whole.
fn stop(reason: &str, hint: &str) -> ! {
    super::warn(&format!("error: {reason}{hint}; files written so far are complete"));
    claim::end_all(RunStatus::Failed, reason);
    leave(1)
}
