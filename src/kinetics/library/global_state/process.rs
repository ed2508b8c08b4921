//! Process-wide state: working directory, open files, child processes.

use std::fs;
use std::os::fd::RawFd;
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;
use std::sync::{OnceLock, RwLock};

/// State that no call may modify.
#[derive(Debug)]
struct Reference {
    process: u32,
    has_children: bool,
    working_directory: Option<(PathBuf, Directory)>,
    /// Standard files that are open, each with a duplicate.
    standard: Vec<(RawFd, RawFd)>,
}

/// A directory: device and inode.
type Directory = (u64, u64);

static REFERENCE: OnceLock<Reference> = OnceLock::new();
/// Other files that must stay open.
static KEPT_FILES: RwLock<Vec<RawFd>> = RwLock::new(Vec::new());

/// Descriptor from which duplicates are numbered: beyond what a loop over all files would close.
const MIN_DUPLICATE: libc::c_int = 1000;

/// Records the state that no call may modify.
pub(super) fn record_reference() {
    REFERENCE.get_or_init(|| {
        let duplicate = |file: RawFd| {
            // SAFETY: duplicates a descriptor; fails where it is not open.
            let duplicate = unsafe { libc::fcntl(file, libc::F_DUPFD_CLOEXEC, MIN_DUPLICATE) };
            (duplicate >= 0).then_some((file, duplicate))
        };
        Reference {
            process: std::process::id(),
            has_children: has_children(libc::WNOWAIT),
            working_directory: std::env::current_dir().ok().zip(directory()),
            standard: (0..3).filter_map(duplicate).collect(),
        }
    });
}

/// Adds a file that must stay open.
#[cfg(target_os = "linux")]
pub(in crate::library) fn keep_open(file: RawFd) {
    KEPT_FILES.write().unwrap_or_else(std::sync::PoisonError::into_inner).push(file);
}

/// Restores the state after a call; says what the plugin has changed. Never returns in a copy of the process.
pub(super) fn restore() -> Option<&'static str> {
    let reference = REFERENCE.get()?;
    if std::process::id() != reference.process {
        // SAFETY: ends a copy that a plugin has forked, without the exit hooks of the original: both would answer.
        unsafe { libc::_exit(0) };
    }
    // Whichever thread forked: its copy may still write to memory that is shared with the caller.
    if !reference.has_children && has_children(libc::WNOWAIT) {
        has_children(0);
        return Some("forks the process");
    }
    if let Some((path, expected)) = &reference.working_directory
        && directory() != Some(*expected)
    {
        let _ = std::env::set_current_dir(path);
        return Some("changes the working directory");
    }
    let mut closed = false;
    for (file, duplicate) in reference.standard.iter().filter(|(file, _)| !is_open(*file)) {
        closed = true;
        // SAFETY: gives a descriptor of ours the number that was closed.
        unsafe { libc::dup2(*duplicate, *file) };
    }
    let kept = KEPT_FILES.read().unwrap_or_else(std::sync::PoisonError::into_inner);
    closed |= kept.iter().any(|file| !is_open(*file));
    closed.then_some("closes files that are not its own")
}

fn directory() -> Option<Directory> {
    fs::metadata(".").ok().map(|found| (found.dev(), found.ino()))
}

/// Whether the process has children that were not waited for, including those that send no signal when they end. One
/// that has ended is reaped, unless `how` is `WNOWAIT`.
fn has_children(how: libc::c_int) -> bool {
    #[cfg(target_os = "linux")]
    const ANY_KIND: libc::c_int = libc::__WALL;
    #[cfg(not(target_os = "linux"))]
    const ANY_KIND: libc::c_int = 0;
    let options = libc::WEXITED | libc::WNOHANG | how | ANY_KIND;
    // SAFETY: the structure is valid when all of it is zero.
    unsafe {
        let mut found: libc::siginfo_t = std::mem::zeroed();
        libc::waitid(libc::P_ALL, 0, &raw mut found, options) == 0
    }
}

fn is_open(file: RawFd) -> bool {
    // SAFETY: reads the flags of a descriptor.
    unsafe { libc::fcntl(file, libc::F_GETFD) >= 0 }
}
