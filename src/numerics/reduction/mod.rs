//! Sums, maxima and decisions over the whole sheet.
//!
//! Whatever a solver or a stepper sums, compares or decides over all points passes one value, a [`Reduction`]; the
//! rest of its work is local to a point and its neighbours. By default it means this process: its threads, and the same
//! bits on any number of them ([`parallel`]). Where a sheet is spread over ranks, a [`Communicator`] combines what these
//! give; of the points of a rank those that it owns come first, and ghosts, the copies of its neighbours' points, are
//! not counted ([`Distribution`]). Sums over ranks depend in their last digits on the number of ranks.

mod distribution;

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use crate::Vec3;
use crate::parallel::{self, vectors};
pub use distribution::{CommunicationCounts, Communicator, Distribution, HaloMap, OneProcess};

/// What sums, maxima and decisions are taken over.
#[derive(Clone, Default)]
pub struct Reduction(Option<Arc<Distribution>>);

impl fmt::Debug for Reduction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { "Reduction(ranks)" } else { "Reduction(threads)" })
    }
}

/// The same ranks.
impl PartialEq for Reduction {
    fn eq(&self, other: &Self) -> bool {
        match (&self.0, &other.0) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (a, b) => a.is_none() && b.is_none(),
        }
    }
}

impl Eq for Reduction {}

impl Reduction {
    /// Over several ranks.
    #[must_use]
    pub fn over(ranks: Arc<Distribution>) -> Self {
        Self(Some(ranks))
    }

    /// The share of this rank; `None` in one process.
    #[must_use]
    pub fn distribution(&self) -> Option<&Arc<Distribution>> {
        self.0.as_ref()
    }

    /// The same of a sheet that is spread over ranks; `None` of a periodic one in one process too.
    #[must_use]
    pub fn ranks(&self) -> Option<&Arc<Distribution>> {
        self.distribution().filter(|share| share.periods.is_empty())
    }

    /// The translations by which a periodic sheet repeats itself; none of other sheets.
    #[must_use]
    pub fn periods(&self) -> &[Vec3] {
        self.0.as_ref().map_or(&[], |share| &share.periods)
    }

    /// The shortest of `vector` and its sums with periods; `vector` on sheets that are not periodic.
    #[must_use]
    pub fn nearest_image(&self, mut vector: Vec3) -> Vec3 {
        for period in self.periods() {
            vector -= period * (vector.dot(period) / period.norm_squared()).round();
        }
        vector
    }

