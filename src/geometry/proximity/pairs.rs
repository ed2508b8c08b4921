//! The pairs of a vertex and a triangle, and of two edges, that are near one another.
//!
//! Each pair has a *reach*, the distance below which it counts: that of the whole range, but never more than half of
//! what the pair has in the rest positions, so that neighbours at rest do not count. Incident features (a vertex and
//! its triangles, edges with a vertex in common) make no pair.
//!
//! Most of a sheet is far from all others and bends gently: clusters of features whose boxes are far enough apart have no
//! pairs, nor have neighbours on a patch that keeps its points apart (`deformation.rs`). The features of what is left
//! are compared one by one. The list holds all pairs that may come within their reach while no vertex has moved
//! further, and no patch is deformed more, than it leaves room for. What is read from it (which pairs are within their
//! reach, how far a step may go) does not depend on when it was made.

use rumple_numerics::{Vec3, parallel};
use rumple_sheet::Sheet;

use super::advance::{Pair, PairKind, Reach, corner_positions};
use super::clusters::clusters;
use super::deformation::{Deformation, Deformed, changes};
use super::list::PairList;
use super::neighbours::Neighbours;
use super::patches::{Cluster, Patch};
use super::search::{Limit, PairSearch};
use crate::box_tree::{Bounds, BoxTree};
use crate::proximity::advance::MAX_REACH_SHARE;

/// How much nearer features of clusters with pairs may come until a list is rebuilt, in mean edges of the rest
/// positions. On a smooth sheet neighbours are too far apart for the list then; a longer one would hold them.
const PAIR_MARGIN: f64 = 0.3;
/// How much nearer clusters without pairs may come until a list is rebuilt, in mean edges.
const CLUSTER_MARGIN: f64 = 3.0;
/// A step ends where a pair is nearer than this share of its distance at the start, or of its reach.
const MIN_DISTANCE_SHARE: f64 = 0.1;

/// The pairs of one sheet.
#[derive(Debug)]
pub struct Proximity {
    clusters: Vec<Cluster>,
    tree: BoxTree,
    deformation: Deformation,
    /// Mean edge at rest.
    edge: f64,
    list: Option<PairList>,
    /// Memory of where a step ends.
    end: Vec<Vec3>,
}

impl Proximity {
    /// For the shapes of `sheet`, whose mean edge at rest is `edge`, and ranges about `reach`.
    #[must_use]
    pub fn new(sheet: &Sheet, edge: f64, reach: f64) -> Self {
        let clusters = clusters(sheet, reach);
        let boxes: Vec<Bounds> = clusters.iter().map(|c| c.bounds(sheet.rest())).collect();
        let tree = BoxTree::new(&boxes);
        let deformation = Deformation::new(sheet, &clusters);
        Self { clusters, tree, deformation, edge, list: None, end: Vec::new() }
    }

    /// The same for a sheet of two bodies that are far apart at rest, the vertices of the first before `first`: pairs are
    /// those of features of both.
    #[must_use]
    pub fn between(sheet: &Sheet, first: usize, edge: f64, reach: f64) -> Self {
        let mut made = Self::new(sheet, edge, reach);
        for cluster in &mut made.clusters {
            cluster.body = cluster.vertices.first().map(|v| (*v as usize) < first);
            // Nothing within a body has to be kept apart.
            cluster.patch = Patch::default();
        }
        made
    }

    /// All pairs of a vertex and a triangle that may be within their reach at `x`, by vertex and triangle, and all such
    /// pairs of edges.
    pub fn near(&mut self, sheet: &Sheet, x: &[Vec3], range: &Reach) -> (&[Pair], &[Pair]) {
        let pairs = &self.listed(sheet, x, range).pairs;
        pairs.split_at(pairs.partition_point(|pair| pair.kind == PairKind::PointTriangle))
    }

    /// Whether anything may touch or cross at `x`: no, where all that no patch keeps apart is further away than its reach.
    pub fn any_near(&mut self, sheet: &Sheet, x: &[Vec3], range: &Reach) -> bool {
        self.listed(sheet, x, range).neighbours.any()
    }

    /// The largest share of the step `direction` from `x`, up to 1, on which no two features touch or approach one
    /// another by much more than tenfold.
    #[must_use]
    pub fn largest_step(
        &mut self,
        sheet: &Sheet,
        (x, direction): (&[Vec3], &[Vec3]),
        range: &Reach,
    ) -> f64 {
        self.listed(sheet, x, range);
        let mut end = std::mem::take(&mut self.end);
        end.clear();
        end.extend(x.iter().zip(direction).map(|(x, d)| x + d));
        let share = |pair: &Pair| {
            let from = corner_positions(x, &pair.corners);
            let least = MIN_DISTANCE_SHARE * pair.reach.min(pair.kind.distance(&from));
            pair.kind.free_share(&from, &corner_positions(direction, &pair.corners), least)
        };
        let least = |pairs: &[Pair]| -parallel::max(pairs.len(), |k| -share(&pairs[k]));
        let on_sheet = (sheet, self.clusters.as_slice());
        let serves =
            |list: &mut PairList| list.is_valid_on_step(on_sheet, (x, &mut end), &self.deformation);
        let blocked = match self.list.as_mut().is_some_and(serves) {
            true => self.list.as_ref().map_or(1.0, |list| least(&list.pairs)),
            false => least(&self.on_path(sheet, (x, direction), &end, range)),
        };
        self.end = end;
        blocked.min(1.0)
    }

