//! Ctrl-C and its like as a question that a run asks after every step.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicI32, Ordering};

use super::{OutputError, RunStatus, lock};

/// The first signal that came, or its negative where something else asked; or none.
static REQUESTED: AtomicI32 = AtomicI32::new(NONE);
static INSTALLED: OnceLock<Result<(), String>> = OnceLock::new();

const NONE: i32 = 0;
/// No signal: the process that this one works for is gone.
const ORPHANED: i32 = i32::MIN;
/// The signal of Ctrl-C, everywhere.
const SIGINT: i32 = 2;
/// The signal that asks a process to end.
const SIGTERM: i32 = 15;

/// A handle that says whether the user asked to stop.
///
/// The first signal only sets the flag, so that the current step ends and all files are whole;
/// the second ends the process at once.
#[derive(Debug, Clone, Copy)]
pub struct Interrupt(&'static AtomicI32);

impl Interrupt {
    /// Begins to watch for signals; later calls return the same watch.
    ///
    /// # Errors
    /// [`OutputError::Interrupt`] if the system refuses the handler.
    pub fn install() -> Result<Self, OutputError> {
        INSTALLED
            .get_or_init(|| system::watch().map_err(|e| e.to_string()))
            .clone()
            .map(|()| Self(&REQUESTED))
            .map_err(OutputError::Interrupt)
    }

    /// For a program with signal handlers of its own: watches for none; only [`Interrupt::request`] and
    /// [`Interrupt::pass_on`] stop runs.
    #[must_use]
    pub fn on_request() -> Self {
        Self(&REQUESTED)
    }

    /// The same for one run of a program that makes several: a request ends the runs with this handle, and no others.
    /// It is never freed: 4 bytes for as long as the program runs.
    #[must_use]
    pub fn of_one_run() -> Self {
        Self(Box::leak(Box::new(AtomicI32::new(NONE))))
    }

    /// Asks to stop as SIGTERM does, unless that was requested before.
    pub fn request(self) {
        self.pass_on(Some(SIGTERM));
    }

    /// Asks to stop, unless that was requested before, because the process that this one works for was given
    /// `signal`, or is gone without a word. A signal of its own may follow, as Ctrl-C goes to both, and is
    /// still the first.
    pub fn pass_on(self, signal: Option<i32>) {
        let passed_on = signal.map_or(ORPHANED, |signal| -signal);
        let _ = self.0.compare_exchange(NONE, passed_on, Ordering::SeqCst, Ordering::SeqCst);
    }

    /// The signal that came, if one did: what [`Interrupt::pass_on`] takes.
    #[must_use]
    pub fn signal(self) -> Option<i32> {
        match self.0.load(Ordering::SeqCst) {
            NONE | ORPHANED => None,
            signal => Some(signal.abs()),
        }
    }

    /// Whether a signal came.
    #[must_use]
    pub fn requested(self) -> bool {
        self.0.load(Ordering::SeqCst) != NONE
    }
}

/// The exit status of a process that a signal ended, 128 and its number as shells have it: of the
/// one that came, or of Ctrl-C; of an orphan that of SIGTERM.
#[must_use]
pub fn exit_status() -> u8 {
    status_of(match REQUESTED.load(Ordering::SeqCst) {
        NONE => SIGINT,
        ORPHANED => SIGTERM,
        signal => signal.abs(),
    })
}

fn status_of(signal: i32) -> u8 {
    u8::try_from(signal).unwrap_or(0).saturating_add(128)
}

/// What a run says of its end by a signal.
#[must_use]
pub fn reason() -> &'static str {
    match exit_status() {
        _ if REQUESTED.load(Ordering::SeqCst) == ORPHANED => "the process that began it is gone",
        129 => "the terminal was closed (SIGHUP)",
        143 => "asked to end (SIGTERM)",
        138 => "asked to end (SIGUSR1)",
        140 => "asked to end (SIGUSR2)",
        152 => "the processor time that it may take is used up (SIGXCPU)",
        _ => "interrupted (SIGINT)",
    }
}

/// Whether this is the first signal; the second ends the process: the user insists, and a run that
/// does not come to the end of its step can be stopped no other way.
fn came(signal: i32) -> bool {
    let first = REQUESTED.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |before| {
        (before <= NONE).then_some(signal)
    });
    if first.is_err() {
        lock::end_all(RunStatus::Interrupted, "ended by a second signal, in the middle of a step");
    }
    first.is_ok()
}

#[cfg(unix)]
mod system {
    use std::sync::Arc;
    use std::thread;

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1, SIGUSR2, SIGXCPU, SIGXFSZ};
    use signal_hook::iterator::Signals;
    use signal_hook::low_level;

    /// A signal that was ignored when the program began (`nohup`) stays so.
    pub(super) fn watch() -> std::io::Result<()> {
        // Batch systems announce the end of a job's time by the last three.
        let mut watched = vec![SIGINT, SIGTERM, SIGUSR1, SIGUSR2, SIGXCPU];
        if hangup_counts() {
            watched.push(SIGHUP);
        }
        // A file beyond the limit of its size (`ulimit -f`) is then an error of writing, which is reported.
        signal_hook::flag::register(SIGXFSZ, Arc::default())?;
        let mut signals = Signals::new(watched)?;
        thread::Builder::new().name("signals".into()).spawn(move || {
            for signal in signals.forever() {
                if !super::came(signal) {
                    low_level::exit(super::status_of(signal).into());
                }
            }
        })?;
        Ok(())
    }

    /// Whether SIGHUP is known not to be ignored. Where that cannot be determined it is left
    /// unchanged, which ends the program or, if it is ignored, does not.
    fn hangup_counts() -> bool {
        let Ok(text) = std::fs::read_to_string("/proc/self/status") else { return false };
        let ignored = text.lines().find_map(|line| line.strip_prefix("SigIgn:"));
        let mask = ignored.and_then(|digits| u64::from_str_radix(digits.trim(), 16).ok());
        mask.is_some_and(|mask| mask & (1 << (SIGHUP - 1)) == 0)
    }
}

#[cfg(not(unix))]
mod system {
    pub(super) fn watch() -> Result<(), ctrlc::Error> {
        ctrlc::set_handler(|| {
            if !super::came(super::SIGINT) {
                end();
            }
        })
    }

    #[allow(clippy::exit)]
    fn end() {
        std::process::exit(super::status_of(super::SIGINT).into());
    }
}
