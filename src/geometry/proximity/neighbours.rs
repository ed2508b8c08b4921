//! The clusters that are near one another, at a shape or on a step.

use rumple_numerics::num::{index, real};
use rumple_numerics::{Vec3, parallel};

use super::advance::{Pair, PairKind};
use super::patches::Cluster;
use super::search::{Features, Limit, PairSearch};
use crate::box_tree::{Bounds, BoxTree};

/// Pairs are taken over where at least this share of the allowed approach of their clusters is left.
const REUSE_SHARE: f64 = 0.5;

/// By how much clusters approach at most where every vertex moves by 1: their middles by 2, their spreads by 4.
pub(super) const MAX_APPROACH_RATE: f64 = 6.0;

/// The clusters that are near one another.
#[derive(Debug)]
pub(super) struct Neighbours {
    /// For every cluster those of its number or later, ascending.
    of: Vec<Vec<Neighbour>>,
    /// How much nearer features of others may come until there are pairs.
    unlisted: f64,
    /// Memory of how clusters have moved.
    moved: Vec<ClusterMotion>,
}

/// A cluster near another.
#[derive(Debug, Clone)]
struct Neighbour {
    number: u32,
    /// How much nearer features may come until there are other pairs.
    allowed: f64,
    pairs: Pairs,
}

/// Pairs of the features of two clusters.
#[derive(Debug, Clone)]
enum Pairs {
    /// There are none.
    None,
    /// Not searched for.
    Unknown,
    Known(Vec<Pair>),
}

/// How the corners of a cluster have moved: the displacement of the middle one, and the largest deviation from it.
#[derive(Debug, Clone, Copy)]
pub(super) struct ClusterMotion {
    middle: Vec3,
    pub(super) spread: f64,
}

impl ClusterMotion {
    /// Of one cluster.
    pub(super) fn new(cluster: &Cluster, moved: &impl Fn(u32) -> Vec3) -> Self {
        let middle = moved(cluster.middle);
        let apart = |v: &u32| (moved(*v) - middle).norm_squared();
        let spread = cluster.corners.iter().map(apart).fold(0.0, f64::max).sqrt();
        Self { middle, spread }
    }

    /// Of all clusters, into `all`.
    fn all(clusters: &[Cluster], moved: &(impl Fn(u32) -> Vec3 + Sync), all: &mut Vec<Self>) {
        all.resize(clusters.len(), Self { middle: Vec3::zeros(), spread: 0.0 });
        parallel::fill(all, |k| Self::new(&clusters[k], moved));
    }

    /// By how much features of any two clusters of `all` have come nearer at most, or by so much more than before.
    pub(super) fn farthest(all: &[Self]) -> f64 {
        let common = Self::common(all);
        2.0 * parallel::max(all.len(), |k| all[k].approach(&common))
    }

    /// The mean motion of `all`.
    fn common(all: &[Self]) -> Self {
        let sum: Vec3 = all.iter().map(|moved| moved.middle).sum();
        Self { middle: sum / real(all.len().max(1)), spread: 0.0 }
    }

    /// By how much features of two clusters have come nearer at most.
    #[inline]
    fn approach(&self, other: &Self) -> f64 {
        (self.middle - other.middle).norm() + self.spread + other.spread
    }
}

/// The boxes of a cluster: in the shape, on a step but for what all have in common, and of displacements.
#[derive(Clone, Copy)]
struct Boxes {
    now: Bounds,
    swept: Bounds,
    moves: Bounds,
}

impl Boxes {
    /// Of all clusters at the shape x and on its step d.
    fn all(clusters: &[Cluster], (x, d): (&[Vec3], Option<&[Vec3]>)) -> Vec<Self> {
        let common = d.map_or(Vec3::zeros(), |d| d.iter().sum::<Vec3>() / real(d.len().max(1)));
        let none = Self { now: Bounds::EMPTY, swept: Bounds::EMPTY, moves: Bounds::EMPTY };
        let mut boxes = vec![none; clusters.len()];
        parallel::fill(&mut boxes, |k| {
            let (cluster, now) = (&clusters[k], clusters[k].bounds(x));
            let Some(d) = d else { return Self { now, swept: now, ..none } };
            let end = |v: &u32| x[*v as usize] + d[*v as usize] - common;
            let swept = now.with(&Bounds::enclosing(cluster.corners.iter().map(end)));
            Self { now, swept, moves: cluster.bounds(d) }
        });
        boxes
    }
}

