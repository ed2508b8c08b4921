//! Faults that show where nobody can be told: in `destroy`, or when a run has ended.

use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

use super::intact;
use crate::KineticsError;

static TOLD: Mutex<Vec<String>> = Mutex::new(Vec::new());
/// Names of all plugins.
static LOADED: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// Notes a fault, to be asked for.
pub(super) fn tell(fault: &KineticsError) {
    TOLD.lock().unwrap_or_else(PoisonError::into_inner).push(fault.to_string());
}

/// The first of the faults that were noted since it was last asked.
pub(super) fn take() -> Option<String> {
    let mut told = TOLD.lock().unwrap_or_else(PoisonError::into_inner);
    std::mem::take(&mut *told).into_iter().next()
}

/// Notes that there is a plugin of this name.
pub(super) fn loaded(name: &str) {
    LOADED.lock().unwrap_or_else(PoisonError::into_inner).insert(name.to_owned());
}

/// What a plugin has done wrong that no call could say: to be asked for when a program has done its
/// work, or cannot write, and has not itself changed the working directory or closed standard files.
#[must_use]
pub fn late_fault() -> Option<String> {
    let does = |what: &str| {
        let all = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        let names: Vec<String> = all.iter().map(|name| format!("`{name}`")).collect();
        match &names[..] {
            [] => None,
            [name] => Some(format!("plugin {name} {what}")),
            names => Some(format!("one of the plugins {} {what}", names.join(", "))),
        }
    };
    let moved = || intact::moved().then(|| does("changes the working directory")).flatten();
    let closed = || intact::closed().then(|| does("closes files that are not its own")).flatten();
    take().or_else(moved).or_else(closed)
}
