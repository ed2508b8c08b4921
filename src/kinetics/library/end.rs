//! Plugins that end the program: by a fault of the machine, by `abort`, by `exit`.
//!
//! Nothing can be mended then. The handler of these signals, and the hook that the system calls at
//! every exit, look whether a [call](super::watch) is under way; if so they stop there and leave it to
//! somebody who watches to name plugin and call, and to end the program with a status that is not 0.
//! A handler has no memory of its own and hardly a stack. If nobody does so in time, because a
//! plugin has corrupted the memory that all share, they end the program themselves. Where no call is under
//! way all goes on as it would without them. `_exit` calls no hook, but plugins are bound to the one here, where
//! the linker can do that; SIGKILL and system calls of its own cannot be seen.

use std::sync::Once;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicUsize, Ordering};

use super::watch::{CallOwner, UnderWay, under_way};

/// How a plugin has ended the program: a signal, or one of these.
static HOW: AtomicI32 = AtomicI32::new(NOT);
const NOT: i32 = 0;
const EXIT: i32 = -1;
/// In which thread, or in another than all that we know.
static THREAD: AtomicUsize = AtomicUsize::new(OTHER);
const OTHER: usize = usize::MAX;
/// Whether some thread has seen it already.
static SEEN: AtomicBool = AtomicBool::new(false);

/// A plugin that has ended the program: what is left to do is to say so and to [leave].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ended {
    call: UnderWay,
    own: bool,
    how: i32,
}

impl std::fmt::Display for Ended {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { call, own, how } = self;
        write!(f, "plugin `{}` ends the program in {call}", call.plugin)?;
        if !own {
            f.write_str(", on a thread of its own")?;
        }
        match how {
            &EXIT => f.write_str(": it calls exit"),
            signal => write!(f, ": {} (signal {signal})", meaning(*signal)),
        }
    }
}

/// Begins to guard against plugins that end the program, for good: somebody must ask for
/// [`ended`] from then on.
pub fn guard() {
    static INSTALLED: Once = Once::new();
    INSTALLED.call_once(system::install);
}

/// The plugin that has ended the program, if one has.
#[must_use]
pub fn ended() -> Option<Ended> {
    let how = HOW.load(Ordering::Acquire);
    if how == NOT {
        return None;
    }
    let owner = match THREAD.load(Ordering::Relaxed) {
        OTHER => CallOwner::Other,
        number => CallOwner::Own(number),
    };
    Some(Ended { call: under_way(owner)?, own: owner != CallOwner::Other, how })
}

/// What a signal means, in words.
pub(super) fn meaning(signal: i32) -> &'static str {
    system::meaning(signal)
}

/// Ends the program at once, without the hooks of an exit.
pub fn leave(status: i32) -> ! {
    system::leave(status)
}

#[cfg(unix)]
mod system {
    use std::mem::MaybeUninit;
    use std::ptr;
    use std::sync::OnceLock;
    use std::sync::atomic::{AtomicI32, Ordering};

    use super::super::watch::{CallOwner, call_owner};
    use super::{EXIT, HOW, OTHER, SEEN, THREAD};

    /// The status with which the program leaves if nobody else ends it.
    const STATUS: i32 = 1;
    /// So many hundredths of a second others have for that.
    const PATIENCE: usize = 300;
    /// Threads that may call exit at the same time: each takes a hook off the system's list, and where
    /// there is none left the program ends.
    const HOOKS: usize = 256;
    const MESSAGE: &str = "\nerror: a plugin ends the program\n";

    /// Signals that a fault raises in the thread that has it, and what they mean.
    const FAULTS: [(libc::c_int, &str); 7] = [
        (libc::SIGSEGV, "a segmentation fault: it reads or writes an invalid address"),
        (libc::SIGBUS, "a bus error: it reads or writes an invalid address"),
        (libc::SIGFPE, "an arithmetic exception, as an integer division by 0"),
        (libc::SIGILL, "an illegal instruction"),
        (libc::SIGABRT, "abort: a failed assertion, or an uncaught exception"),
        (libc::SIGTRAP, "a trap"),
        (libc::SIGSYS, "a forbidden system call"),
    ];

    /// What the signals did before, in the order of [`FAULTS`].
    static BEFORE: [OnceLock<libc::sigaction>; FAULTS.len()] =
        [const { OnceLock::new() }; FAULTS.len()];