    /// A list that serves at `x`.
    fn listed(&mut self, sheet: &Sheet, x: &[Vec3], range: &Reach) -> &PairList {
        let mut before = self.list.take().filter(|list| list.range == *range);
        let on_sheet = (sheet, self.clusters.as_slice());
        let serves = |list: &mut PairList| list.is_valid_at(on_sheet, x, &self.deformation);
        let list = match before.as_mut().is_some_and(serves) {
            true => before.take(),
            false => None,
        };
        let list = list.unwrap_or_else(|| self.make(sheet, x, *range, before));
        self.list.insert(list)
    }

    /// The list at `x`, after the one `before`.
    fn make(
        &mut self,
        sheet: &Sheet,
        x: &[Vec3],
        range: Reach,
        before: Option<PairList>,
    ) -> PairList {
        let Self { clusters, deformation, .. } = &*self;
        let deformed = deformation.evaluate((sheet, clusters), x);
        let needed = MAX_REACH_SHARE * range.shrinkage;
        let old = before
            .as_ref()
            .map(|before| (before, changes(clusters, &before.gradients, &deformed.gradients)));
        let mut bounds = vec![None; clusters.len()];
        parallel::fill(&mut bounds, |k| {
            let old = old.as_ref().and_then(|(before, changes)| {
                Some((before.bounds[k].as_ref()?, clusters[k].patch.largest(changes)))
            });
            deformation.bound((&clusters[k], k), &deformed, needed, old)
        });
        let slack = PAIR_MARGIN * self.edge;
        let limit = Limit { range: &range, share: 1.0, slack };
        let apart = |k: usize| bounds[k].is_some_and(|bound| bound.holds);
        let parts = (self.clusters.as_slice(), &mut self.tree);
        let beyond = CLUSTER_MARGIN * self.edge;
        let mut neighbours = Neighbours::find(parts, (x, None), &limit, (&apart, beyond));
        if let Some(before) = &before {
            let moved = |v: u32| x[v as usize] - before.at[v as usize];
            neighbours.reuse_pairs(&self.clusters, &before.neighbours, &moved);
        }
        let keep = |kind: PairKind, corners: &[u32; 4]| {
            let distance = kind.distance(&corner_positions(x, corners)) - slack;
            // Distances at rest are asked for last: most pairs are out of reach without.
            let reach =
                (distance < range.for_kind(kind)).then(|| reach(kind, sheet, corners, &range))?;
            (distance < reach).then_some(reach)
        };
        let search = PairSearch { sheet, x, d: None, limit, keep: &keep };
        let pairs = neighbours.pairs(&self.clusters, &search);
        PairList::new(
            (&self.clusters, self.edge),
            (x, deformed.gradients),
            (range, needed),
            (pairs, neighbours, bounds),
        )
    }

    /// All pairs that may touch on the step `d` from `x`, where a list serves, to `end`.
    fn on_path(
        &mut self,
        sheet: &Sheet,
        (x, d): (&[Vec3], &[Vec3]),
        end: &[Vec3],
        range: &Reach,
    ) -> Vec<Pair> {
        let Self { clusters, tree, deformation, list, .. } = self;
        let Some(PairList { gradients, bounds, .. }) = list else { return Vec::new() };
        let [at_start, at_end] = [x, end].map(|x| deformation.evaluate((sheet, clusters), x));
        let needed = MIN_DISTANCE_SHARE * MAX_REACH_SHARE * range.shrinkage;
        let changes = changes(clusters, gradients, &at_end.gradients);
        let mut apart = vec![false; clusters.len()];
        parallel::fill(&mut apart, |k| {
            let patch = &clusters[k].patch;
            let Some(bound) = &bounds[k] else { return false };
            // The bound is concave on the way: it holds there where it holds at both ends. Most patches that do not
            // keep points half as far apart as at rest still keep them from touching.
            let holds = |at: &Deformed| deformation.keeps(patch, at, bound, needed);
            match bound.holds {
                true => patch.largest(&changes) <= bound.allowance(patch, needed) || holds(&at_end),
                false => holds(&at_start) && holds(&at_end),
            }
        });
        let keep = |kind: PairKind, corners: &[u32; 4]| Some(reach(kind, sheet, corners, range));
        let limit = Limit { range, share: MIN_DISTANCE_SHARE, slack: 0.0 };
        let parts = (clusters.as_slice(), tree);
        let mut neighbours = Neighbours::find(parts, (x, Some(d)), &limit, (&|k| apart[k], 0.0));
        let search = PairSearch { sheet, x, d: Some(d), limit, keep: &keep };
        neighbours.pairs(clusters, &search)
    }
}

/// The reach of a pair.
fn reach(kind: PairKind, sheet: &Sheet, corners: &[u32; 4], range: &Reach) -> f64 {
    range.limited_by_rest(kind, kind.distance(&corner_positions(sheet.rest(), corners)))
}

#[cfg(test)]
mod tests;
