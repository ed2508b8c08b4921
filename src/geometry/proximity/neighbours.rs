//! The clusters that are near one another, at a shape or on a step.

use rumple_numerics::Vec3;
use rumple_numerics::num::{index, real};
use rumple_numerics::parallel;

use super::advance::Kind;
use super::clusters::Cluster;
use super::pairs::Pair;
use super::search::{Features, Limit, Search};
use crate::box_tree::{Bounds, BoxTree};

/// Clusters of which one thread takes care at a time.
const AT_ONCE: usize = 16;

/// The clusters that are near one another.
#[derive(Debug)]
pub(super) struct Neighbours {
    /// For every cluster those of its number or later, ascending.
    of: Vec<Vec<Neighbour>>,
    /// How much nearer than listed features of others may come until they make pairs.
    beyond: f64,
}

/// A cluster near another.
#[derive(Debug, Clone, Copy)]
struct Neighbour {
    number: u32,
    /// Beyond the slack of the limit, how much nearer features may come until they make pairs; not positive where there
    /// may be pairs.
    room: f64,
}

/// The boxes of a cluster: in the shape, on a step but for what all have in common, and of displacements.
#[derive(Clone, Copy)]
struct Boxes {
    now: Bounds,
    swept: Bounds,
    moves: Bounds,
}

impl Neighbours {
    /// The neighbours within `limit`, and with room up to `beyond`, at the shape x and on its step d. Those that `apart`
    /// holds of have no pairs with clusters that their patch covers.
    pub(super) fn find(
        (clusters, tree): (&[Cluster], &mut BoxTree),
        (x, d): (&[Vec3], Option<&[Vec3]>),
        limit: &Limit<'_>,
        (apart, beyond): (&(impl Fn(usize) -> bool + Sync), f64),
    ) -> Self {
        let common = d.map_or(Vec3::zeros(), |d| d.iter().sum::<Vec3>() / real(d.len().max(1)));
        let none = Boxes { now: Bounds::EMPTY, swept: Bounds::EMPTY, moves: Bounds::EMPTY };
        let mut boxes = vec![none; clusters.len()];
        parallel::fill(&mut boxes, |k| {
            let (cluster, now) = (&clusters[k], clusters[k].bounds(x));
            let Some(d) = d else { return Boxes { now, swept: now, ..none } };
            let end = |v: &u32| x[*v as usize] + d[*v as usize] - common;
            let swept = now.with(&Bounds::of(cluster.corners.iter().map(end)));
            Boxes { now, swept, moves: cluster.bounds(d) }
        });
        tree.refit(|k| boxes[k as usize].swept);
        let tree = &*tree;
        let farthest = limit.farthest() + beyond;
        let covers = |k: usize, j: u32| {
            apart(k) && clusters[k].patch.covers.binary_search(&j).is_ok()
        };
        let near = |k: usize| {
            let (own, ours, mut found) = (&clusters[k], &boxes[k], Vec::new());
            let enter = |node: &Bounds| node.gap(&ours.swept) < farthest;
            tree.visit(enter, 0, |j| {
                let (other, theirs) = (&clusters[j as usize], &boxes[j as usize]);
                if (j as usize) < k || covers(k, j) || covers(j as usize, index(k)) {
                    return;
                }
                let relative = d.map_or(0.0, |_| ours.moves.span(&theirs.moves));
                let gap = ours.now.gap(&theirs.now) - relative;
                let gap = gap.max(ours.swept.gap(&theirs.swept));
                let room = limit.room(gap, own.span(other));
                if room <= beyond {
                    found.push(Neighbour { number: j, room });
                }
            });
            found.sort_unstable_by_key(|other| other.number);
            found
        };
        let mut of = vec![Vec::new(); clusters.len()];
        parallel::update(&mut of, |k, place| *place = near(k));
        Self { of, beyond }
    }

    /// Whether no two features that make no pair have come nearer by more than `slack` beyond their room, now that vertices
    /// have `moved`.
    pub(super) fn last(&self, clusters: &[Cluster], slack: f64, moved: &(impl Fn(u32) -> Vec3 + Sync)) -> bool {
        // Mean displacement, and the largest deviation from it.
        let of = |corners: &[u32]| {
            let mean = corners.iter().map(|v| moved(*v)).sum::<Vec3>() / real(corners.len().max(1));
            let apart = corners.iter().map(|v| (moved(*v) - mean).norm_squared()).fold(0.0, f64::max);
            (mean, apart.sqrt())
        };
        let mut all = vec![(Vec3::zeros(), 0.0); clusters.len()];
        parallel::fill(&mut all, |k| of(&clusters[k].corners));
        let common = all.iter().map(|(mean, _)| mean).sum::<Vec3>() / real(all.len().max(1));
        let excess = |k: usize| {
            let (mean, own) = all[k];
            let far = (mean - common).norm() + own - 0.5 * (slack + self.beyond);
            self.of[k].iter().fold(far, |most, other| {
                let (theirs, spread) = all[other.number as usize];
                most.max((theirs - mean).norm() + own + spread - slack - other.room.max(0.0))
            })
        };
        parallel::max(clusters.len(), excess) <= 0.0
    }

    /// All pairs that `search` finds, by vertex and triangle, then by edges.
    pub(super) fn pairs<K: Fn(Kind, &[u32; 4]) -> Option<f64> + Sync>(
        &self,
        clusters: &[Cluster],
        search: &Search<'_, K>,
    ) -> Vec<Pair> {
        let mut needed = vec![false; clusters.len()];
        let near = |k: usize| self.of[k].iter().filter(|other| other.room <= 0.0);
        for k in 0..clusters.len() {
            near(k).for_each(|other| [k, other.number as usize].iter().for_each(|k| needed[*k] = true));
        }
        let mut features: Vec<Option<Features>> = clusters.iter().map(|_| None).collect();
        parallel::fill(&mut features, |k| needed[k].then(|| search.features(&clusters[k])));
        let of = |k: usize, found: &mut Vec<Pair>| {
            let Some(own) = &features[k] else { return };
            for j in near(k).map(|other| other.number as usize) {
                match &features[j] {
                    _ if j == k => search.within(own, found),
                    Some(other) => search.between(own, other, found),
                    None => (),
                }
            }
        };
        let block = |b: usize| {
            let mut found = Vec::new();
            (b * AT_ONCE..((b + 1) * AT_ONCE).min(clusters.len())).for_each(|k| of(k, &mut found));
            found
        };
        let both = |mut a: Vec<Pair>, mut b: Vec<Pair>| {
            a.append(&mut b);
            a
        };
        let mut all =
            parallel::reduce(clusters.len().div_ceil(AT_ONCE), &block, &both).unwrap_or_default();
        all.sort_unstable_by_key(|pair| (pair.kind, pair.features));
        all
    }
}
