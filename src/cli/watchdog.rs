//! Ends the program when a plugin does not come back.

use std::process;
use std::thread;
use std::time::Duration;

use crate::kinetics::overdue;

/// Between two looks.
const PAUSE: Duration = Duration::from_millis(250);

/// Begins to watch, for good. What a run has written until then is whole.
pub(super) fn start(limit: f64) {
    let Ok(limit) = Duration::try_from_secs_f64(limit) else { return };
    // Without a thread to spare there is no watch, and nothing else is lost.
    let _ = thread::Builder::new().name("watchdog".into()).spawn(move || {
        loop {
            thread::sleep(PAUSE);
            if let Some(call) = overdue(limit) {
                super::warn(&format!(
                    "error: {call} (--plugin-limit); what was written until now is whole"
                ));
                end();
            }
        }
    });
}

/// A thread inside a plugin can be stopped no other way.
#[allow(clippy::exit)]
fn end() -> ! {
    process::exit(1)
}
