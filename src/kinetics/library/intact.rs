//! What a plugin must leave as it is: floating-point arithmetic, the folder, open files, the process.
//!
//! Arithmetic and forks are looked at after every call, which costs some nanoseconds; what costs
//! system calls, after calls that are watched closely. What can be put back is.

mod float;
#[cfg(unix)]
mod process;
#[cfg(not(unix))]
#[path = "intact/no_process.rs"]
mod process;

use std::sync::atomic::{AtomicBool, Ordering};

use float::Float;
use process::Process;
#[cfg(target_os = "linux")]
pub(super) use process::keep;
pub(super) use process::{begin_to_look, closed, moved};

/// Whether every call is watched closely, as in a process that does nothing else.
static CLOSELY: AtomicBool = AtomicBool::new(false);

/// Looks closely at every call of a plugin from now on, whether it changes what it must not: for a
/// process that does nothing else.
pub fn watch_closely() {
    CLOSELY.store(true, Ordering::Relaxed);
}

/// Whether this is a process that does nothing else: all that happens to it is the plugin's doing.
pub(crate) fn alone() -> bool {
    CLOSELY.load(Ordering::Relaxed)
}

/// What there was before a call.
#[derive(Debug)]
pub(super) struct Intact {
    float: Float,
    /// Of the process; not where a copy of it is found without a system call.
    number: Option<u32>,
    forks: usize,
    process: Option<Process>,
}

impl Intact {
    /// Looks before a call, closely or not.
    pub(super) fn before(closely: bool) -> Self {
        let closely = closely || alone();
        Self {
            float: Float::now(),
            number: (closely || !process::marks_copies()).then(process::number),
            forks: process::forks(),
            process: closely.then(Process::now),
        }
    }

    /// Looks after the call, and puts back what can be: what the plugin does that it must not.
    pub(super) fn after(self) -> Option<String> {
        process::end_copies(self.number);
        let float = self.float.restore();
        let forks = (process::forks() != self.forks).then(|| "forks the process".to_owned());
        let process = self.process.and_then(Process::restore);
        float.or(forks).or(process)
    }
}
