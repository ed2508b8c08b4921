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

use rumple_numerics::Vec3;
use rumple_numerics::parallel;
use rumple_sheet::Sheet;

use super::advance::{Kind, at};
use super::clusters::{Cluster, Patch, clusters};
use super::deformation::{Bound, Deformation, Gradient, change, largest_change};
use super::neighbours::Neighbours;
use super::search::{Limit, Search};
use crate::box_tree::{Bounds, BoxTree};

/// Share of the distance at rest that bounds the reach of a pair.
const OF_REST: f64 = 0.5;
/// How much nearer features of clusters with pairs may come until a list is rebuilt, in mean edges of the rest
/// positions. On a smooth sheet neighbours are too far apart for the list then; a longer one would hold them.
const SLACK: f64 = 0.3;
/// How much nearer clusters without pairs may come until a list is rebuilt, in mean edges.
const BEYOND: f64 = 3.0;
/// A step ends where a pair is nearer than this share of its distance at the start, or of its reach.
const APPROACH: f64 = 0.1;

/// Which distances count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// The reach of vertices and triangles.
    pub points: f64,
    /// The reach of two edges.
    pub edges: f64,
    /// Factor on distances at rest, at most 1: how far the sheet is to shrink.
    pub shrinkage: f64,
}

impl Range {
    /// The reach of features that are so far apart at rest.
    #[inline]
    #[must_use]
    pub fn at(&self, kind: Kind, at_rest: f64) -> f64 {
        self.of(kind).min(OF_REST * self.shrinkage * at_rest)
    }

    /// The reach of features that are far apart at rest.
    pub(super) fn of(&self, kind: Kind) -> f64 {
        match kind {
            Kind::PointTriangle => self.points,
            Kind::EdgeEdge => self.edges,
        }
    }
}

/// Two features that are near one another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// What they are.
    pub kind: Kind,
    /// Numbers of vertex and triangle, or of the edges.
    pub features: [u32; 2],
    /// Their vertices.
    pub corners: [u32; 4],
    /// The distance below which they count.
    pub reach: f64,
}

/// The pairs of one sheet.
#[derive(Debug)]
pub struct Proximity {
    clusters: Vec<Cluster>,
    tree: BoxTree,
    deformation: Deformation,
    /// Mean edge at rest.
    edge: f64,
    list: Option<List>,
}

/// Pairs, and how far the shape may go from where they were listed.
#[derive(Debug)]
struct List {
    at: Vec<Vec3>,
    range: Range,
    /// Pairs by vertex and triangle, then by edges.
    pairs: Vec<Pair>,
    neighbours: Neighbours,
    gradients: Vec<Gradient>,
    /// By how much F may change on every triangle.
    allowance: Vec<f64>,
    /// How far apart the patches of clusters keep their points.
    bounds: Vec<Option<Bound>>,
    /// Where it was last seen to serve, and how far every vertex may go from there.
    seen: Option<(Vec<Vec3>, f64)>,
}