/// The clusters that may be near one another, by what was known of another shape.
pub(super) struct Candidates<'a> {
    before: &'a Neighbours,
    /// Of every cluster the later ones that a patch covered which no longer keeps them apart.
    uncovered: Vec<Vec<u32>>,
    /// How much nearer features of all others may come.
    unlisted: f64,
}

impl<'a> Candidates<'a> {
    /// Those `before`, where vertices have `moved`, and where patches that kept their points apart no longer do; nothing where
    /// too little would be `left` of how far others may approach.
    pub(super) fn new(
        clusters: &[Cluster],
        (before, left): (&'a Neighbours, f64),
        moved: &(impl Fn(u32) -> Vec3 + Sync),
        (were_apart, are_apart): (impl Fn(usize) -> bool, impl Fn(usize) -> bool),
    ) -> Option<Self> {
        let mut all = Vec::new();
        ClusterMotion::all(clusters, moved, &mut all);
        let unlisted = before.unlisted - ClusterMotion::farthest(&all);
        if !(unlisted >= left) {
            return None;
        }
        let mut uncovered = vec![Vec::new(); clusters.len()];
        for k in (0..clusters.len()).filter(|k| were_apart(*k) && !are_apart(*k)) {
            for j in &clusters[k].patch.covers {
                let (first, later) = (k.min(*j as usize), index(k).max(*j));
                uncovered[first].push(later);
            }
        }
        Some(Self { before, uncovered, unlisted })
    }

    /// Those of cluster `k`.
    fn of_cluster(&self, k: usize) -> impl Iterator<Item = u32> {
        let before = self.before.of[k].iter().map(|other| other.number);
        before.chain(self.uncovered[k].iter().copied())
    }
}

impl Neighbours {
    /// The neighbours within `limit`, and with room up to `beyond`, at the shape x and on its step d, among the `candidates` if
    /// there are any. Those that `apart` holds of have no pairs with clusters that their patch covers.
    pub(super) fn find(
        (clusters, tree): (&[Cluster], &mut BoxTree),
        (x, d): (&[Vec3], Option<&[Vec3]>),
        limit: &Limit<'_>,
        (apart, beyond): (&(impl Fn(usize) -> bool + Sync), f64),
        candidates: Option<&Candidates<'_>>,
    ) -> Self {
        let boxes = Boxes::all(clusters, (x, d));
        if candidates.is_none() {
            tree.refit(|k| boxes[k as usize].swept);
        }
        let tree = &*tree;
        let farthest = limit.farthest() + beyond;
        let covers =
            |k: usize, j: u32| apart(k) && clusters[k].patch.covers.binary_search(&j).is_ok();
        let near = |k: usize| {
            let (own, ours, mut found) = (&clusters[k], &boxes[k], Vec::new());
            let enter = |node: &Bounds| node.gap(&ours.swept) < farthest;
            let consider = |j: u32| {
                let (other, theirs) = (&clusters[j as usize], &boxes[j as usize]);
                if (j as usize) < k
                    || own.same_body(&clusters[j as usize])
                    || covers(k, j)
                    || covers(j as usize, index(k))
                {
                    return;
                }
                let relative = d.map_or(0.0, |_| ours.moves.span(&theirs.moves));
                let gap = ours.now.gap(&theirs.now) - relative;
                let gap = gap.max(ours.swept.gap(&theirs.swept));
                let room = limit.excess_distance(gap, own.span(other));
                if room <= beyond {
                    let pairs = if room <= 0.0 { Pairs::Unknown } else { Pairs::None };
                    found.push(Neighbour {
                        number: j,
                        allowed: limit.slack + room.max(0.0),
                        pairs,
                    });
                }
            };
            match candidates {
                Some(candidates) => candidates.of_cluster(k).for_each(consider),
                None => tree.visit(enter, 0, consider),
            }
            found.sort_unstable_by_key(|other| other.number);
            found.dedup_by_key(|other| other.number);
            found
        };
        let mut of = vec![Vec::new(); clusters.len()];
        parallel::update(&mut of, |k, place| *place = near(k));
        let unlisted = candidates.map_or(limit.slack + beyond, |of| of.unlisted);
        Self { of, unlisted, moved: Vec::with_capacity(clusters.len()) }
    }

