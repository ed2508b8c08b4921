//! A search for pairs of features whose boxes, and balls around them, are near one another.

use rumple_numerics::Vec3;
use rumple_numerics::num::index;
use rumple_numerics::parallel::{self, BLOCK};
use rumple_sheet::Sheet;

use super::advance::Kind;
use super::pairs::Pair;
use crate::box_tree::{Bounds, BoxTree};

/// A ball around a feature, and how it moves: by `drift`, and no point of it by more than `spread` besides.
#[derive(Debug, Clone, Copy)]
struct Ball {
    centre: Vec3,
    radius: f64,
    drift: Vec3,
    spread: f64,
}

impl Ball {
    const NONE: Self = Self {
        centre: Vec3::new(0.0, 0.0, 0.0),
        radius: 0.0,
        drift: Vec3::new(0.0, 0.0, 0.0),
        spread: 0.0,
    };

    /// Around the points `x` that move by `d`.
    #[inline]
    fn around<const K: usize>(x: [Vec3; K], d: Option<[Vec3; K]>) -> Self {
        let (centre, radius) = enclosing(&x);
        let (drift, spread) = d.map_or((Vec3::zeros(), 0.0), |d| enclosing(&d));
        Self { centre, radius, drift, spread }
    }

    /// A lower bound of the distance of what two balls hold, at all times of the motion.
    #[inline]
    fn apart(&self, other: &Self) -> f64 {
        let moves = (self.drift - other.drift).norm() + self.spread + other.spread;
        (self.centre - other.centre).norm() - self.radius - other.radius - moves
    }
}

/// The mean of some points, and the largest distance from it.
#[inline]
fn enclosing<const K: usize>(x: &[Vec3; K]) -> (Vec3, f64) {
    let mut mean = x[0];
    for x in &x[1..] {
        mean += x;
    }
    mean /= rumple_numerics::num::real(K);
    let mut radius = 0.0f64;
    for x in x {
        radius = radius.max((x - mean).norm_squared());
    }
    (mean, radius.sqrt())
}

/// Features of one kind that may be near others.
#[derive(Debug)]
pub(super) struct Features {
    tree: BoxTree,
    balls: Vec<Ball>,
}

impl Features {
    /// With these centres at rest.
    pub(super) fn new(centres: &[Vec3]) -> Self {
        Self { tree: BoxTree::new(centres), balls: vec![Ball::NONE; centres.len()] }
    }

    /// Lets boxes and balls follow the shape `x` and its step `d`.
    pub(super) fn follow<const K: usize>(
        &mut self,
        corners: impl Fn(u32) -> [u32; K] + Sync,
        x: &[Vec3],
        d: Option<&[Vec3]>,
    ) {
        let places =
            |v: u32| [x[v as usize], d.map_or(x[v as usize], |d| x[v as usize] + d[v as usize])];
        self.tree.refit(|k| bounds(&corners(k), &places));
        parallel::fill(&mut self.balls, |k| {
            let of = corners(index(k));
            Ball::around(of.map(|v| x[v as usize]), d.map(|d| of.map(|v| d[v as usize])))
        });
    }
}

/// A search for pairs at the shape x and on its step d, of which `keep` gives the reach.
pub(super) struct Search<'a, K> {
    pub(super) sheet: &'a Sheet,
    pub(super) x: &'a [Vec3],
    pub(super) d: Option<&'a [Vec3]>,
    pub(super) keep: &'a K,
}

impl<K: Fn(Kind, &[u32; 4]) -> Option<f64> + Sync> Search<'_, K> {
    /// The pairs of a vertex and a triangle at most `far` apart, in their order.
    pub(super) fn points(&self, triangles: &Features, far: f64) -> Vec<Pair> {
        let Self { sheet, x, d, keep } = *self;
        let Features { tree, balls } = triangles;
        in_order(sheet.vertex_count(), &|v, found| {
            let place = x[v as usize];
            let step = d.map(|d| d[v as usize]);
            let own = Ball::around([place], step.map(|d| [d]));
            let reached = Bounds::of([place, place + step.unwrap_or_default()]).inflated(far);
            tree.visit(&reached, 0, |t| {
                let [a, b, c] = sheet.triangles()[t as usize];
                if balls[t as usize].apart(&own) < far && v != a && v != b && v != c {
                    let corners = [v, a, b, c];
                    let reach = keep(Kind::PointTriangle, &corners);
                    let pair = |reach| Pair {
                        kind: Kind::PointTriangle,
                        features: [v, t],
                        corners,
                        reach,
                    };
                    found.extend(reach.map(pair));
                }
            });
        })
    }

    /// The pairs of edges at most `far` apart, in their order.
    pub(super) fn edges(&self, edges: &Features, far: f64) -> Vec<Pair> {
        let Self { sheet, x, d, keep } = *self;
        let Features { tree, balls } = edges;
        let places =
            |v: u32| [x[v as usize], d.map_or(x[v as usize], |d| x[v as usize] + d[v as usize])];
        in_order(balls.len(), &|e, found| {
            let [a, b] = sheet.edges()[e as usize].vertices;
            let own = &balls[e as usize];
            tree.visit(&bounds(&[a, b], &places).inflated(far), 0, |f| {
                let [p, q] = sheet.edges()[f as usize].vertices;
                let apart = a != p && a != q && b != p && b != q;
                if f > e && apart && balls[f as usize].apart(own) < far {
                    let corners = [a, b, p, q];
                    let reach = keep(Kind::EdgeEdge, &corners);
                    let pair =
                        |reach| Pair { kind: Kind::EdgeEdge, features: [e, f], corners, reach };
                    found.extend(reach.map(pair));
                }
            });
        })
    }
}

/// What `add` finds for every k < `count`, sorted by features.
fn in_order(count: usize, add: &(dyn Fn(u32, &mut Vec<Pair>) + Sync)) -> Vec<Pair> {
    let block = |b: usize| {
        let (mut found, mut first) = (Vec::new(), 0);
        for k in b * BLOCK..((b + 1) * BLOCK).min(count) {
            add(index(k), &mut found);
            // The tree has an order of its own.
            found[first..].sort_unstable_by_key(|pair| pair.features);
            first = found.len();
        }
        found
    };
    let both = |mut a: Vec<Pair>, mut b: Vec<Pair>| {
        a.append(&mut b);
        a
    };
    parallel::reduce(count.div_ceil(BLOCK), &block, &both).unwrap_or_default()
}

/// The box of the places of some vertices.
#[inline]
fn bounds<const K: usize>(of: &[u32; K], places: &impl Fn(u32) -> [Vec3; 2]) -> Bounds {
    let mut all = Bounds::of(places(of[0]));
    for v in &of[1..] {
        all = all.with(&Bounds::of(places(*v)));
    }
    all
}
