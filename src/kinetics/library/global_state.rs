//! Checks that a plugin leaves global state unchanged: floating-point environment, working directory, files, processes.
//!
//! Only a process whose single task is to call a plugin makes them: the child of an isolated plugin, and that of
//! `rumple plugin validate`. Any change there is the plugin's doing, and restoring it affects no other code.

mod floating_point;
#[cfg(unix)]
mod process;

use std::sync::atomic::{AtomicBool, Ordering};

use floating_point::FloatingPoint;
#[cfg(target_os = "linux")]
pub(super) use process::keep_open;

/// Whether calls are checked.
static CHECKED: AtomicBool = AtomicBool::new(false);

/// Checks after every call of a plugin from now on that global state is unchanged, and restores it: for a process
/// whose single task is to call a plugin. Copies that a plugin forks are ended.
pub fn check_global_state() {
    #[cfg(unix)]
    process::record_reference();
    CHECKED.store(true, Ordering::Relaxed);
}

/// Whether calls are checked: in a process whose single task is to call a plugin.
pub(crate) fn is_checked() -> bool {
    CHECKED.load(Ordering::Relaxed)
}

/// Global state before a call.
#[derive(Debug)]
pub(super) struct GlobalState {
    floating_point: FloatingPoint,
}

impl GlobalState {
    /// Records the state before a call, if calls are checked.
    pub(super) fn record() -> Option<Self> {
        is_checked().then(|| Self { floating_point: FloatingPoint::now() })
    }

    /// Restores the state after the call; says what the plugin has changed.
    pub(super) fn restore(self) -> Option<String> {
        let floating_point = self.floating_point.restore();
        #[cfg(unix)]
        let process = process::restore().map(str::to_owned);
        #[cfg(not(unix))]
        let process = None;
        floating_point.or(process)
    }
}