impl Proximity {
    /// For the shapes of `sheet`, whose mean edge at rest is `edge`, and ranges about `reach`.
    #[must_use]
    pub fn new(sheet: &Sheet, edge: f64, reach: f64) -> Self {
        let clusters = clusters(sheet, reach);
        let boxes: Vec<Bounds> = clusters.iter().map(|c| c.bounds(sheet.rest())).collect();
        let tree = BoxTree::new(&boxes);
        let deformation = Deformation::new(sheet);
        Self { clusters, tree, deformation, edge, list: None }
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
    pub fn near(&mut self, sheet: &Sheet, x: &[Vec3], range: &Range) -> (&[Pair], &[Pair]) {
        let pairs = &self.listed(sheet, x, range).pairs;
        pairs.split_at(pairs.partition_point(|pair| pair.kind == Kind::PointTriangle))
    }

    /// The largest share of the step `direction` from `x`, up to 1, on which no two features touch or approach one
    /// another by much more than tenfold.
    #[must_use]
    pub fn largest_step(
        &mut self,
        sheet: &Sheet,
        (x, direction): (&[Vec3], &[Vec3]),
        range: &Range,
    ) -> f64 {
        self.listed(sheet, x, range);
        let end: Vec<Vec3> = x.iter().zip(direction).map(|(x, d)| x + d).collect();
        let share = |pair: &Pair| {
            let from = at(x, &pair.corners);
            let least = APPROACH * pair.reach.min(pair.kind.distance(&from));
            pair.kind.free_share(&from, &at(direction, &pair.corners), least)
        };
        let least = |pairs: &[Pair]| -parallel::max(pairs.len(), |k| -share(&pairs[k]));
        let on_sheet = (sheet, self.clusters.as_slice());
        let serves = |list: &mut List| list.serves(on_sheet, &end, &self.deformation);
        let blocked = match self.list.as_mut().is_some_and(serves) {
            true => self.list.as_ref().map_or(1.0, |list| least(&list.pairs)),
            false => least(&self.on_path(sheet, (x, direction), &end, range)),
        };
        blocked.min(1.0)
    }

    /// A list that serves at `x`.
    fn listed(&mut self, sheet: &Sheet, x: &[Vec3], range: &Range) -> &List {
        let mut before = self.list.take().filter(|list| list.range == *range);
        let on_sheet = (sheet, self.clusters.as_slice());
        let serves = |list: &mut List| list.serves(on_sheet, x, &self.deformation);
        let list = match before.as_mut().is_some_and(serves) {
            true => before.take(),
            false => None,
        };
        let list = list.unwrap_or_else(|| self.make(sheet, x, *range, before));
        self.list.insert(list)
    }

    /// The list at `x`, after the one `before`.
    fn make(&mut self, sheet: &Sheet, x: &[Vec3], range: Range, before: Option<List>) -> List {
        let gradients = self.deformation.gradients(sheet, x);
        let needed = OF_REST * range.shrinkage;
        let changes = before.as_ref().map(|before| changes(&before.gradients, &gradients));
        let mut bounds = vec![None; self.clusters.len()];
        parallel::fill(&mut bounds, |k| {
            let cluster = &self.clusters[k];
            let before = before.as_ref().zip(changes.as_ref()).and_then(|(before, changes)| {
                let changed = largest_change(&cluster.patch, changes).sqrt();
                Some((before.bounds[k].as_ref()?, changed))
            });
            self.deformation.bound(cluster, &gradients, needed, before)
        });
        let slack = SLACK * self.edge;
        let limit = Limit { range: &range, share: 1.0, slack };
        let apart = |k: usize| bounds[k].is_some_and(|bound| bound.holds);
        let parts = (self.clusters.as_slice(), &mut self.tree);
        let beyond = BEYOND * self.edge;
        let mut neighbours = Neighbours::find(parts, (x, None), &limit, (&apart, beyond));
        if let Some(before) = &before {
            let moved = |v: u32| x[v as usize] - before.at[v as usize];
            neighbours.keep(&self.clusters, &before.neighbours, &moved);
        }
        let keep = |kind: Kind, corners: &[u32; 4]| {
            let distance = kind.distance(&at(x, corners)) - slack;
            // Distances at rest are asked for last: most pairs are out of reach without.
            let reach = (distance < range.of(kind)).then(|| reach(kind, sheet, corners, &range))?;
            (distance < reach).then_some(reach)
        };
        let search = Search { sheet, x, d: None, limit, keep: &keep };
        let pairs = neighbours.pairs(&self.clusters, &search);
        let mut allowance = vec![f64::INFINITY; sheet.triangle_count()];
        for (k, cluster) in self.clusters.iter().enumerate() {
            if let Some(bound) = bounds[k].filter(|bound| bound.holds) {
                let allowed = bound.allowance(&cluster.patch, needed);
                let triangles = cluster.patch.triangles.iter().map(|t| *t as usize);
                triangles.for_each(|t| allowance[t] = allowance[t].min(allowed));
            }
        }
        let (at, seen) = (x.to_vec(), None);
        List { at, range, pairs, neighbours, gradients, allowance, bounds, seen }
    }

    /// All pairs that may touch on the step `d` from `x`, where a list serves, to `end`.
    fn on_path(
        &mut self,
        sheet: &Sheet,
        (x, d): (&[Vec3], &[Vec3]),
        end: &[Vec3],
        range: &Range,
    ) -> Vec<Pair> {
        let Self { clusters, tree, deformation, list, .. } = self;
        let Some(List { gradients, bounds, .. }) = list else { return Vec::new() };
        let [at_start, at_end] = [x, end].map(|x| deformation.gradients(sheet, x));
        let needed = APPROACH * OF_REST * range.shrinkage;
        let changes = changes(gradients, &at_end);
        let mut apart = vec![false; clusters.len()];
        parallel::fill(&mut apart, |k| {
            let patch = &clusters[k].patch;
            let Some(bound) = bounds[k] else { return false };
            // The bound is concave on the way: it holds there where it holds at both ends. Most patches that do not
            // keep points half as far apart as at rest still keep them from touching.
            let holds = |at: &[Gradient]| deformation.least(patch, at, &bound.rotation) >= needed;
            let allowed = bound.allowance(patch, needed).powi(2);
            match bound.holds {
                true => largest_change(patch, &changes) <= allowed || holds(&at_end),
                false => holds(&at_start) && holds(&at_end),
            }
        });
        let keep = |kind: Kind, corners: &[u32; 4]| Some(reach(kind, sheet, corners, range));
        let limit = Limit { range, share: APPROACH, slack: 0.0 };
        let parts = (clusters.as_slice(), tree);
        let mut neighbours = Neighbours::find(parts, (x, Some(d)), &limit, (&|k| apart[k], 0.0));
        let search = Search { sheet, x, d: Some(d), limit, keep: &keep };
        neighbours.pairs(clusters, &search)
    }
}

impl List {
    /// Whether it holds all pairs that may be within their reach at `x`.
    fn serves(
        &mut self,
        (sheet, clusters): (&Sheet, &[Cluster]),
        x: &[Vec3],
        deformation: &Deformation,
    ) -> bool {
        if self.at.len() != x.len() {
            return false;
        }
        if let Some((seen, room)) = &self.seen {
            let moved = parallel::max(x.len(), |v| (x[v] - seen[v]).norm_squared());
            if moved.sqrt() < *room {
                return true;
            }
        }
        let moved = |v: u32| x[v as usize] - self.at[v as usize];
        let near = self.neighbours.room(clusters, &moved);
        let bent = |t: usize| {
            if self.allowance[t] == f64::INFINITY {
                return f64::NEG_INFINITY;
            }
            let changed = change(&self.gradients[t], &deformation.gradient(sheet, x, t));
            (changed.sqrt() - self.allowance[t]) / deformation.largest_change(t)
        };
        let room = near.min(-parallel::max(self.allowance.len(), bent));
        if room >= 0.0 {
            self.seen = Some((x.to_vec(), room));
        }
        room >= 0.0
    }
}

/// |ΔF|² of every triangle.
fn changes(from: &[Gradient], to: &[Gradient]) -> Vec<f64> {
    let mut all = vec![0.0; from.len()];
    parallel::fill(&mut all, |t| change(&from[t], &to[t]));
    all
}

/// The reach of a pair.
fn reach(kind: Kind, sheet: &Sheet, corners: &[u32; 4], range: &Range) -> f64 {
    range.at(kind, kind.distance(&at(sheet.rest(), corners)))
}

#[cfg(test)]
mod tests;
