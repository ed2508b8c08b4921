//! Names the plugin call under way when a signal ends the program, and leaves the end to the default action.
//!
//! The only signal handlers for faults: they belong to the program, not to the library crates.
#![allow(unsafe_code)]

use std::io::Write;
use std::mem::MaybeUninit;
use std::ptr;
use std::sync::OnceLock;

use crate::kinetics::{call_under_way, signal_meaning};

const FATAL_SIGNALS: [libc::c_int; 5] =
    [libc::SIGSEGV, libc::SIGBUS, libc::SIGILL, libc::SIGFPE, libc::SIGABRT];

/// Earlier actions, in the order of [`FATAL_SIGNALS`]: the standard library reports stack overflows.
static PREVIOUS_ACTIONS: [OnceLock<libc::sigaction>; FATAL_SIGNALS.len()] =
    [const { OnceLock::new() }; FATAL_SIGNALS.len()];

/// Bytes of a message; a longer one is cut.
const MESSAGE_CAPACITY: usize = 512;

/// Installs the handler of fatal signals.
pub(super) fn install() {
    for (signal, earlier) in FATAL_SIGNALS.iter().zip(&PREVIOUS_ACTIONS) {
        let handler: extern "C" fn(libc::c_int, *mut libc::siginfo_t, *mut libc::c_void) = report;
        let mut old = MaybeUninit::<libc::sigaction>::uninit();
        // SAFETY: the structure is valid when all of it is zero, and every field that matters is set; the handler
        // calls only what a handler may. `old` is written if the call succeeds.
        unsafe {
            let mut new: libc::sigaction = std::mem::zeroed();
            new.sa_sigaction = handler as libc::sighandler_t;
            // On the alternate stack that the standard library gives every thread: the stack may have overflowed.
            new.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
            libc::sigemptyset(&raw mut new.sa_mask);
            if libc::sigaction(*signal, &raw const new, old.as_mut_ptr()) == 0 {
                let _ = earlier.set(old.assume_init());
            }
        }
    }
}

/// Formats on the stack: a handler may neither allocate nor lock.
fn print(signal: libc::c_int, plugin: &str, call: &str) {
    let mut line = [0_u8; MESSAGE_CAPACITY];
    let mut rest = &mut line[..];
    // An error means that the line has been cut.
    let _ = writeln!(
        rest,
        "\nerror: plugin `{plugin}` crashed in {call}: {} (signal {signal}); run with --isolate to \
         get an ordinary error instead",
        signal_meaning(signal)
    );
    let length = MESSAGE_CAPACITY - rest.len();
    // SAFETY: as many bytes as were written.
    let _ = unsafe { libc::write(libc::STDERR_FILENO, line.as_ptr().cast(), length) };
}

extern "C" fn report(signal: libc::c_int, info: *mut libc::siginfo_t, _: *mut libc::c_void) {
    let in_plugin = call_under_way(|plugin, call| print(signal, plugin, call)).is_some();
    let position = FATAL_SIGNALS.iter().position(|fatal| *fatal == signal);
    let earlier = position.and_then(|k| PREVIOUS_ACTIONS[k].get()).filter(|_| !in_plugin);
    // SAFETY: an action that was valid, or the default one, all of which is zero; `info` is given by the system. A
    // fault comes again when the handler returns; a signal that was sent is sent again.
    unsafe {
        let default: libc::sigaction = std::mem::zeroed();
        libc::sigaction(signal, ptr::from_ref(earlier.unwrap_or(&default)), ptr::null_mut());
        if info.is_null() || (*info).si_code <= 0 {
            libc::raise(signal);
        }
    }
}
