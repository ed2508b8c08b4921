//! A list that a signal handler may read: it interrupts anything, so it may neither allocate nor lock.
//!
//! A crate of its own because two others, kinetics and output, have a signal handler.

use std::sync::{Mutex, OnceLock, PoisonError};

/// A list that only grows. Reading takes no lock; entries stay for good.
#[derive(Debug)]
pub struct Growing<T: 'static> {
    first: OnceLock<&'static Entry<T>>,
    last: Mutex<Option<(usize, &'static Entry<T>)>>,
}

#[derive(Debug)]
struct Entry<T: 'static> {
    value: T,
    next: OnceLock<&'static Entry<T>>,
}

impl<T: Sync> Default for Growing<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Sync> Growing<T> {
    /// An empty list.
    pub const fn new() -> Self {
        Self { first: OnceLock::new(), last: Mutex::new(None) }
    }

    /// Appends a value; its number, from 0, and where it stays.
    pub fn push(&self, value: T) -> (usize, &'static T) {
        let entry: &'static Entry<T> = Box::leak(Box::new(Entry { value, next: OnceLock::new() }));
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let (number, place) = match *last {
            Some((number, last)) => (number + 1, &last.next),
            None => (0, &self.first),
        };
        // Nobody else has come first: the lock is held.
        let _ = place.set(entry);
        *last = Some((number, entry));
        (number, &entry.value)
    }

    /// All values, in the order in which they came.
    pub fn iter(&self) -> impl Iterator<Item = &'static T> {
        let mut next = self.first.get().copied();
        std::iter::from_fn(move || {
            let entry = next?;
            next = entry.next.get().copied();
            Some(&entry.value)
        })
    }
}