    /// Whether any clusters are not known to have no pairs.
    pub(super) fn any(&self) -> bool {
        self.of.iter().flatten().any(|other| !matches!(other.pairs, Pairs::None))
    }

    /// How all clusters have moved, where vertices have `moved`.
    pub(super) fn moved(
        &mut self,
        clusters: &[Cluster],
        moved: &(impl Fn(u32) -> Vec3 + Sync),
    ) -> &[ClusterMotion] {
        ClusterMotion::all(clusters, moved, &mut self.moved);
        &self.moved
    }

    /// How much further every vertex may move, now that vertices have `moved`, until the pairs may not be all there are; less
    /// than 0 where they are not.
    pub(super) fn remaining_displacement(
        &mut self,
        clusters: &[Cluster],
        moved: &(impl Fn(u32) -> Vec3 + Sync),
    ) -> f64 {
        self.moved(clusters, moved);
        let (all, listed) = (&self.moved, &self.of);
        let (common, far) = (ClusterMotion::common(all), 0.5 * self.unlisted);
        let excess = |k: usize| {
            let far = all[k].approach(&common) - far;
            let beyond =
                |other: &Neighbour| all[k].approach(&all[other.number as usize]) - other.allowed;
            listed[k].iter().map(beyond).fold(far, f64::max)
        };
        -parallel::max(clusters.len(), excess) / MAX_APPROACH_RATE
    }

    /// Takes over the pairs of clusters that have used up little of what they may approach since those `before`, as
    /// vertices have `moved`.
    pub(super) fn reuse_pairs(
        &mut self,
        clusters: &[Cluster],
        before: &Self,
        moved: &(impl Fn(u32) -> Vec3 + Sync),
    ) {
        let mut all = Vec::new();
        ClusterMotion::all(clusters, moved, &mut all);
        parallel::update(&mut self.of, |k, near| {
            for other in near.iter_mut().filter(|other| !matches!(other.pairs, Pairs::None)) {
                let old = &before.of[k];
                let Ok(place) = old.binary_search_by_key(&other.number, |old| old.number) else {
                    continue;
                };
                let Pairs::Known(pairs) = &old[place].pairs else { continue };
                let left = old[place].allowed - all[k].approach(&all[other.number as usize]);
                if left >= REUSE_SHARE * other.allowed {
                    other.allowed = left;
                    other.pairs = Pairs::Known(pairs.clone());
                }
            }
        });
    }

    /// All pairs, of which `search` finds those not known yet, by vertex and triangle, then by edges.
    pub(super) fn pairs<K: Fn(PairKind, &[u32; 4]) -> Option<f64> + Sync>(
        &mut self,
        clusters: &[Cluster],
        search: &PairSearch<'_, K>,
    ) -> Vec<Pair> {
        let mut needed = vec![false; clusters.len()];
        for (k, near) in self.of.iter().enumerate() {
            for other in near.iter().filter(|other| matches!(other.pairs, Pairs::Unknown)) {
                [k, other.number as usize].iter().for_each(|k| needed[*k] = true);
            }
        }
        let mut features: Vec<Option<Features>> = clusters.iter().map(|_| None).collect();
        parallel::fill(&mut features, |k| needed[k].then(|| search.features(&clusters[k])));
        parallel::update(&mut self.of, |k, near| {
            let Some(own) = &features[k] else { return };
            for other in near.iter_mut().filter(|other| matches!(other.pairs, Pairs::Unknown)) {
                let (j, mut found) = (other.number as usize, Vec::new());
                match &features[j] {
                    _ if j == k => search.within(own, &mut found),
                    Some(theirs) => search.between(own, theirs, &mut found),
                    None => (),
                }
                other.pairs = Pairs::Known(found);
            }
        });
        let known = self.of.iter().flatten().filter_map(|other| match &other.pairs {
            Pairs::Known(pairs) => Some(pairs),
            _ => None,
        });
        let mut all: Vec<Pair> = known.flatten().copied().collect();
        all.sort_unstable_by_key(|pair| (pair.kind, pair.features));
        all
    }
}
