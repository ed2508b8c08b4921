//! The list of pairs at a shape, and how far shapes may go from there.
//!
//! Whether the list still serves is asked at every evaluation and on every step. The answer needs F of every triangle and the motion of
//! every cluster; it also gives how far every vertex may go from there until some part of it may no longer hold. Beyond that, F of a
//! cluster is asked for where its corners have moved further relative to one another; where most have, all of it is asked again.
//!
//! What is asked for is convex in the shape: motions, spreads and changes of F are norms of linear functions of it.
//! A list that serves at both ends of a step serves on all of it, and nothing is asked at shapes on the way.

use rumple_numerics::num::real;
use rumple_numerics::{Vec3, parallel};
use rumple_sheet::Sheet;

use super::advance::{Pair, Reach};
use super::deformation::{Bound, Deformation, Gradient, change};
use super::neighbours::{ClusterMotion, MAX_APPROACH_RATE, Neighbours};
use super::patches::Cluster;

/// Up to this share of all clusters are asked alone.
const FEW_CLUSTERS_SHARE: f64 = 0.25;
/// The place of `x` on a step is found from one vertex in so many.
const SAMPLE_STRIDE: usize = 16;
/// A list serves where every vertex may go so much further, in mean edges: shapes on the way of a step differ from
/// `x + s d` by round-off.
const ROUND_OFF_MARGIN: f64 = 1e-9;

/// Whether two shapes are the same. Compares vertices by the block, which costs a fraction of one by one.
fn same(x: &[Vec3], y: &[Vec3]) -> bool {
    const CHUNK: usize = 64;
    let differ = |a: &Vec3, b: &Vec3| (a.x != b.x) | (a.y != b.y) | (a.z != b.z);
    let any =
        |(x, y): (&[Vec3], &[Vec3])| x.iter().zip(y).fold(false, |any, (a, b)| any | differ(a, b));
    x.len() == y.len() && !x.chunks(CHUNK).zip(y.chunks(CHUNK)).any(any)
}

/// Pairs, and how far the shape may go from where they were listed.
#[derive(Debug)]
pub(super) struct PairList {
    pub(super) at: Vec<Vec3>,
    pub(super) range: Reach,
    /// Pairs by vertex and triangle, then by edges.
    pub(super) pairs: Vec<Pair>,
    pub(super) neighbours: Neighbours,
    pub(super) gradients: Vec<Gradient>,
    /// How far apart the patches of clusters keep their points.
    pub(super) bounds: Vec<Option<Bound>>,
    /// By how much F may change on the triangles of every cluster.
    allowance: Vec<f64>,
    /// How much further every vertex may go where it serves.
    margin: f64,
    /// Where it was last seen to serve.
    seen: Option<Seen>,
    /// The last step on which it serves.
    way: Way,
}

/// A step.
#[derive(Debug, Default)]
struct Way {
    from: Vec<Vec3>,
    to: Vec<Vec3>,
}

impl Way {
    /// Whether it leads through `x`, but for `margin`.
    fn leads_through(&self, x: &[Vec3], margin: f64) -> bool {
        let Self { from, to } = self;
        if from.len() != x.len() || x.is_empty() {
            return false;
        }
        if same(x, to) {
            return true;
        }
        let step = |v: usize| to[v] - from[v];
        let sample = || (0..x.len()).step_by(SAMPLE_STRIDE);
        let whole: f64 = sample().map(|v| step(v).norm_squared()).sum();
        let along: f64 = sample().map(|v| step(v).dot(&(x[v] - from[v]))).sum();
        // NaN where none of these moves, which no comparison passes.
        let share = (along / whole).clamp(0.0, 1.0);
        let off = |v: usize| (x[v] - from[v] - share * step(v)).norm_squared();
        parallel::max(x.len(), off) <= margin * margin
    }
}

/// A shape at which a list serves, and how far vertices may go from there.
#[derive(Debug, Default)]
struct Seen {
    at: Vec<Vec3>,
    /// How far every vertex may go until clusters may have come too near.
    near: f64,
    /// How far the corners of every cluster may go until F may have changed too much.
    rooms: Vec<f64>,
    /// The square of how far every vertex may go.
    free: Vec<f64>,
}

impl Seen {
    /// Moves it to `x`, where `near` and `rooms` hold.
    fn renew(&mut self, clusters: &[Cluster], x: &[Vec3]) {
        let Self { at, near, rooms, free } = self;
        at.clear();
        at.extend_from_slice(x);
        free.clear();
        free.resize(x.len(), *near * *near);
        for (cluster, room) in clusters.iter().zip(rooms) {
            for v in &cluster.corners {
                let free = &mut free[*v as usize];
                *free = free.min(*room * *room);
            }
        }
    }
}

impl PairList {
    /// At `x` for this range and mean edge, where patches that hold have `needed`.
    pub(super) fn new(
        (clusters, edge): (&[Cluster], f64),
        (x, gradients): (&[Vec3], Vec<Gradient>),
        (range, needed): (Reach, f64),
        (pairs, neighbours, bounds): (Vec<Pair>, Neighbours, Vec<Option<Bound>>),
    ) -> Self {
        let mut allowance = vec![f64::INFINITY; clusters.len()];
        for (cluster, bound) in clusters.iter().zip(&bounds) {
            if let Some(bound) = bound.filter(|bound| bound.holds) {
                let allowed = bound.allowance(&cluster.patch, needed);
                let own = cluster.patch.clusters.iter().map(|k| *k as usize);
                own.for_each(|k| allowance[k] = allowance[k].min(allowed));
            }
        }
        let at = x.to_vec();
        let (margin, way) = (ROUND_OFF_MARGIN * edge, Way::default());
        Self { at, range, pairs, neighbours, gradients, bounds, allowance, margin, seen: None, way }
    }

