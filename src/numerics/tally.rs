//! What work costs: how often it is done, how long it takes, how much memory it keeps.
//!
//! A [`Tally`] has a [`Meter`] for every kind of work. A piece of work opens a [`Scope`]; when that
//! ends, the time and memory since its beginning go to its meter, less what scopes that began and ended
//! within took: every moment counts once, so the times of all meters add up to the wall time less what no
//! scope covers.
//!
//! Times are those of the calling thread, from beginning to end: other threads that it waits for are in them.
//! Memory is what remains allocated by the whole program, if it says how much that is
//! ([`watch_memory`]). A scope costs two readings of the clock; where that is much beside the work
//! ([`Meter::sampled_scope`]), one piece in so many is timed, for all. Counts are integers.
//!
//! A tally also keeps one account of [`Work`] for the whole model: what was done, wherever it was done.

mod work;

pub use work::{Spent, Work};

use std::sync::atomic::{AtomicI64, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// What a program's allocator says.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Allocated {
    /// Bytes allocated and not yet freed.
    pub bytes: usize,
    /// Allocations so far; 0 from an allocator that does not count them.
    pub times: usize,
}

static ALLOCATOR: OnceLock<fn() -> Allocated> = OnceLock::new();

/// Lets all tallies of this program ask `allocator`; the first one stays.
pub fn watch_memory(allocator: fn() -> Allocated) {
    let _ = ALLOCATOR.set(allocator);
}

/// What is allocated now; `None` in a program whose allocator does not say.
#[must_use]
pub fn allocated() -> Option<Allocated> {
    ALLOCATOR.get().map(|ask| ask())
}

/// The same as signed numbers, of which differences are taken.
fn reading() -> [i64; 2] {
    let now = allocated().unwrap_or_default();
    [now.bytes, now.times].map(|n| i64::try_from(n).unwrap_or(i64::MAX))
}

/// Of brief pieces one in so many is timed.
const SAMPLE_INTERVAL: u64 = 16;

/// Sums of the scopes that have ended, each counted once.
#[derive(Debug, Default)]
struct Sums {
    /// May be less than 0 for a while: a brief piece that is timed counts for many.
    nanoseconds: AtomicI64,
    memory: [AtomicI64; 2],
}

/// Meters of one model, shared by its copies.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    all: Arc<Sums>,
    meters: Arc<Mutex<Vec<Meter>>>,
    work: Arc<Mutex<Work>>,
}

/// The meter of one kind of work; copies are the same meter.
#[derive(Debug, Clone)]
pub struct Meter(Arc<Entry>);

#[derive(Debug)]
struct Entry {
    group: &'static str,
    name: String,
    labels: &'static [&'static str],
    counts: Vec<AtomicU64>,
    /// Brief pieces since one was timed.
    untimed: AtomicU64,
    own: Sums,
    all: Arc<Sums>,
}

impl Entry {
    /// For how many brief pieces the one that begins is to be timed; 0 for none. Threads that ask at the
    /// same time may spoil a sample.
    fn sample(&self) -> i64 {
        let untimed = self.untimed.load(Relaxed) + 1;
        let timed = untimed >= SAMPLE_INTERVAL;
        self.untimed.store(if timed { 0 } else { untimed }, Relaxed);
        if timed { SAMPLE_INTERVAL.cast_signed() } else { 0 }
    }
}

/// Nanoseconds.
fn nanoseconds(time: Duration) -> i64 {
    i64::try_from(time.as_nanos()).unwrap_or(i64::MAX)
}

/// What one meter shows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cost {
    /// What sort of work it is.
    pub group: &'static str,
    /// Which work.
    pub name: String,
    /// How often, by what was done.
    pub counts: Vec<(&'static str, u64)>,
    /// Wall time.
    pub time: Duration,
    /// Bytes that it has allocated and not freed.
    pub bytes: i64,
    /// Allocations, where the allocator counts them.
    pub allocations: i64,
}

