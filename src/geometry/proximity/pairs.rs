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
use super::clusters::{Cluster, clusters};
use super::deformation::{Bound, Deformation, Gradient, change, largest_change};
use super::neighbours::Neighbours;
use super::search::{Limit, Search};
use crate::box_tree::{Bounds, BoxTree};

/// Share of the distance at rest that bounds the reach of a pair.
const OF_REST: f64 = 0.5;
/// How much nearer features of clusters with pairs may come until a list is made anew, in mean edges of the rest
/// positions. On a smooth sheet neighbours are too far apart for the list then; a longer one would hold them.
const SLACK: f64 = 0.3;
/// How much nearer clusters without pairs may come until a list is made anew, in mean edges.
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
    pub(super) fn at(&self, kind: Kind, at_rest: f64) -> f64 {
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
    /// By how much F may change on every triangle, squared.
    allowance: Vec<f64>,
    /// How far apart the patches of clusters keep their points.
    bounds: Vec<Option<Bound>>,
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
        let serving = self
            .list
            .as_ref()
            .filter(|list| list.serves((sheet, &self.clusters), &end, &self.deformation));
        let blocked = match serving {
            Some(list) => least(&list.pairs),
            None => least(&self.on_path(sheet, (x, direction), &end, range)),
        };
        blocked.min(1.0)
    }

    /// A list that serves at `x`.
    fn listed(&mut self, sheet: &Sheet, x: &[Vec3], range: &Range) -> &List {
        let serves = |list: &List| {
            list.range == *range && list.serves((sheet, &self.clusters), x, &self.deformation)
        };
        let list = match self.list.take() {
            Some(list) if serves(&list) => list,
            before => self.make(sheet, x, *range, before.filter(|list| list.range == *range)),
        };
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
                let allowed = bound.allowance(&cluster.patch, needed).powi(2);
                let triangles = cluster.patch.triangles.iter().map(|t| *t as usize);
                triangles.for_each(|t| allowance[t] = allowance[t].min(allowed));
            }
        }
        List { at: x.to_vec(), range, pairs, neighbours, gradients, allowance, bounds }
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
        let at_end = deformation.gradients(sheet, end);
        let needed = APPROACH * OF_REST * range.shrinkage;
        let changes = changes(gradients, &at_end);
        let mut apart = vec![false; clusters.len()];
        parallel::fill(&mut apart, |k| {
            let patch = &clusters[k].patch;
            let Some(bound) = bounds[k].filter(|bound| bound.holds) else { return false };
            // The bound is concave on the way: it holds there where it holds at both ends.
            let allowed = bound.allowance(patch, needed).powi(2);
            largest_change(patch, &changes) <= allowed
                || deformation.least_at(patch, &at_end, &bound) >= needed
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
        &self,
        (sheet, clusters): (&Sheet, &[Cluster]),
        x: &[Vec3],
        deformation: &Deformation,
    ) -> bool {
        let moved = |v: u32| x[v as usize] - self.at[v as usize];
        if self.at.len() != x.len() || !self.neighbours.last(clusters, &moved) {
            return false;
        }
        let deformed = |t: usize| {
            if self.allowance[t] == f64::INFINITY {
                return f64::NEG_INFINITY;
            }
            change(&self.gradients[t], &deformation.gradient(sheet, x, t)) - self.allowance[t]
        };
        parallel::max(self.allowance.len(), deformed) <= 0.0
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
mod tests {
    use super::*;
    use rumple_numerics::num::index;

    use crate::Crossings;

    /// Numbers from -1 to 1, the same each time.
    struct Noise(u64);

    impl Noise {
        fn vector(&mut self) -> Vec3 {
            Vec3::from_fn(|_, _| {
                self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                #[allow(clippy::cast_precision_loss)]
                let unit = (self.0 >> 11) as f64 / (1u64 << 53) as f64;
                2.0 * unit - 1.0
            })
        }
    }

    /// A square of n × n vertices a unit apart, in two halves one above the other, `gap` apart and a little rough.
    fn folded(n: u32, gap: f64, roughness: f64) -> (Sheet, Vec<Vec3>) {
        let place = |k: u32| Vec3::new(f64::from(k % n), f64::from(k / n), 0.0);
        let rest: Vec<Vec3> = (0..n * n).map(place).collect();
        let two = |k: u32| [[k, k + 1, k + n], [k + 1, k + n + 1, k + n]];
        let cells = (0..n - 1).flat_map(|j| (0..n - 1).map(move |i| j * n + i));
        let sheet = Sheet::new(rest, cells.flat_map(two).collect()).unwrap();
        let half = 0.5 * f64::from(n - 1);
        let mut noise = Noise(5);
        let fold = |x: &Vec3| {
            let s = x.x - half;
            let r = 0.5 * gap;
            let curve = if s.abs() > std::f64::consts::FRAC_PI_2 * r {
                Vec3::new(std::f64::consts::FRAC_PI_2 * r - s.abs(), 0.0, s.signum() * r)
            } else {
                Vec3::new(r * (s / r).cos(), 0.0, r * (s / r).sin())
            };
            curve + Vec3::new(0.0, x.y, 0.0)
        };
        let x = sheet.rest().iter().map(|x| fold(x) + roughness * noise.vector()).collect();
        (sheet, x)
    }

    /// All pairs within their reach, one by one.
    fn slowly(sheet: &Sheet, x: &[Vec3], range: &Range) -> Vec<Pair> {
        let mut all = Vec::new();
        let mut offer = |kind: Kind, features: [u32; 2], corners: [u32; 4]| {
            let reach = reach(kind, sheet, &corners, range);
            if kind.distance(&at(x, &corners)) < reach {
                all.push(Pair { kind, features, corners, reach });
            }
        };
        for v in 0..index(sheet.vertex_count()) {
            for (t, &[a, b, c]) in sheet.triangles().iter().enumerate() {
                if ![a, b, c].contains(&v) {
                    offer(Kind::PointTriangle, [v, index(t)], [v, a, b, c]);
                }
            }
        }
        for (e, one) in sheet.edges().iter().enumerate() {
            for (f, other) in sheet.edges().iter().enumerate().skip(e + 1) {
                let ([a, b], [c, d]) = (one.vertices, other.vertices);
                if ![c, d].contains(&a) && ![c, d].contains(&b) {
                    offer(Kind::EdgeEdge, [index(e), index(f)], [a, b, c, d]);
                }
            }
        }
        all
    }

    const RANGE: Range = Range { points: 0.6, edges: 0.3, shrinkage: 1.0 };

    fn within(proximity: &mut Proximity, sheet: &Sheet, x: &[Vec3]) -> Vec<Pair> {
        let (points, edges) = proximity.near(sheet, x, &RANGE);
        let all = points.iter().chain(edges);
        all.filter(|pair| pair.kind.distance(&at(x, &pair.corners)) < pair.reach).copied().collect()
    }

    #[test]
    fn all_pairs_within_reach_are_listed_also_when_the_shape_has_moved() {
        for (gap, roughness) in [(0.55, 0.02), (0.35, 0.1), (0.25, 0.0)] {
            let (sheet, mut x) = folded(12, gap, roughness);
            let mut proximity = Proximity::new(&sheet, 1.0, 0.6);
            let mut noise = Noise(3);
            for round in 0..12 {
                let (found, wanted) =
                    (within(&mut proximity, &sheet, &x), slowly(&sheet, &x, &RANGE));
                assert!(wanted.len() > 50, "{gap}: {}", wanted.len());
                assert_eq!(found, wanted, "gap {gap}, round {round}");
                x.iter_mut().for_each(|x| *x += 0.03 * noise.vector());
            }
        }
    }

    /// The square of n × n vertices without a notch at one side, over which `rest` lies.
    fn notched(n: u32, rest: &dyn Fn(f64, f64) -> Vec3) -> Sheet {
        let place = |k: u32| rest(f64::from(k % n), f64::from(k / n));
        let two = |k: u32| [[k, k + 1, k + n], [k + 1, k + n + 1, k + n]];
        let notch = |i: u32, j: u32| i < n / 3 && (j == n / 2 || j == n / 2 + 1);
        let cells = (0..n - 1).flat_map(|j| (0..n - 1).map(move |i| (i, j)));
        let cells = cells.filter(|(i, j)| !notch(*i, *j)).map(|(i, j)| j * n + i);
        Sheet::new((0..n * n).map(place).collect(), cells.flat_map(two).collect()).unwrap()
    }

    #[test]
    fn bent_sheets_have_all_their_pairs_whatever_their_patches_keep_apart() {
        const N: u32 = 20;
        let flat = |x: f64, y: f64| Vec3::new(x, y, 0.0);
        let cap = |x: f64, y: f64| Vec3::new(x, y, 0.02 * ((x - 9.5).powi(2) + (y - 9.0).powi(2)));
        let roll = |r: f64| {
            move |x: &Vec3| {
                let (sin, cos) = (x.x / r).sin_cos();
                Vec3::new((r - x.z) * sin, x.y, r - (r - x.z) * cos)
            }
        };
        let wave = |a: f64| move |x: &Vec3| Vec3::new(0.5 * x.x, x.y, x.z + a * (0.9 * x.x).sin());
        let press = |by: f64| move |x: &Vec3| Vec3::new(x.x, by * x.y, by * x.z);
        let (gentle, tight, waves, pressed) = (roll(9.0), roll(2.6), wave(2.5), press(0.3));
        let turns: [&dyn Fn(&Vec3) -> Vec3; 4] = [&gentle, &tight, &waves, &pressed];
        let (mut apart, mut near) = (0, 0);
        for rest in [&flat as &dyn Fn(f64, f64) -> Vec3, &cap] {
            let sheet = notched(N, rest);
            for turn in turns {
                let mut proximity = Proximity::new(&sheet, 1.0, RANGE.points);
                let mut noise = Noise(7);
                for round in 0..=8 {
                    let share = f64::from(round) / 8.0;
                    let bent = |x: &Vec3| x + share * (turn(x) - x) + 0.03 * noise.vector();
                    let x: Vec<Vec3> = sheet.rest().iter().map(bent).collect();
                    let wanted = slowly(&sheet, &x, &RANGE);
                    assert_eq!(within(&mut proximity, &sheet, &x), wanted, "{round}");
                    let bounds = &proximity.list.as_ref().unwrap().bounds;
                    apart += bounds.iter().filter(|b| b.is_some_and(|b| b.holds)).count();
                    near += wanted.len();
                }
            }
        }
        assert!(
            apart > 200 && near > 1000,
            "{apart} patches keep their points apart; {near} pairs"
        );
    }

    #[test]
    fn a_flat_sheet_has_no_pairs_and_its_list_is_empty() {
        let (sheet, _) = folded(12, 0.5, 0.0);
        let mut proximity = Proximity::new(&sheet, 1.0, 0.6);
        let (points, edges) = proximity.near(&sheet, sheet.rest(), &RANGE);
        assert_eq!((points.len(), edges.len()), (0, 0));
    }

    #[test]
    fn no_step_crosses_and_its_share_does_not_depend_on_the_list() {
        let mut shortened = 0;
        for seed in 0..40 {
            let (sheet, x) = folded(8, 0.4, 0.1);
            let mut noise = Noise(seed);
            // Short steps, for which a list serves, and long ones.
            let size = if seed % 2 == 0 { 0.08 } else { 1.5 };
            let direction: Vec<Vec3> = x.iter().map(|_| size * noise.vector()).collect();
            let mut fresh = Proximity::new(&sheet, 1.0, 0.6);
            let share = fresh.largest_step(&sheet, (&x, &direction), &RANGE);
            let mut listed = Proximity::new(&sheet, 1.0, 0.6);
            let before: Vec<Vec3> = x.iter().map(|x| x + 0.02 * noise.vector()).collect();
            let _ = listed.near(&sheet, &before, &RANGE);
            assert_eq!(share, listed.largest_step(&sheet, (&x, &direction), &RANGE), "{seed}");
            assert!(share > 0.0, "{seed}");
            shortened += usize::from(share < 1.0);
            let mut crossings = Crossings::new(&sheet);
            assert_eq!(crossings.find(&sheet, &x).pairs, 0, "the start crosses itself");
            for part in [0.25, 0.5, 0.75, 1.0] {
                let next: Vec<Vec3> =
                    x.iter().zip(&direction).map(|(x, d)| x + part * share * d).collect();
                assert_eq!(crossings.find(&sheet, &next).pairs, 0, "{seed}: {share}, {part}");
            }
        }
        assert!(shortened >= 20, "{shortened}");
    }

    #[test]
    fn long_steps_apart_are_not_shortened() {
        let (sheet, x) = folded(8, 0.4, 0.02);
        let mut proximity = Proximity::new(&sheet, 1.0, 0.6);
        let away: Vec<Vec3> = x.iter().map(|x| Vec3::new(0.0, 0.0, 20.0 * x.z)).collect();
        assert_eq!(proximity.largest_step(&sheet, (&x, &away), &RANGE), 1.0);
        let along = vec![Vec3::new(100.0, 3.0, -7.0); x.len()];
        assert_eq!(proximity.largest_step(&sheet, (&x, &along), &RANGE), 1.0);
    }
}