    pub(super) fn meaning(signal: i32) -> &'static str {
        FAULTS.iter().find(|(known, _)| *known == signal).map_or("a signal", |(_, text)| text)
    }

    /// The process that is guarded.
    static GUARDED: AtomicI32 = AtomicI32::new(0);

    pub(super) fn install() {
        // SAFETY: asks for a number and cannot fail.
        GUARDED.store(unsafe { libc::getpid() }, Ordering::Relaxed);
        for ((signal, _), before) in FAULTS.iter().zip(&BEFORE) {
            let handler: extern "C" fn(libc::c_int, *mut libc::siginfo_t, *mut libc::c_void) =
                on_fault;
            let mut old = MaybeUninit::<libc::sigaction>::uninit();
            // SAFETY: `new` is valid when all of it is zero, and every field that matters is set; the
            // handler only does what a handler may. The stack of its own (SA_ONSTACK) is that which
            // the standard library gives to every thread. `old` is written if the call succeeds.
            unsafe {
                let mut new: libc::sigaction = std::mem::zeroed();
                new.sa_sigaction = handler as libc::sighandler_t;
                new.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
                libc::sigemptyset(&raw mut new.sa_mask);
                if libc::sigaction(*signal, &raw const new, old.as_mut_ptr()) == 0 {
                    let _ = before.set(old.assume_init());
                }
            }
        }
        for _ in 0..HOOKS {
            // SAFETY: the hook is a function without arguments that may be called at any exit.
            unsafe { libc::atexit(on_exit) };
        }
    }

    /// As `_exit`, which must not be called here: it may be [`instead`].
    pub(super) fn leave(status: i32) -> ! {
        loop {
            // SAFETY: ends the process and cannot fail.
            #[cfg(target_os = "linux")]
            unsafe {
                libc::syscall(libc::SYS_exit_group, status)
            };
            // SAFETY: as above.
            #[cfg(not(target_os = "linux"))]
            unsafe {
                libc::_exit(status)
            };
        }
    }

    /// The C library's functions that end a process without hooks, as a plugin sees them: a program's own come before
    /// those of shared libraries. The C library itself does not come here.
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    mod instead {
        use super::{EXIT, GUARDED, Ordering, call_owner, leave, wait_for_the_end};

        #[unsafe(no_mangle)]
        extern "C" fn _exit(status: libc::c_int) -> ! {
            // SAFETY: asks for a number and cannot fail. A copy of this process (fork) ends as it likes.
            let guarded = GUARDED.load(Ordering::Relaxed) == unsafe { libc::getpid() };
            if let Some(owner) = call_owner().filter(|_| guarded) {
                wait_for_the_end(owner, EXIT);
            }
            leave(status)
        }

        #[unsafe(no_mangle)]
        extern "C" fn _Exit(status: libc::c_int) -> ! {
            _exit(status)
        }
    }

    extern "C" fn on_fault(signal: libc::c_int, about: *mut libc::siginfo_t, _: *mut libc::c_void) {
        if let Some(owner) = call_owner() {
            wait_for_the_end(owner, signal);
        }
        let known = FAULTS.iter().position(|(known, _)| *known == signal);
        let Some(before) = known.and_then(|k| BEFORE[k].get()) else { leave(STATUS) };
        // SAFETY: what was there before is put back; `about` is given by the system. A fault comes
        // again when the handler returns; what somebody sent must be sent again.
        unsafe {
            libc::sigaction(signal, before, ptr::null_mut());
            if about.is_null() || (*about).si_code <= 0 {
                libc::raise(signal);
            }
        }
    }

    extern "C" fn on_exit() {
        if let Some(owner) = call_owner() {
            wait_for_the_end(owner, EXIT);
        }
    }

    /// Tells who watches what has happened, once, and waits.
    fn wait_for_the_end(owner: CallOwner, how: i32) -> ! {
        let first = !SEEN.swap(true, Ordering::AcqRel);
        if first {
            THREAD.store(
                if let CallOwner::Own(number) = owner { number } else { OTHER },
                Ordering::Relaxed,
            );
            HOW.store(how, Ordering::Release);
        }
        for _ in 0..PATIENCE {
            // SAFETY: sleeping changes nothing.
            unsafe { libc::usleep(10_000) };
        }
        if first {
            // SAFETY: as many bytes as the text has. If nobody reads there is nobody to tell.
            let _ =
                unsafe { libc::write(libc::STDERR_FILENO, MESSAGE.as_ptr().cast(), MESSAGE.len()) };
        }
        leave(STATUS)
    }
}

#[cfg(not(unix))]
mod system {
    pub(super) fn install() {}

    pub(super) fn meaning(_: i32) -> &'static str {
        "a signal"
    }

    #[allow(clippy::exit)]
    pub(super) fn leave(status: i32) -> ! {
        std::process::exit(status)
    }
}
