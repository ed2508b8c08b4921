//! Memory that a plugin keeps: a law needs no more after a million calls than after some.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::process_memory::private_resident_bytes;

/// Looks come every so many calls; the first one says what is needed.
const CHECK_INTERVAL: u64 = 256;
/// Bytes that a plugin may take beyond that.
const MAX_GROWTH_BYTES: u64 = 256 << 20;

/// Calls so far, and bytes at the first look.
#[derive(Debug, Default)]
pub(super) struct Grown {
    calls: AtomicU64,
    first: AtomicU64,
}

impl Grown {
    /// Looks after a call, now and then: what is wrong.
    pub(super) fn check(&self) -> Option<String> {
        if !(self.calls.fetch_add(1, Ordering::Relaxed) + 1).is_multiple_of(CHECK_INTERVAL) {
            return None;
        }
        let now = private_resident_bytes()?;
        let first = self.first.compare_exchange(0, now, Ordering::Relaxed, Ordering::Relaxed);
        let more = now.saturating_sub(first.err()?);
        (more > MAX_GROWTH_BYTES).then(|| {
            let more = more >> 20;
            format!("takes {more} MiB more than after its first {CHECK_INTERVAL} calls, and gives none back")
        })
    }
}
