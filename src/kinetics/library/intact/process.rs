//! What belongs to the whole process: its folder, its files, that there is one of it.

use std::cell::Cell;
use std::fs::{self, File};
use std::os::fd::{IntoRawFd, RawFd};
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;
use std::ptr;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicPtr, AtomicU8, Ordering};
use std::sync::{Once, OnceLock, PoisonError, RwLock};

use super::super::end::leave;
use super::super::watch::{CallOwner, call_owner};
use super::alone;

thread_local! {
    /// How often a call of this thread has forked.
    static FORKS: Cell<usize> = const { Cell::new(0) };
}

/// A byte that is 1 here and 0 in every copy of this process, however it was made; none where the system
/// does not do that.
static HERE: AtomicPtr<AtomicU8> = AtomicPtr::new(ptr::null_mut());
/// Whether this process is a copy that a call has made of the one that computes.
static COPY: AtomicBool = AtomicBool::new(false);
/// Files that nobody but a plugin would close.
static KEPT: RwLock<Vec<RawFd>> = RwLock::new(Vec::new());
/// The standard files once more, in case that they are closed.
static SPARE: [AtomicI32; 3] = [const { AtomicI32::new(-1) }; 3];
const BEYOND: libc::c_int = 1000;
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
        HERE.store(marked(), Ordering::Relaxed);
        // SAFETY: handlers that use atomics and constant thread-locals only.
        unsafe { libc::pthread_atfork(None, Some(in_parent), Some(in_copy)) };
        for (file, spare) in STANDARD.iter().zip(&SPARE) {
            // SAFETY: makes a new number for an open file, beyond those that anybody would close.
            let new = unsafe { libc::fcntl(*file, libc::F_DUPFD_CLOEXEC, BEYOND) };
            spare.store(new, Ordering::Relaxed);
        }
        // Whoever closes all files from some number on closes the lowest that is free now.
        if let Ok(file) = File::open("/dev/null") {
            keep(file.into_raw_fd());
        }
    });
}

/// Memory with a 1 that copies of this process see as 0, kept for good.
#[cfg(target_os = "linux")]
fn marked() -> *mut AtomicU8 {
    const SIZE: usize = 1;
    let (access, kind) =
        (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS);
    // SAFETY: asks for new memory, and how copies are to see it; nobody else knows of it.
    unsafe {
        let page = libc::mmap(ptr::null_mut(), SIZE, access, kind, -1, 0);
        if page == libc::MAP_FAILED || libc::madvise(page, SIZE, libc::MADV_WIPEONFORK) != 0 {
            return ptr::null_mut();
        }
        let byte = page.cast::<AtomicU8>();
        (*byte).store(1, Ordering::Relaxed);
        byte
    }
}

#[cfg(not(target_os = "linux"))]
fn marked() -> *mut AtomicU8 {
    ptr::null_mut()
}

/// Whether a copy of this process is known by its memory.
pub(super) fn marks_copies() -> bool {
    !HERE.load(Ordering::Relaxed).is_null()
}

/// Whether this memory is that of a copy.
fn is_marked_copy() -> bool {
    let here = HERE.load(Ordering::Relaxed);
    // SAFETY: null, or the byte that stays for good.
    unsafe { here.as_ref() }.is_some_and(|byte| byte.load(Ordering::Relaxed) == 0)
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

pub(super) fn number() -> u32 {
    std::process::id()
}

/// Ends this process if it is a copy, or not that with this number: there must not be two that compute and
/// write.
pub(super) fn end_copies(original: Option<u32>) {
    let other = || original.is_some_and(|original| original != number());
    if COPY.load(Ordering::Relaxed) || is_marked_copy() || other() {
        leave(0);
    }
}

/// What there was before a call.
#[derive(Debug)]
pub(super) struct Process {
    children: bool,
    folder: Option<Folder>,
}

impl Process {
    pub(super) fn now() -> Self {
        Self { children: has_children(), folder: folder() }
    }

    /// Says what has changed since, and puts it back as far as that is possible.
    pub(super) fn restore(self) -> Option<String> {
        let kept = KEPT.read().unwrap_or_else(PoisonError::into_inner).clone();
        let lost: Vec<RawFd> = kept.into_iter().filter(|file| !is_open(*file)).collect();
        // In a program that does other things as well, these may start some at the same time.
        if alone() && !self.children && has_children() {
            return Some("forks the process".to_owned());
        }
        if folder() != self.folder {
            go_home();
            return Some("changes the working directory".to_owned());
        }
        if lost.is_empty() && standard_closed().next().is_none() {
            return None;
        }
        KEPT.write().unwrap_or_else(PoisonError::into_inner).retain(|file| !lost.contains(file));
        reopen();
        Some("closes files that are not its own".to_owned())
    }
}

/// Standard files that are closed and were open when the program began to look, with their spare ones: what there was
/// before a call does not tell, as a call on another thread may have closed them by then.
fn standard_closed() -> impl Iterator<Item = (RawFd, RawFd)> {
    let all = STANDARD.into_iter().zip(SPARE.each_ref().map(|spare| spare.load(Ordering::Relaxed)));
    all.filter(|(file, spare)| *spare >= 0 && !is_open(*file))
}

/// Puts standard files back.
fn reopen() {
    for (file, spare) in standard_closed() {
        // SAFETY: a file of our own, under the number that it has lost; where it is lost too, none.
        unsafe { libc::dup2(spare, file) };
    }
}

/// Whether files are closed that only a plugin would close; standard ones are put back.
pub(crate) fn closed() -> bool {
    let kept = KEPT.read().unwrap_or_else(PoisonError::into_inner);
    let closed = standard_closed().next().is_some() || kept.iter().any(|file| !is_open(*file));
    reopen();
    closed
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

/// Whether there are processes that this one has started and not waited for.
fn has_children() -> bool {
    let how = libc::WEXITED | libc::WNOHANG | libc::WNOWAIT | ANY_KIND;
    // SAFETY: valid when all of it is zero; nothing is taken from anybody who waits.
    unsafe {
        let mut about: libc::siginfo_t = std::mem::zeroed();
        libc::waitid(libc::P_ALL, 0, &raw mut about, how) == 0
    }
}

/// Also those that send no signal when they end.
#[cfg(target_os = "linux")]
const ANY_KIND: libc::c_int = libc::__WALL;
#[cfg(not(target_os = "linux"))]
const ANY_KIND: libc::c_int = 0;

fn is_open(file: RawFd) -> bool {
    // SAFETY: asks for flags only.
    unsafe { libc::fcntl(file, libc::F_GETFD) >= 0 }
}
