//! Lock of a result directory: one writer at a time, and a record of how the run ends.
//!
//! ```text
//! DIR/.lock        locked by the process that writes; the system frees it, however that ends
//! DIR/status.json  running, complete, interrupted or failed; why; the time reached; what that has cost
//! ```
//!
//! A run that is killed stays `running` with its lock free.

use std::fmt;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::SystemTime;

use serde::{Deserialize, Serialize};
use serde_json::{Value, from_value, json, to_value};

use super::{OutputError, atomic, clock};
use rumple_numerics::tally::{Spent, Work};

/// How a run stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunStatus {
    /// In progress.
    Running,
    /// It completed.
    Complete,
    /// The user ended it.
    Interrupted,
    /// It stopped with an error.
    Failed,
}

impl fmt::Display for RunStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Running => "running",
            Self::Complete => "complete",
            Self::Interrupted => "interrupted",
            Self::Failed => "failed",
        })
    }
}

/// How far a run is, and what that has cost.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Reached {
    /// The time reached.
    pub time: f64,
    /// Processor seconds of the initial relaxation and all steps, excluding setup and output.
    #[serde(flatten)]
    pub spent: Spent,
    /// Of these the start.
    pub start: Spent,
    /// Largest resident memory of the process, bytes, where the system says it; known at the end.
    pub peak_resident_bytes: Option<u64>,
    /// Whether the sheet passes through itself in the last output state or the last state of all; none where no shape
    /// moves.
    #[serde(flatten)]
    pub intersection: Option<SelfIntersection>,
    /// What the run has said that a reader of its results should know.
    pub notes: Vec<String>,
}

/// Whether a sheet passes through itself.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SelfIntersection {
    /// Pairs of triangles that cross.
    pub crossings: usize,
    /// Whether a closed sheet encloses its volume from the other side, which it cannot come to otherwise.
    pub inside_out: bool,
}

impl SelfIntersection {
    /// What there is to be said, if there is anything.
    #[must_use]
    pub fn words(self) -> Option<String> {
        Some(match (self.crossings, self.inside_out) {
            (0, false) => return None,
            (0, true) => "the closed sheet is turned inside out, through itself".to_owned(),
            (1, _) => "the sheet passes through itself: 1 pair of triangles crosses".to_owned(),
            (n, _) => format!("the sheet passes through itself: {n} pairs of triangles cross"),
        })
    }
}

/// The right to write to a directory, until it is dropped.
#[derive(Debug)]
pub struct Claim {
    root: PathBuf,
    status: OnceLock<Arc<Status>>,
    /// Locked until it is closed; none where the file system has no locks.
    _lock: Option<File>,
}

impl Claim {
    /// Name of the file that is locked.
    pub const LOCK: &'static str = ".lock";
    /// Name of the file that says how the run stands.
    pub const STATUS: &'static str = "status.json";

    /// Claims the directory `root`, which exists.
    ///
    /// # Errors
    /// [`OutputError::Directory`] if another run writes to it, [`OutputError::Write`] if the lock
    /// cannot be made.
    pub fn take(root: &Path) -> Result<Self, OutputError> {
        let path = root.join(Self::LOCK);
        let refuse = |message: &str| {
            let message = message.to_owned();
            Err(OutputError::Directory { path: root.to_owned(), message })
        };
        if fs::symlink_metadata(&path).is_ok_and(|found| !found.is_file()) {
            return refuse("`.lock` in it is not a regular file");
        }
        let file = OpenOptions::new()
            .create(true)
            .write(true)
            .truncate(false)
            .open(&path)
            .map_err(OutputError::write(&path))?;
        let lock = match file.try_lock() {
            Ok(()) => Some(file),
            Err(TryLockError::WouldBlock) => {
                return refuse("another run is writing to it; choose another with --out");
            }
            Err(TryLockError::Error(_)) => None,
        };
        Ok(Self { root: root.to_owned(), status: OnceLock::new(), _lock: lock })
    }

    /// Whether a process writes to the directory `root`.
    #[must_use]
    pub fn in_use(root: &Path) -> bool {
        let file = File::open(root.join(Self::LOCK));
        file.is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
    }

    /// Records that the run is in progress.
    ///
    /// # Errors
    /// [`OutputError::Write`] if the status cannot be written.
    pub fn begin(&self) -> Result<(), OutputError> {
        let status = self.status.get_or_init(|| {
            let path = self.root.join(Self::STATUS);
            let status = Arc::new(Status {
                path,
                started: clock::iso(SystemTime::now()),
                reached: Mutex::default(),
                open: AtomicBool::new(true),
            });
            STATUSES.lock().unwrap_or_else(PoisonError::into_inner).push(Arc::clone(&status));
            status
        });
        status.write(RunStatus::Running, "")
    }

