//! The pairs of features of two clusters, at a shape or on a step.

use rumple_numerics::Vec3;
use rumple_sheet::Sheet;

use super::advance::{Pair, PairKind, Reach};
use super::ball::Ball;
use super::patches::Cluster;

/// Which pairs are wanted: those that come nearer than a share of their reach, by more than `slack` further away.
#[derive(Clone, Copy)]
pub(super) struct Limit<'a> {
    pub(super) range: &'a Reach,
    pub(super) share: f64,
    pub(super) slack: f64,
}

impl Limit<'_> {
    /// Whether there can be such a pair, at least `gap` apart and at rest at most `span`.
    #[inline]
    fn holds(&self, kind: PairKind, gap: f64, span: impl FnOnce() -> f64) -> bool {
        let gap = gap - self.slack;
        gap < self.share * self.range.for_kind(kind)
            && gap < self.share * self.range.limited_by_rest(kind, span())
    }

    /// The distance at which no pair is wanted.
    pub(super) fn farthest(&self) -> f64 {
        self.reach(PairKind::PointTriangle).max(self.reach(PairKind::EdgeEdge))
    }

    /// The same of pairs of a kind.
    #[inline]
    fn reach(&self, kind: PairKind) -> f64 {
        self.share * self.range.for_kind(kind) + self.slack
    }

    /// By how much features of two clusters, at least `gap` apart and at rest at most `span`, are too far apart.
    pub(super) fn excess_distance(&self, gap: f64, span: f64) -> f64 {
        let of = |kind| self.range.limited_by_rest(kind, span);
        gap - self.slack - self.share * of(PairKind::PointTriangle).max(of(PairKind::EdgeEdge))
    }
}

/// A feature with balls around it, in the shape and at rest.
#[derive(Debug)]
struct Feature<const M: usize> {
    number: u32,
    corners: [u32; M],
    now: Ball,
    rest: Ball,
}

impl<const M: usize> Feature<M> {
    fn new(
        (number, corners): (u32, [u32; M]),
        (rest, x, d): (&[Vec3], &[Vec3], Option<&[Vec3]>),
    ) -> Self {
        let [now, rest] = [Ball::around(&corners, x, d), Ball::around(&corners, rest, None)];
        Self { number, corners, now, rest }
    }
}

/// The features of a cluster.
#[derive(Debug)]
pub(super) struct Features {
    all: Ball,
    vertices: Vec<Feature<1>>,
    edges: Vec<Feature<2>>,
    triangles: Vec<Feature<3>>,
}

/// A search for pairs at the shape x and on its step d, of which `keep` gives the reach.
pub(super) struct PairSearch<'a, K> {
    pub(super) sheet: &'a Sheet,
    pub(super) x: &'a [Vec3],
    pub(super) d: Option<&'a [Vec3]>,
    pub(super) limit: Limit<'a>,
    pub(super) keep: &'a K,
}

impl<K: Fn(PairKind, &[u32; 4]) -> Option<f64> + Sync> PairSearch<'_, K> {
    /// The features of `cluster`, which others look for.
    pub(super) fn features(&self, cluster: &Cluster) -> Features {
        let Self { sheet, x, d, .. } = *self;
        let places = (sheet.rest(), x, d);
        let Cluster { vertices, edges, triangles, corners, .. } = cluster;
        let edge = |e: &u32| Feature::new((*e, sheet.edges()[*e as usize].vertices), places);
        let triangle = |t: &u32| Feature::new((*t, sheet.triangles()[*t as usize]), places);
        Features {
            all: Ball::around(corners, x, d),
            vertices: vertices.iter().map(|v| Feature::new((*v, [*v]), places)).collect(),
            edges: edges.iter().map(edge).collect(),
            triangles: triangles.iter().map(triangle).collect(),
        }
    }

    /// Adds the pairs within a cluster.
    pub(super) fn within(&self, own: &Features, found: &mut Vec<Pair>) {
        self.points((&own.vertices, &own.all), (&own.triangles, &own.all), found);
        for (place, e) in own.edges.iter().enumerate() {
            own.edges[place + 1..].iter().for_each(|f| self.edges(e, f, found));
        }
    }

    /// Adds the pairs of features of two clusters.
    pub(super) fn between(&self, one: &Features, other: &Features, found: &mut Vec<Pair>) {
        self.points((&one.vertices, &one.all), (&other.triangles, &other.all), found);
        self.points((&other.vertices, &other.all), (&one.triangles, &one.all), found);
        let kind = PairKind::EdgeEdge;
        let near: Vec<&Feature<2>> = self.near(kind, &other.edges, &one.all).collect();
        for e in self.near(kind, &one.edges, &other.all) {
            near.iter().for_each(|f| self.edges(e, f, found));
        }
    }

    /// Those of `features` that come within the range of what `ball` holds.
    fn near<'f, const M: usize>(
        &self,
        kind: PairKind,
        features: &'f [Feature<M>],
        ball: &Ball,
    ) -> impl Iterator<Item = &'f Feature<M>> {
        let limit = self.limit;
        features
            .iter()
            .filter(move |f| limit.holds(kind, f.now.min_distance(ball), || f64::INFINITY))
    }

    fn points(
        &self,
        (vertices, around_vertices): (&[Feature<1>], &Ball),
        (triangles, around_triangles): (&[Feature<3>], &Ball),
        found: &mut Vec<Pair>,
    ) {
        let kind = PairKind::PointTriangle;
        let near: Vec<&Feature<3>> = self.near(kind, triangles, around_vertices).collect();
        for vertex in self.near(kind, vertices, around_triangles) {
            for triangle in &near {
                let ([v], [a, b, c]) = (vertex.corners, triangle.corners);
                if self.meets(kind, vertex, triangle) && v != a && v != b && v != c {
                    self.offer(kind, [v, triangle.number], [v, a, b, c], found);
                }
            }
        }
    }

    fn edges(&self, e: &Feature<2>, f: &Feature<2>, found: &mut Vec<Pair>) {
        let (e, f) = if e.number < f.number { (e, f) } else { (f, e) };
        let ([a, b], [p, q]) = (e.corners, f.corners);
        let kind = PairKind::EdgeEdge;
        if self.meets(kind, e, f) && a != p && a != q && b != p && b != q {
            self.offer(kind, [e.number, f.number], [a, b, p, q], found);
        }
    }

    /// Whether two features may make a pair, as far as the balls around them tell.
    #[inline]
    fn meets<const M: usize, const N: usize>(
        &self,
        kind: PairKind,
        one: &Feature<M>,
        other: &Feature<N>,
    ) -> bool {
        one.now.comes_within(&other.now, self.limit.reach(kind))
            && self.limit.holds(kind, one.now.min_distance(&other.now), || {
                one.rest.max_distance(&other.rest)
            })
    }

    fn offer(&self, kind: PairKind, features: [u32; 2], corners: [u32; 4], found: &mut Vec<Pair>) {
        let reach = (self.keep)(kind, &corners);
        found.extend(reach.map(|reach| Pair { kind, features, corners, reach }));
    }
}
