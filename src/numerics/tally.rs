//! What work costs: how often it is done, and how long it takes.
//!
//! A [`Tally`] has a [`Meter`] for every kind of work. A piece of work opens a [`Scope`]; when that
//! ends, the time since its beginning goes to its meter, less what scopes that began and ended
//! within took: every moment counts once, so the times of all meters add up to the wall time less what no
//! scope covers.
//!
//! Times are those of the calling thread, from beginning to end: other threads that it waits for are in them.
//! A scope costs two readings of the clock; where that is much beside the work
//! ([`Meter::sampled_scope`]), one piece in so many is timed, for all. Counts are integers.
//!
//! A tally also keeps one account of [`Work`] for the whole model: what was done, wherever it was done.

mod work;

pub use work::{Spent, Work};

use std::sync::atomic::{AtomicI64, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// Most names of counts of one meter.
const MOST_COUNTS: usize = 10;

/// Of brief pieces one in so many is timed.
const SAMPLE_INTERVAL: u64 = 16;

/// Sum over the scopes that have ended, each counted once, ns; it may be less than 0 for a while, as a brief piece that
/// is timed counts for many.
type Nanoseconds = AtomicI64;

/// Meters of one model, shared by its copies.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    all: Arc<Nanoseconds>,
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
    counts: [Count; MOST_COUNTS],
    /// Brief pieces since one was timed.
    untimed: AtomicU64,
    own: Nanoseconds,
    all: Arc<Nanoseconds>,
}

/// How often something was done; free until it is first done.
#[derive(Debug, Default)]
struct Count {
    what: OnceLock<&'static str>,
    times: AtomicU64,
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
}

impl Tally {
    /// The meter called `name` of a group; made when it is first asked for.
    #[must_use]
    pub fn meter(&self, group: &'static str, name: &str) -> Meter {
        let mut meters = self.meters.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = meters.iter().find(|m| m.0.group == group && m.0.name == name) {
            return known.clone();
        }
        let (counts, untimed, own) = Default::default();
        let (name, all) = (name.to_owned(), Arc::clone(&self.all));
        let made = Meter(Arc::new(Entry { group, name, counts, untimed, own, all }));
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
    /// Counts one piece of the work called `what`, and times it until the scope is dropped.
    #[must_use = "the work ends where the scope is dropped"]
    pub fn scope(&self, what: &'static str) -> Scope {
        self.count(what);
        self.uncounted_scope()
    }

    /// The same for work that is not counted: what is made once and kept.
    #[must_use = "the work ends where the scope is dropped"]
    pub fn uncounted_scope(&self) -> Scope {
        self.begin(1)
    }

    /// The same for work that is as brief as two readings of the clock: one piece in sixteen is timed, for all, and none is
    /// counted.
    #[must_use = "the work ends where the scope is dropped"]
    pub fn sampled_scope(&self) -> Scope {
        self.begin(self.0.sample())
    }

    fn begin(&self, weight: i64) -> Scope {
        let began = (weight > 0).then(Instant::now);
        Scope { within: self.0.all.load(Relaxed), weight, began, meter: self.clone() }
    }

    /// Counts one piece of work that is not timed.
    pub fn count(&self, what: &'static str) {
        let count = self.0.counts.iter().find(|count| *count.what.get_or_init(|| what) == what);
        debug_assert!(count.is_some(), "more than {MOST_COUNTS} names of counts");
        if let Some(count) = count {
            count.times.fetch_add(1, Relaxed);
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// Adds what was measured otherwise, while no scope was open.
    pub fn add(&self, time: Duration) {
        self.0.own.fetch_add(nanoseconds(time), Relaxed);
    }

    fn cost(&self) -> Cost {
        let Entry { group, name, counts, own, .. } = &*self.0;
        let known = |count: &Count| Some((*count.what.get()?, count.times.load(Relaxed)));
        Cost {
            group,
            name: name.clone(),
            counts: counts.iter().filter_map(known).collect(),
            time: Duration::from_nanos(own.load(Relaxed).max(0).cast_unsigned()),
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
    /// The sum when it began.
    within: i64,
}

impl Drop for Scope {
    fn drop(&mut self) {
        let Entry { own, all, .. } = &*self.meter.0;
        let Self { within, weight, .. } = *self;
        // What it took, for all pieces that it stands for; of one that is not timed nothing is known, and what
        // began within counts with those that are.
        let took = self.began.map_or(0, |began| nanoseconds(began.elapsed()));
        if weight > 0 {
            let inner = all.load(Relaxed).saturating_sub(within);
            own.fetch_add(weight.saturating_mul(took.saturating_sub(inner)), Relaxed);
        }
        all.store(within.saturating_add(weight.saturating_mul(took)), Relaxed);
    }
}
