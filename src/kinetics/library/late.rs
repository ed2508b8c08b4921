//! Faults that show where nobody can be told: in `destroy`, or when a run has ended.

use std::sync::{Mutex, PoisonError};

use super::intact;
use crate::KineticsError;

static TOLD: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Notes a fault, to be asked for.
pub(super) fn tell(fault: &KineticsError) {
    TOLD.lock().unwrap_or_else(PoisonError::into_inner).push(fault.to_string());
}

/// The first of the faults that were noted since it was last asked.
pub(super) fn take() -> Option<String> {
    let mut told = TOLD.lock().unwrap_or_else(PoisonError::into_inner);
    std::mem::take(&mut *told).into_iter().next()
}

/// What a plugin has done wrong that no call could say: to be asked for when a program has done its
/// work, and has not itself changed the working directory.
#[must_use]
pub fn late_fault() -> Option<String> {
    let moved = || intact::moved().then(|| "a plugin changes the working directory".to_owned());
    take().or_else(moved)
}