impl Tally {
    /// The meter called `name` of a group; made when it is first asked for, with these names of counts.
    #[must_use]
    pub fn meter(&self, group: &'static str, name: &str, labels: &'static [&'static str]) -> Meter {
        let mut meters = self.meters.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = meters.iter().find(|m| m.0.group == group && m.0.name == name) {
            return known.clone();
        }
        let counts = labels.iter().map(|_| AtomicU64::new(0)).collect();
        let (own, all) = (Sums::default(), Arc::clone(&self.all));
        let (name, untimed) = (name.to_owned(), AtomicU64::default());
        let made = Meter(Arc::new(Entry { group, name, labels, counts, untimed, own, all }));
        meters.push(made.clone());
        made
    }

    /// Adds to the account of work; for pieces as large as an evaluation of the model.
    pub fn count(&self, add: impl FnOnce(&mut Work)) {
        add(&mut self.work.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// Does `what` and leaves it out of the account: what is only inspected for reports, while nothing else is done.
    pub fn uncounted<R>(&self, what: impl FnOnce() -> R) -> R {
        let before = self.work();
        let done = what();
        self.count(|work| *work = before);
        done
    }

    /// The work done so far.
    #[must_use]
    pub fn work(&self) -> Work {
        *self.work.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What all meters show, in the order in which they were made.
    #[must_use]
    pub fn costs(&self) -> Vec<Cost> {
        let meters = self.meters.lock().unwrap_or_else(PoisonError::into_inner);
        meters.iter().map(Meter::cost).collect()
    }
}

impl Meter {
    /// Counts one piece of work, number `what` of the meter's names, and times it until the scope is
    /// dropped.
    #[must_use = "the work ends where the scope is dropped"]
    pub fn scope(&self, what: usize) -> Scope {
        self.count(what);
        self.uncounted_scope()
    }

    /// The same for work that is as brief as two readings of the clock: one piece in sixteen is timed, for all.
    #[must_use = "the work ends where the scope is dropped"]
    pub fn sampled_scope(&self, what: usize) -> Scope {
        self.count(what);
        self.begin(Some(reading()), self.0.sample())
    }

    /// The same for work that hands out what it allocates: its memory is that of the scope around it.
    #[must_use = "the work ends where the scope is dropped"]
    pub fn transferring_scope(&self, what: usize) -> Scope {
        self.count(what);
        self.begin(None, 1)
    }

    /// The same for work that is not counted: what is made once and kept.
    #[must_use = "the work ends where the scope is dropped"]
    pub fn uncounted_scope(&self) -> Scope {
        self.begin(Some(reading()), 1)
    }

    fn begin(&self, reading: Option<[i64; 2]>, weight: i64) -> Scope {
        let Sums { nanoseconds, memory } = &*self.0.all;
        Scope {
            within: (nanoseconds.load(Relaxed), [0, 1].map(|k| memory[k].load(Relaxed))),
            memory: reading,
            weight,
            began: (weight > 0).then(Instant::now),
            meter: self.clone(),
        }
    }

    /// Counts one piece of work that is not timed.
    pub fn count(&self, what: usize) {
        if let Some(count) = self.0.counts.get(what) {
            count.fetch_add(1, Relaxed);
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// Adds what was measured otherwise, while no scope was open.
    pub fn add(&self, time: Duration, bytes: i64) {
        self.0.own.nanoseconds.fetch_add(nanoseconds(time), Relaxed);
        self.0.own.memory[0].fetch_add(bytes, Relaxed);
    }

    fn cost(&self) -> Cost {
        let Entry { group, name, labels, counts, own, .. } = &*self.0;
        Cost {
            group,
            name: name.clone(),
            counts: labels.iter().zip(counts).map(|(l, c)| (*l, c.load(Relaxed))).collect(),
            time: Duration::from_nanos(own.nanoseconds.load(Relaxed).max(0).cast_unsigned()),
            bytes: own.memory[0].load(Relaxed),
            allocations: own.memory[1].load(Relaxed),
        }
    }
}

/// A piece of work under way.
#[derive(Debug)]
pub struct Scope {
    meter: Meter,
    /// If it is timed.
    began: Option<Instant>,
    /// For how many pieces it is timed.
    weight: i64,
    /// Of a scope whose memory is another's, none.
    memory: Option<[i64; 2]>,
    /// The sums when it began.
    within: (i64, [i64; 2]),
}

impl Drop for Scope {
    fn drop(&mut self) {
        let Entry { own, all, .. } = &*self.meter.0;
        let (within, weight) = (self.within.0, self.weight);
        // What it took, for all pieces that it stands for; of one that is not timed nothing is known, and what
        // began within counts with those that are.
        let took = self.began.map_or(0, |began| nanoseconds(began.elapsed()));
        if weight > 0 {
            let inner = all.nanoseconds.load(Relaxed).saturating_sub(within);
            own.nanoseconds.fetch_add(weight.saturating_mul(took.saturating_sub(inner)), Relaxed);
        }
        all.nanoseconds.store(within.saturating_add(weight.saturating_mul(took)), Relaxed);
        let Some(before) = self.memory else { return };
        let now = reading();
        for k in [0, 1] {
            let change = now[k].saturating_sub(before[k]);
            let inner = all.memory[k].load(Relaxed).saturating_sub(self.within.1[k]);
            if change != inner {
                own.memory[k].fetch_add(change.saturating_sub(inner), Relaxed);
            }
            all.memory[k].store(self.within.1[k].saturating_add(change), Relaxed);
        }
    }
}