    /// Where a sheet with ghosts is, for messages: `None` of one without.
    #[must_use]
    pub fn place(&self) -> Option<&'static str> {
        let share = self.distribution()?;
        Some(if share.periods.is_empty() { "on more than one rank" } else { "on a periodic sheet" })
    }

    /// Whether this is the first rank, or the only process.
    #[must_use]
    pub fn is_first(&self) -> bool {
        self.0.as_ref().is_none_or(|ranks| ranks.communicator.rank() == 0)
    }

    /// How many of `count` points here are owned; they come first.
    #[must_use]
    pub fn owned(&self, count: usize) -> usize {
        self.0.as_ref().map_or(count, |ranks| ranks.owned(count))
    }

    /// Brings the ghosts of a vector to what their owners have.
    pub fn update_ghosts(&self, vector: &mut [Vec3]) {
        if let Some(ranks) = &self.0 {
            ranks.update_ghosts(&mut [vector], |v| (*v).into(), Vec3::from);
        }
    }

    /// Adds what ghosts have to their owners.
    pub fn add_ghosts_to_owners(&self, vector: &mut [Vec3]) {
        if let Some(ranks) = &self.0 {
            ranks.add_ghosts_to_owners(vector);
        }
    }

    /// Brings the ghosts of columns of one number a point to what their owners have.
    pub fn update_ghost_columns(&self, columns: &mut [Vec<f64>]) {
        if let Some(ranks) = &self.0 {
            let mut all: Vec<&mut [f64]> = columns.iter_mut().map(Vec::as_mut_slice).collect();
            ranks.update_ghosts(&mut all, |v| [*v], |[v]| v);
        }
    }

    /// Sums over the ranks of numbers that each has already summed over what it owns.
    pub fn sum_over_ranks(&self, values: &mut [f64]) {
        if let Some(ranks) = &self.0 {
            ranks.sum(values);
        }
    }

    /// The largest over the ranks of numbers that each has already compared over what it owns; NaN wins.
    pub fn max_over_ranks(&self, values: &mut [f64]) {
        if let Some(ranks) = &self.0 {
            ranks.max(values);
        }
    }

    /// How many points there are, of which `count` are here.
    #[must_use]
    pub fn count(&self, count: usize) -> f64 {
        let mut all = [crate::num::real(self.owned(count))];
        self.sum_over_ranks(&mut all);
        all[0]
    }

    /// `Σ_i f(i)` over all points, of which `count` are here.
    pub fn sum(&self, count: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
        let mut sum = [self.sum_here(count, f)];
        self.sum_over_ranks(&mut sum);
        sum[0]
    }

    /// The same over what is owned here: for [`Self::sum_over_ranks`] together with other sums.
    pub fn sum_here(&self, count: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
        parallel::sum(self.owned(count), f)
    }

    /// K sums at once, of which `f` gives those over a range of points.
    pub fn sums<const K: usize>(
        &self,
        count: usize,
        f: impl Fn(Range<usize>) -> [f64; K] + Sync,
    ) -> [f64; K] {
        let count = self.owned(count);
        let add = |a: [f64; K], b: [f64; K]| std::array::from_fn(|k| a[k] + b[k]);
        let block = |b: usize| f(b * parallel::BLOCK..((b + 1) * parallel::BLOCK).min(count));
        let blocks = count.div_ceil(parallel::BLOCK);
        let mut sums = parallel::reduce(blocks, &block, &add).unwrap_or([0.0; K]);
        self.sum_over_ranks(&mut sums);
        sums
    }

    /// The largest `f(i)` over all points, of which `count` are here; NaN wins over every number, no points give -∞.
    pub fn max(&self, count: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
        let mut largest = [parallel::max(self.owned(count), f)];
        self.max_over_ranks(&mut largest);
        largest[0]
    }

    /// The least `f(i)` over all points, of which `count` are here; no points give ∞.
    pub fn min(&self, count: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
        -self.max(count, |i| -f(i))
    }

    /// The larger of `here` on all ranks.
    #[must_use]
    pub fn largest_over_ranks(&self, here: f64) -> f64 {
        let mut largest = [here];
        self.max_over_ranks(&mut largest);
        largest[0]
    }

    /// The numbers of all ranks, in their order; those of this process.
    #[must_use]
    pub fn gathered(&self, here: Vec<f64>) -> Vec<f64> {
        let Some(ranks) = &self.0 else { return here };
        let bytes: Vec<u8> = here.iter().flat_map(|number| number.to_le_bytes()).collect();
        let all = ranks.communicator.all_gather(&bytes);
        let numbers = all.iter().flat_map(|bytes| bytes.as_chunks::<8>().0);
        numbers.map(|number| f64::from_le_bytes(*number)).collect()
    }

    /// Whether `here` holds on any rank.
    #[must_use]
    pub fn any(&self, here: bool) -> bool {
        let mut any = [if here { 1.0 } else { 0.0 }];
        self.max_over_ranks(&mut any);
        any[0] > 0.0
    }

    /// Whether `here` holds on every rank.
    #[must_use]
    pub fn all(&self, here: bool) -> bool {
        !self.any(!here)
    }

    /// `Σ_i a_i · b_i`.
    #[must_use]
    pub fn dot(&self, a: &[Vec3], b: &[Vec3]) -> f64 {
        self.sum(a.len(), |i| a[i].dot(&b[i]))
    }

    /// The products `v · w` for every `v` of `vectors`, in the order they come: vectors of `per_point` numbers a point,
    /// each read once, and one exchange between ranks.
    pub fn dots<'a>(
        &self,
        vectors: impl Iterator<Item = &'a [f64]>,
        w: &[f64],
        per_point: usize,
    ) -> Vec<f64> {
        let mut all = self.dots_here(vectors, w, per_point);
        self.sum_over_ranks(&mut all);
        all
    }

    /// The same over what is owned here: for [`Self::sum_over_ranks`] together with other sums.
    pub fn dots_here<'a>(
        &self,
        vectors: impl Iterator<Item = &'a [f64]>,
        w: &[f64],
        per_point: usize,
    ) -> Vec<f64> {
        let owned = per_point * self.owned(w.len() / per_point);
        vectors::dots(vectors.map(|v| &v[..owned]), &w[..owned])
    }

    /// `max_i |a_i|`.
    #[must_use]
    pub fn largest(&self, a: &[Vec3]) -> f64 {
        self.max(a.len(), |i| a[i].norm_squared()).sqrt()
    }

    /// `max_i |b_i - a_i|`.
    #[must_use]
    pub fn distance(&self, a: &[Vec3], b: &[Vec3]) -> f64 {
        self.max(a.len(), |i| (b[i] - a[i]).norm_squared()).sqrt()
    }
}
