//! Which calls into plugins are under way, and for how long.
//!
//! A call that does not return cannot be ended from outside: threads share what they hold. But
//! somebody who watches can say which plugin hangs, in which call, and at which points, and end
//! the program.

use std::cell::OnceCell;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::call::Call;
use crate::kinetics::descriptor::Location;

/// A call that has been under way for long.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Overdue {
    /// The plugin.
    pub plugin: String,
    /// Which call.
    pub call: &'static str,
    /// What its points are.
    pub location: Location,
    /// Number of the first point.
    pub first: usize,
    /// How many points.
    pub count: usize,
    /// For how long.
    pub running: Duration,
}

impl std::fmt::Display for Overdue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { plugin, call, location, first, count, running } = self;
        write!(f, "plugin `{plugin}` does not return from {call}")?;
        match count.checked_sub(1) {
            None => {}
            Some(0) => write!(f, " at {} {first}", location.noun())?,
            Some(more) => write!(f, " at {} {first} to {}", location.nouns(), first + more)?,
        }
        write!(f, ": it has been there for {:.0} s", running.as_secs_f64())
    }
}

/// What one thread is doing. Written by it alone; a reader may see half of a change, which at
/// worst names the points of the call before.
#[derive(Debug, Default)]
struct Slot {
    /// Milliseconds since [`START`], plus one; 0 while no call is under way.
    since: AtomicU64,
    library: AtomicUsize,
    call: AtomicUsize,
    location: AtomicUsize,
    first: AtomicUsize,
    count: AtomicUsize,
}

static START: LazyLock<Instant> = LazyLock::new(Instant::now);
static NAMES: Mutex<Vec<String>> = Mutex::new(Vec::new());
static SLOTS: Mutex<Vec<Arc<Slot>>> = Mutex::new(Vec::new());

const CALLS: [&str; 6] =
    ["create", "rates", "rate_partials", "length_factor", "length_factor_partials", "observe"];
const LOCATIONS: [Location; 3] = [Location::Vertex, Location::Face, Location::Edge];

thread_local! {
    static SLOT: OnceCell<Arc<Slot>> = const { OnceCell::new() };
}

/// Gives a library its number.
pub(super) fn enter(name: &str) -> usize {
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    names.push(name.to_owned());
    names.len() - 1
}

/// Ends the watch over a call when it goes out of scope.
pub(super) struct Watched(Arc<Slot>);

impl Drop for Watched {
    fn drop(&mut self) {
        self.0.since.store(0, Ordering::Relaxed);
    }
}

/// Begins to watch over a call of this thread.
pub(super) fn begin(call: &Call<'_>) -> Watched {
    let slot = SLOT.with(|slot| {
        let register = || {
            let slot = Arc::new(Slot::default());
            SLOTS.lock().unwrap_or_else(PoisonError::into_inner).push(Arc::clone(&slot));
            slot
        };
        Arc::clone(slot.get_or_init(register))
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

fn now() -> u64 {
    u64::try_from(START.elapsed().as_millis()).unwrap_or(u64::MAX - 1)
}

/// The call that has been under way longest, if that is longer than `limit`.
#[must_use]
pub fn overdue(limit: Duration) -> Option<Overdue> {
    let slots = SLOTS.lock().unwrap_or_else(PoisonError::into_inner);
    let running = |slot: &Slot| match slot.since.load(Ordering::Acquire) {
        0 => Duration::ZERO,
        since => Duration::from_millis((now() + 1).saturating_sub(since)),
    };
    let slot = slots.iter().max_by_key(|slot| running(slot))?;
    let running = running(slot);
    if running <= limit {
        return None;
    }
    let names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    let at = |number: &AtomicUsize| number.load(Ordering::Relaxed);
    Some(Overdue {
        plugin: names.get(at(&slot.library)).cloned().unwrap_or_default(),
        call: CALLS.get(at(&slot.call)).copied().unwrap_or("a call"),
        location: LOCATIONS.get(at(&slot.location)).copied().unwrap_or(Location::Vertex),
        first: at(&slot.first),
        count: at(&slot.count),
        running,
    })
}
