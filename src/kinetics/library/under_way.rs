//! The plugin call under way on a thread, for a program that reports crashes.

use std::ptr;
use std::sync::atomic::{AtomicPtr, Ordering};

/// A call into a plugin.
struct UnderWay<'a> {
    plugin: &'a str,
    call: &'a str,
}

thread_local! {
    /// One word, so that a signal handler never reads half of it; it needs neither allocation nor destructor.
    static UNDER_WAY: AtomicPtr<UnderWay<'static>> = const { AtomicPtr::new(ptr::null_mut()) };
}

/// Clears the record when the call returns or unwinds.
struct Recorded;

impl Drop for Recorded {
    fn drop(&mut self) {
        UNDER_WAY.with(|place| place.store(ptr::null_mut(), Ordering::Release));
    }
}

/// Calls a function of a plugin, recorded as under way on this thread.
pub(super) fn recorded<R>(plugin: &str, call: &str, function: impl FnOnce() -> R) -> R {
    let under_way = UnderWay { plugin, call };
    let place = (&raw const under_way).cast_mut().cast::<UnderWay<'static>>();
    UNDER_WAY.with(|slot| slot.store(place, Ordering::Release));
    let _recorded = Recorded;
    function()
}

/// Hands the names of plugin and call to `report` if this thread is inside a plugin. Neither allocates nor locks: a
/// signal handler may call it.
pub fn call_under_way<R>(report: impl FnOnce(&str, &str) -> R) -> Option<R> {
    let place = UNDER_WAY.try_with(|slot| slot.load(Ordering::Acquire)).ok()?;
    // SAFETY: null, or the record on the stack of `recorded`, which has not returned: this is the same thread.
    let under_way = unsafe { place.as_ref() }?;
    Some(report(under_way.plugin, under_way.call))
}

/// Meaning of a signal that ends a process.
#[cfg(unix)]
#[must_use]
pub fn signal_meaning(signal: i32) -> &'static str {
    match signal {
        libc::SIGSEGV => "a segmentation fault: it reads or writes an invalid address",
        libc::SIGBUS => "a bus error: it reads or writes an invalid address",
        libc::SIGFPE => "an arithmetic exception, as an integer division by 0",
        libc::SIGILL => "an illegal instruction",
        libc::SIGABRT => "abort: a failed assertion, or an uncaught exception",
        libc::SIGTRAP => "a trap",
        libc::SIGSYS => "a forbidden system call",
        libc::SIGKILL => "killed, perhaps for memory",
        _ => "a signal",
    }
}
