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
use super::deformation::{Bound, Deformation, Deformed, Gradient, changes};
use super::list::PairList;
use super::neighbours::{Candidates, Neighbours};
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
        let needed = MAX_REACH_SHARE * range.shrinkage;
        let (deformed, bounds) = self.bounds(sheet, x, needed, before.as_ref());
        let clusters = self.clusters.as_slice();
        let slack = PAIR_MARGIN * self.edge;
        let limit = Limit { range: &range, share: 1.0, slack };
        let apart = |k: usize| bounds[k].is_some_and(|bound| bound.holds);
        let beyond = CLUSTER_MARGIN * self.edge;
        let moved = before.as_ref().map(|before| |v: u32| x[v as usize] - before.at[v as usize]);
        let candidates = before.as_ref().zip(moved.as_ref()).and_then(|(before, moved)| {
            let were_apart = |k: usize| before.keeps_apart(k);
            Candidates::new(clusters, (&before.neighbours, slack), moved, (were_apart, apart))
        });
        let parts = (clusters, &mut self.tree);
        let mut neighbours =
            Neighbours::find(parts, (x, None), &limit, (&apart, beyond), candidates.as_ref());
        if let Some((before, moved)) = before.as_ref().zip(moved) {
            neighbours.reuse_pairs(clusters, &before.neighbours, &moved);
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

    /// F at `x`, and how far apart patches keep their points there, after the list `before`.
    fn bounds(
        &self,
        sheet: &Sheet,
        x: &[Vec3],
        needed: f64,
        before: Option<&PairList>,
    ) -> (Deformed, Vec<Option<Bound>>) {
        let Self { clusters, deformation, .. } = self;
        let gradients = deformation.gradients(sheet, x);
        let mut bounds = vec![None; clusters.len()];
        if let Some(before) = before {
            let changes = changes(clusters, &before.gradients, &gradients);
            parallel::fill(&mut bounds, |k| {
                let patch = &clusters[k].patch;
                before.bounds[k]?.after(patch.largest(&changes), patch, needed)
            });
        }
        let deformed = deformation.on_patches(clusters, gradients, |k| bounds[k].is_none());
        parallel::update(&mut bounds, |k, bound| {
            *bound = bound.or_else(|| deformation.bound((&clusters[k], k), &deformed, needed));
        });
        (deformed, bounds)
    }

    /// All pairs that may touch on the step `d` from `x`, where a list serves, to `end`.
    fn on_path(
        &mut self,
        sheet: &Sheet,
        (x, d): (&[Vec3], &[Vec3]),
        end: &[Vec3],
        range: &Reach,
    ) -> Vec<Pair> {
        let needed = MIN_DISTANCE_SHARE * MAX_REACH_SHARE * range.shrinkage;
        let Some(list) = &self.list else { return Vec::new() };
        let apart = self.apart_on_path(sheet, list, (x, end), needed);
        let Self { clusters, tree, .. } = self;
        let moved = |v: u32| end[v as usize] - list.at[v as usize];
        let (were_apart, are_apart) = (|k: usize| list.keeps_apart(k), |k: usize| apart[k]);
        let before = (&list.neighbours, 0.0);
        let candidates = Candidates::new(clusters, before, &moved, (were_apart, are_apart));
        let keep = |kind: PairKind, corners: &[u32; 4]| Some(reach(kind, sheet, corners, range));
        let limit = Limit { range, share: MIN_DISTANCE_SHARE, slack: 0.0 };
        let parts = (clusters.as_slice(), tree);
        let mut neighbours =
            Neighbours::find(parts, (x, Some(d)), &limit, (&are_apart, 0.0), candidates.as_ref());
        let search = PairSearch { sheet, x, d: Some(d), limit, keep: &keep };
        neighbours.pairs(clusters, &search)
    }

    /// Which patches keep points `needed` apart on the whole step from `x` to `end`. A bound is concave on the way: it holds there
    /// where it holds at both ends. Most patches that do not keep points half as far apart as at rest still keep them from touching.
    fn apart_on_path(
        &self,
        sheet: &Sheet,
        list: &PairList,
        (x, end): (&[Vec3], &[Vec3]),
        needed: f64,
    ) -> Vec<bool> {
        let Self { clusters, deformation, .. } = self;
        let PairList { gradients, bounds, .. } = list;
        let at_end = deformation.gradients(sheet, end);
        let changes = changes(clusters, gradients, &at_end);
        let near_list = |k: usize| {
            let (patch, Some(bound)) = (&clusters[k].patch, &bounds[k]) else { return false };
            bound.holds && patch.largest(&changes) <= bound.allowance(patch, needed)
        };
        let mut apart = vec![false; clusters.len()];
        parallel::fill(&mut apart, near_list);
        let check = |apart: &mut [bool], asked: &[bool], gradients: Vec<Gradient>| {
            let deformed = deformation.on_patches(clusters, gradients, |k| asked[k]);
            parallel::update(apart, |k, apart| {
                let Some(bound) = bounds[k].as_ref().filter(|_| asked[k]) else { return };
                *apart = deformation.keeps(&clusters[k].patch, &deformed, bound, needed);
            });
        };
        let asked: Vec<bool> = (0..apart.len()).map(|k| bounds[k].is_some() && !apart[k]).collect();
        if asked.contains(&true) {
            check(&mut apart, &asked, at_end);
        }
        let holds = |k: usize| bounds[k].is_some_and(|bound| bound.holds);
        let asked: Vec<bool> = (0..apart.len()).map(|k| apart[k] && !holds(k)).collect();
        if asked.contains(&true) {
            check(&mut apart, &asked, deformation.gradients(sheet, x));
        }
        apart
    }
}

/// The reach of a pair.
fn reach(kind: PairKind, sheet: &Sheet, corners: &[u32; 4], range: &Reach) -> f64 {
    range.limited_by_rest(kind, kind.distance(&corner_positions(sheet.rest(), corners)))
}

#[cfg(test)]
mod tests;
