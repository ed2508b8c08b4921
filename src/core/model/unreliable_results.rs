//! Results of a law that it has flagged as unreliable, or that were no usable numbers, without ending the
//! run.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::kinetics::{BadValue, Descriptor, KineticsError, Location, Outcome, Unreliable};

/// The first of each kind.
#[derive(Debug, Default)]
pub struct UnreliableResults {
    unreliable: OnceLock<(Location, Unreliable)>,
    bad: OnceLock<BadValue>,
    /// How often a call gave no usable number.
    count: AtomicU64,
}

impl UnreliableResults {
    /// Records the outcome of a call.
    pub(super) fn note(&self, location: Location, outcome: Outcome) -> Result<(), KineticsError> {
        match outcome {
            Ok(None) => Ok(()),
            Ok(Some(unreliable)) => {
                let _ = self.unreliable.set((location, unreliable));
                Ok(())
            }
            Err(error) => {
                if let KineticsError::BadOutput(bad) = &error {
                    self.count.fetch_add(1, Ordering::Relaxed);
                    let _ = self.bad.set((**bad).clone());
                }
                Err(error)
            }
        }
    }

    /// The first result that the law itself flagged as unreliable, in words.
    #[must_use]
    pub fn unreliable(&self, law: &Descriptor) -> Option<String> {
        let (location, Unreliable { message, point }) = self.unreliable.get()?;
        let place = point.map(|point| format!(" at {} {point}", location.noun()));
        let law = law.title();
        Some(format!(
            "{law} flags its result as unreliable{}: {message}",
            place.unwrap_or_default()
        ))
    }

    /// How many calls gave a result that was not a usable number.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count.load(Ordering::Relaxed)
    }

    /// The first result that was not a usable number. Where the run continues it was in a step attempt that has
    /// been given up.
    #[must_use]
    pub fn bad(&self) -> Option<&BadValue> {
        self.bad.get()
    }
}
