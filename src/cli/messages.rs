//! Messages on standard error.

use std::io::Write;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

/// Progress message on standard error, while this value lives.
pub(super) struct Waiting {
    /// Whose end is seen.
    _end: Option<mpsc::Sender<()>>,
}

impl Waiting {
    /// Nothing is said in the first seconds, nor ever where `silent`.
    pub(super) fn on(what: &'static str, silent: bool) -> Self {
        const WARNING_INTERVAL: Duration = Duration::from_secs(4);
        let (end, ended) = mpsc::channel();
        let watch = move || {
            let began = Instant::now();
            while ended.recv_timeout(WARNING_INTERVAL) == Err(mpsc::RecvTimeoutError::Timeout) {
                warn(&format!("{what}, for {:.0} s so far", began.elapsed().as_secs_f64()));
            }
        };
        // Without a thread, no message.
        let told = !silent && thread::Builder::new().spawn(watch).is_ok();
        Self { _end: told.then_some(end) }
    }
}

/// Prints a line on standard error, whether anybody reads it or not.
pub(super) fn warn(text: &str) {
    let _ = writeln!(std::io::stderr(), "{}", text.trim_end());
}
