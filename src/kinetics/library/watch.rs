//! Which calls into plugins are under way, and for how long.
//!
//! A call that does not return cannot be ended from outside: threads share what they hold. But
//! somebody who watches can say which plugin hangs, in which call, and at which points, and end
//! the program. One that ends the program itself is [named](super::end) in the same way.

use std::cell::Cell;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use super::call::Call;
use crate::descriptor::Location;
use rumple_growing::Growing;

/// A call that is under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct UnderWay {
    pub(super) plugin: &'static str,
    pub(super) call: &'static str,
    pub(super) location: Location,
    pub(super) first: usize,
    pub(super) count: usize,
}

impl std::fmt::Display for UnderWay {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { call, location, first, count, .. } = self;
        f.write_str(call)?;
        match count.checked_sub(1) {
            None => Ok(()),
            Some(0) => write!(f, " at {} {first}", location.noun()),
            Some(more) => write!(f, " at {} {first} to {}", location.nouns(), first + more),
        }
    }
}

/// A call that has been under way for long.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Overdue {
    call: UnderWay,
    running: Duration,
}

impl std::fmt::Display for Overdue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { call, running } = self;
        let (plugin, seconds) = (call.plugin, running.as_secs_f64());
        write!(
            f,
            "plugin `{plugin}` does not return from {call}: it has been there for {seconds:.0} s"
        )
    }
}

/// What one thread is doing. Written by it alone; a reader may see half of a change, which at
/// worst names the points of the call before.
#[derive(Debug, Default)]
struct Slot {
    /// Milliseconds on the clock, plus one; 0 while no call is under way.
    since: AtomicU64,
    library: AtomicUsize,
    call: AtomicUsize,
    location: AtomicUsize,
    first: AtomicUsize,
    count: AtomicUsize,
}

static NAMES: Growing<String> = Growing::new();
static SLOTS: Growing<Slot> = Growing::new();

pub(super) const CALLS: [&str; 8] = [
    "loading",
    "create",
    "rates",
    "rate_partials",
    "length_factor",
    "length_factor_partials",
    "observe",
    "destroy",
];
pub(super) const LOCATIONS: [Location; 3] = [Location::Vertex, Location::Face, Location::Edge];

thread_local! {
    static SLOT: Cell<Option<(usize, &'static Slot)>> = const { Cell::new(None) };
}

/// Gives a library its number.
pub(super) fn enter(name: &str) -> usize {
    NAMES.push(name.to_owned()).0
}

/// Ends the watch over a call when it goes out of scope.
pub(super) struct Watched(&'static Slot);

impl Drop for Watched {
    fn drop(&mut self) {
        self.0.since.store(0, Ordering::Relaxed);
    }
}

/// Begins to watch over a call of this thread.
pub(super) fn begin(call: &Call<'_>) -> Watched {
    let (_, slot) = SLOT.get().unwrap_or_else(|| {
        let entry = SLOTS.push(Slot::default());
        SLOT.set(Some(entry));
        entry
    });
    let position = |found: Option<usize>| found.unwrap_or(usize::MAX);
    slot.library.store(call.library, Ordering::Relaxed);
    slot.call.store(position(CALLS.iter().position(|c| *c == call.name)), Ordering::Relaxed);
    let location = position(LOCATIONS.iter().position(|l| *l == call.location));
    slot.location.store(location, Ordering::Relaxed);
    slot.first.store(call.first, Ordering::Relaxed);
    slot.count.store(call.count, Ordering::Relaxed);
    slot.since.store(now() + 1, Ordering::Release);
    Watched(slot)
}

/// Milliseconds on a clock that never goes back: every call reads it, so it is one that is read in
/// nanoseconds, and a few milliseconds late.
#[cfg(target_os = "linux")]
fn now() -> u64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: writes to `time`; where there is no such clock, nothing.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC_COARSE, &raw mut time) };
    let [seconds, nanoseconds] =
        [time.tv_sec, time.tv_nsec].map(|n| u64::try_from(n).unwrap_or_default());
    1000 * seconds + nanoseconds / 1_000_000
}

#[cfg(not(target_os = "linux"))]
fn now() -> u64 {
    use std::{sync::LazyLock, time::Instant};
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    u64::try_from(START.elapsed().as_millis()).unwrap_or(u64::MAX - 1)
}

impl Slot {
    fn is_busy(&self) -> bool {
        self.since.load(Ordering::Acquire) != 0
    }

    /// The call that is under way, if there is one.
    fn call(&self) -> Option<UnderWay> {
        let at = |number: &AtomicUsize| number.load(Ordering::Relaxed);
        self.is_busy().then(|| UnderWay {
            plugin: NAMES.iter().nth(at(&self.library)).map_or("", String::as_str),
            call: CALLS.get(at(&self.call)).copied().unwrap_or("a call"),
            location: LOCATIONS.get(at(&self.location)).copied().unwrap_or(Location::Vertex),
            first: at(&self.first),
            count: at(&self.count),
        })
    }
}

/// Where a call is under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CallOwner {
    /// In the thread that asks, which has this number.
    Own(usize),
    /// In some other thread alone.
    Other,
}

/// Whether and where a call is under way. A signal handler may ask.
pub(super) fn call_owner() -> Option<CallOwner> {
    match SLOT.get() {
        Some((number, slot)) if slot.is_busy() => Some(CallOwner::Own(number)),
        _ => SLOTS.iter().any(Slot::is_busy).then_some(CallOwner::Other),
    }
}

/// The call that is under way there.
pub(super) fn under_way(whose: CallOwner) -> Option<UnderWay> {
    match whose {
        CallOwner::Own(number) => SLOTS.iter().nth(number)?.call(),
        CallOwner::Other => SLOTS.iter().find_map(Slot::call),
    }
}

/// The call that has been under way longest, if that is longer than `limit`.
#[must_use]
pub fn overdue(limit: Duration) -> Option<Overdue> {
    let running = |slot: &Slot| match slot.since.load(Ordering::Acquire) {
        0 => Duration::ZERO,
        since => Duration::from_millis((now() + 1).saturating_sub(since)),
    };
    let slot = SLOTS.iter().max_by_key(|slot| running(slot))?;
    let running = running(slot);
    // It may have come to its end just now.
    let call = slot.call().filter(|_| running > limit)?;
    Some(Overdue { call, running })
}
