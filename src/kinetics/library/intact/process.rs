//! What belongs to the whole process: its folder, its files, that there is one of it.

use std::cell::Cell;
use std::fs::{self, File};
use std::os::fd::{IntoRawFd, RawFd};
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Once, OnceLock, PoisonError, RwLock};

use super::super::end::leave;
use super::super::watch::{CallOwner, call_owner};

thread_local! {
    /// How often a call of this thread has forked.
    static FORKS: Cell<usize> = const { Cell::new(0) };
}

/// Whether this process is a copy that a call has made of the one that computes.
static COPY: AtomicBool = AtomicBool::new(false);
/// Files that nobody but a plugin would close.
static KEPT: RwLock<Vec<RawFd>> = RwLock::new(Vec::new());
/// The folder when the program began to look, as a path and as what it is.
static HOME: OnceLock<Option<(PathBuf, Folder)>> = OnceLock::new();

const STANDARD: [RawFd; 3] = [0, 1, 2];

/// A folder: device and number.
type Folder = (u64, u64);

/// Begins to look for forks and closed files, for good.
pub(crate) fn begin_to_look() {
    static BEGUN: Once = Once::new();
    BEGUN.call_once(|| {
        let _ = HOME.set(std::env::current_dir().ok().zip(folder()));
        // SAFETY: handlers that use atomics and constant thread-locals only.
        unsafe { libc::pthread_atfork(None, Some(in_parent), Some(in_copy)) };
        // Whoever closes all files from some number on closes the lowest that is free now.
        if let Ok(file) = File::open("/dev/null") {
            keep(file.into_raw_fd());
        }
    });
}

/// Looks at this file too, which stays open.
pub(crate) fn keep(file: RawFd) {
    KEPT.write().unwrap_or_else(PoisonError::into_inner).push(file);
}

fn in_call() -> bool {
    matches!(call_owner(), Some(CallOwner::Own(_)))
}

extern "C" fn in_parent() {
    if in_call() {
        FORKS.set(FORKS.get() + 1);
    }
}

extern "C" fn in_copy() {
    if in_call() {
        COPY.store(true, Ordering::Relaxed);
    }
}

pub(super) fn forks() -> usize {
    FORKS.get()
}

/// Ends this process if it is a copy: there must not be two that compute and write.
pub(super) fn end_copies(before: Option<&Process>) {
    if COPY.load(Ordering::Relaxed) || before.is_some_and(|b| b.number != std::process::id()) {
        leave(0);
    }
}

/// What there was before a call.
#[derive(Debug)]
pub(super) struct Process {
    number: u32,
    folder: Option<Folder>,
    standard: [bool; 3],
}

impl Process {
    pub(super) fn now() -> Self {
        Self { number: std::process::id(), folder: folder(), standard: STANDARD.map(is_open) }
    }

    /// Says what has changed since, and puts it back as far as that is possible.
    pub(super) fn restore(self) -> Option<String> {
        let closed = STANDARD.iter().zip(self.standard).any(|(file, was)| was && !is_open(*file));
        let kept = KEPT.read().unwrap_or_else(PoisonError::into_inner).clone();
        let lost: Vec<RawFd> = kept.into_iter().filter(|file| !is_open(*file)).collect();
        let folder = folder();
        if folder != self.folder {
            go_home();
            return Some("changes the working directory".to_owned());
        }
        if lost.is_empty() && !closed {
            return None;
        }
        KEPT.write().unwrap_or_else(PoisonError::into_inner).retain(|file| !lost.contains(file));
        Some("closes files that are not its own".to_owned())
    }
}

/// Whether the folder is not that in which the program began; goes back to it.
pub(crate) fn moved() -> bool {
    let away = HOME.get().is_some_and(|home| home.as_ref().map(|home| home.1) != folder());
    if away {
        go_home();
    }
    away
}

fn go_home() {
    if let Some(Some((path, _))) = HOME.get() {
        let _ = std::env::set_current_dir(path);
    }
}

fn folder() -> Option<Folder> {
    fs::metadata(".").ok().map(|about| (about.dev(), about.ino()))
}

fn is_open(file: RawFd) -> bool {
    // SAFETY: asks for flags only.
    unsafe { libc::fcntl(file, libc::F_GETFD) >= 0 }
}