    /// Records how far the run is.
    pub fn tell(&self, change: impl FnOnce(&mut Reached)) {
        if let Some(status) = self.status.get() {
            change(&mut status.reached.lock().unwrap_or_else(PoisonError::into_inner));
        }
    }

    /// Records what a reader of the results should know, once.
    pub fn note(&self, text: &str) {
        self.tell(|reached| {
            if !reached.notes.iter().any(|note| note == text) {
                reached.notes.push(text.to_owned());
            }
        });
    }

    /// Records how the run ended and why; the first record stands.
    ///
    /// # Errors
    /// [`OutputError::Write`] if the status cannot be written.
    pub fn end(&self, standing: RunStatus, reason: &str) -> Result<(), OutputError> {
        match self.status.get() {
            Some(status) if status.open.swap(false, Ordering::AcqRel) => {
                status.write(standing, reason)
            }
            _ => Ok(()),
        }
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        // A caller that ends without a record has reported the reason.
        let _ = self.end(RunStatus::Failed, "it was given up");
    }
}

/// What the directory of a run says of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Standing {
    /// How it stands; what was killed is `running` and not in use.
    pub status: RunStatus,
    /// Why.
    pub reason: String,
    /// The time reached when that was written.
    pub time: f64,
    /// Work up to then.
    pub work: Option<Work>,
    /// Of that the start.
    pub start: Option<Work>,
    /// Processor time of that work, s.
    pub cpu_seconds: Option<f64>,
    /// Of that the start, s.
    pub start_seconds: Option<f64>,
    /// Largest resident memory of the process, bytes.
    pub peak_resident_bytes: Option<u64>,
    /// Whether its sheet passes through itself.
    pub intersection: Option<SelfIntersection>,
    /// What the run has said that a reader of its results should know.
    pub notes: Vec<String>,
    /// Whether a process writes to the directory.
    pub in_use: bool,
}

impl Standing {
    /// Of the run in the directory `root`; none where no run has begun.
    #[must_use]
    pub fn read(root: &Path) -> Option<Self> {
        let text = fs::read_to_string(root.join(Claim::STATUS)).ok()?;
        let mut about: Value = serde_json::from_str(&text).ok()?;
        let known =
            [RunStatus::Running, RunStatus::Complete, RunStatus::Interrupted, RunStatus::Failed];
        let status = known.into_iter().find(|s| about["status"] == s.to_string())?;
        let in_use = status == RunStatus::Running && Claim::in_use(root);
        let reason = about["reason"].as_str().unwrap_or_default().to_owned();
        Some(Self {
            status,
            reason,
            time: about["time"].as_f64().unwrap_or(0.0),
            work: from_value(about["work"].take()).ok(),
            start: from_value(about["start"]["work"].take()).ok(),
            cpu_seconds: about["cpu_seconds"].as_f64(),
            start_seconds: about["start"]["cpu_seconds"].as_f64(),
            peak_resident_bytes: about["peak_resident_bytes"].as_u64(),
            in_use,
            notes: from_value(about["notes"].take()).unwrap_or_default(),
            intersection: from_value(about).ok(),
        })
    }
}

/// The status of one directory.
#[derive(Debug)]
struct Status {
    path: PathBuf,
    started: String,
    reached: Mutex<Reached>,
    /// Whether the run is in progress.
    open: AtomicBool,
}

static STATUSES: Mutex<Vec<Arc<Status>>> = Mutex::new(Vec::new());

impl Status {
    fn text(&self, standing: RunStatus, reason: &str) -> String {
        let mut about = json!({
            "status": standing.to_string(),
            "reason": reason,
            "started": self.started,
            "process": std::process::id(),
        });
        let reached = to_value(&*self.reached.lock().unwrap_or_else(PoisonError::into_inner));
        if let (Value::Object(about), Ok(Value::Object(reached))) = (&mut about, reached) {
            about.extend(reached);
        }
        format!("{about:#}\n")
    }

    fn write(&self, standing: RunStatus, reason: &str) -> Result<(), OutputError> {
        let text = self.text(standing, reason);
        atomic::replace(&self.path, |writer| writer.write_all(text.as_bytes()))
    }

    /// The same without waiting for the disk.
    fn write_at_once(&self, standing: RunStatus, reason: &str) {
        let part = atomic::part_of(&self.path);
        // The program is ending: a failure cannot be reported.
        let _ = fs::write(&part, self.text(standing, reason))
            .and_then(|()| fs::rename(&part, &self.path));
    }
}

/// Records the end of all runs of this process that are in progress: for an immediate exit of the program.
pub(crate) fn end_all(standing: RunStatus, reason: &str) {
    for status in STATUSES.lock().unwrap_or_else(PoisonError::into_inner).iter() {
        if status.open.swap(false, Ordering::AcqRel) {
            status.write_at_once(standing, reason);
        }
    }
}