    /// Whether the patch of cluster `k` kept its points apart where it was made.
    pub(super) fn keeps_apart(&self, k: usize) -> bool {
        self.bounds[k].is_some_and(|bound| bound.holds)
    }

    /// Whether it holds all pairs that may be within their reach at `x`.
    pub(super) fn is_valid_at(
        &mut self,
        on: (&Sheet, &[Cluster]),
        x: &[Vec3],
        deformation: &Deformation,
    ) -> bool {
        self.way.leads_through(x, self.margin) || self.holds(on, x, deformation)
    }

    /// Whether it serves on the whole step from a shape at which it serves; `to` is taken over then.
    pub(super) fn is_valid_on_step(
        &mut self,
        on: (&Sheet, &[Cluster]),
        (from, to): (&[Vec3], &mut Vec<Vec3>),
        deformation: &Deformation,
    ) -> bool {
        let serves = self.holds(on, to, deformation);
        if serves {
            self.way.from.clear();
            self.way.from.extend_from_slice(from);
            std::mem::swap(&mut self.way.to, to);
        }
        serves
    }

    /// Whether `x` is on the way of the last step on which it serves.
    #[cfg(test)]
    pub(super) fn is_on_last_step(&self, x: &[Vec3]) -> bool {
        self.way.leads_through(x, self.margin)
    }

    /// Whether it serves at `x`, as asked of the shape, not of the way.
    fn holds(&mut self, on: (&Sheet, &[Cluster]), x: &[Vec3], deformation: &Deformation) -> bool {
        if self.at.len() != x.len() {
            return false;
        }
        if let Some(serves) = self.as_seen(on, x, deformation) {
            return serves;
        }
        let clusters = on.1;
        let moved = |v: u32| x[v as usize] - self.at[v as usize];
        let near = self.neighbours.remaining_displacement(clusters, &moved) - self.margin;
        let mut seen = self.seen.take().unwrap_or_default();
        seen.rooms.resize(clusters.len(), 0.0);
        parallel::fill(&mut seen.rooms, |k| self.room(on, k, x, deformation));
        if !(near >= 0.0) || !seen.rooms.iter().all(|room| *room >= 0.0) {
            return false;
        }
        seen.near = near;
        seen.renew(clusters, x);
        self.seen = Some(seen);
        true
    }

    /// Whether it serves at `x`, as far as the shape last seen shows. Where it does and `x` is not close to that, `x` is seen
    /// from there on: later steps of a relaxation are shorter.
    fn as_seen(
        &mut self,
        on: (&Sheet, &[Cluster]),
        x: &[Vec3],
        deformation: &Deformation,
    ) -> Option<bool> {
        let Seen { at, near, rooms, free } = self.seen.as_ref()?;
        if parallel::max(x.len(), |v| (x[v] - at[v]).norm_squared() - free[v]) < 0.0 {
            return Some(true);
        }
        let clusters = on.1;
        let moved = |v: u32| x[v as usize] - at[v as usize];
        let all = self.neighbours.moved(clusters, &moved);
        let doubtful: Vec<usize> =
            (0..clusters.len()).filter(|k| !(all[*k].spread < rooms[*k])).collect();
        if real(doubtful.len()) > FEW_CLUSTERS_SHARE * real(clusters.len()) {
            return None;
        }
        // What clusters have moved since is taken off, and room is asked for where nothing is left.
        let left = rooms.iter().zip(all).map(|(room, moved)| room - moved.spread);
        let (mut left, mut near) =
            (left.collect::<Vec<f64>>(), near - ClusterMotion::farthest(all) / MAX_APPROACH_RATE);
        if !(near > 0.0) {
            let moved = |v: u32| x[v as usize] - self.at[v as usize];
            near = self.neighbours.remaining_displacement(clusters, &moved) - self.margin;
        }
        doubtful.iter().for_each(|k| left[*k] = self.room(on, *k, x, deformation));
        let serves = near >= 0.0 && doubtful.into_iter().all(|k| left[k] >= 0.0);
        if let Some(seen) = self.seen.as_mut().filter(|_| serves) {
            (seen.near, seen.rooms) = (near, left);
            seen.renew(clusters, x);
        }
        Some(serves)
    }

    /// How much further the corners of cluster `k` may go until F may have changed too much; less than 0 where it has.
    fn room(
        &self,
        (sheet, clusters): (&Sheet, &[Cluster]),
        k: usize,
        x: &[Vec3],
        deformation: &Deformation,
    ) -> f64 {
        let allowed = self.allowance[k];
        if allowed == f64::INFINITY {
            return f64::INFINITY;
        }
        let changed = |t: &u32| {
            let t = *t as usize;
            change(&self.gradients[t], &deformation.gradient(sheet, x, t))
        };
        let larger = |a: f64, b: f64| if b > a || b.is_nan() { b } else { a };
        let most = clusters[k].triangles.iter().map(changed).fold(0.0, larger);
        (allowed - most.sqrt()) / deformation.steepest[k] - self.margin
    }
}
