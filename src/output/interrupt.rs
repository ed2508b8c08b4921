//! Ctrl-C and SIGTERM as a question that a run asks after every step.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use super::OutputError;

static REQUESTED: AtomicBool = AtomicBool::new(false);
static INSTALLED: OnceLock<Result<(), String>> = OnceLock::new();

/// The exit status of a process that a second Ctrl-C ended (128 + SIGINT, as shells have it).
const KILLED: i32 = 130;

/// A handle that tells whether the user asked to stop.
///
/// The first signal only sets the flag, so that the current step ends and all files are whole;
/// the second ends the process at once.
#[derive(Debug, Clone, Copy)]
pub struct Interrupt(());

impl Interrupt {
    /// Begins to watch for signals; later calls return the same watch.
    ///
    /// # Errors
    /// [`OutputError::Interrupt`] if the system refuses the handler.
    pub fn install() -> Result<Self, OutputError> {
        INSTALLED
            .get_or_init(|| {
                ctrlc::set_handler(|| {
                    if REQUESTED.swap(true, Ordering::SeqCst) {
                        kill();
                    }
                })
                .map_err(|e| e.to_string())
            })
            .clone()
            .map(|()| Self(()))
            .map_err(OutputError::Interrupt)
    }

    /// Whether a signal came.
    #[must_use]
    pub fn requested(self) -> bool {
        REQUESTED.load(Ordering::SeqCst)
    }
}

/// The user insists: a run that does not come to the end of its step can be stopped no other way.
#[allow(clippy::exit)]
fn kill() {
    std::process::exit(KILLED);
}
