//! A search for pairs of features whose boxes, and balls around them, are near one another.

use rumple_numerics::Vec3;
use rumple_numerics::num::index;
use rumple_numerics::parallel::{self, BLOCK};
use rumple_sheet::Sheet;

use super::advance::Kind;
use super::pairs::{Pair, Range};
use crate::box_tree::{Bounds, BoxTree, Node};

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

    /// An upper bound of the distance of what two balls hold that do not move.
    #[inline]
    fn together(&self, other: &Self) -> f64 {
        (self.centre - other.centre).norm() + self.radius + other.radius
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
    /// The same at rest.
    rest: Vec<Ball>,
}

impl Features {
    /// Those with these corners, at `rest`.
    pub(super) fn new<const K: usize>(corners: &[[u32; K]], rest: &[Vec3]) -> Self {
        let at_rest = |of: &[u32; K]| of.map(|v| rest[v as usize]);
        let boxes: Vec<Bounds> = corners.iter().map(|of| Bounds::of(at_rest(of))).collect();
        let balls = corners.iter().map(|of| Ball::around(at_rest(of), None)).collect();
        let none = vec![Ball::NONE; corners.len()];
        Self { tree: BoxTree::new(&boxes), balls: none, rest: balls }
    }

    /// Lets boxes and balls follow the shape `x` and its step `d`.
    pub(super) fn follow<const K: usize>(
        &mut self,
        corners: impl Fn(u32) -> [u32; K] + Sync + Copy,
        x: &[Vec3],
        d: Option<&[Vec3]>,
    ) {
        self.tree.refit(|k| bounds(&corners(k), x));
        self.tree.refit_moves(d.map(|d| move |k| bounds(&corners(k), d)));
        parallel::fill(&mut self.balls, |k| {
            let of = corners(index(k));
            Ball::around(of.map(|v| x[v as usize]), d.map(|d| of.map(|v| d[v as usize])))
        });
    }
}

/// Which pairs are wanted: those that come nearer than a share of their reach, by more than `slack` further away.
#[derive(Clone, Copy)]
pub(super) struct Limit<'a> {
    pub(super) range: &'a Range,
    pub(super) share: f64,
    pub(super) slack: f64,
}

impl Limit<'_> {
    /// Whether there can be such a pair, at least `gap` apart and at rest at most `span`.
    #[inline]
    fn holds(&self, kind: Kind, gap: f64, span: impl FnOnce() -> f64) -> bool {
        let gap = gap - self.slack;
        gap < self.share * self.range.of(kind) && gap < self.share * self.range.at(kind, span())
    }
}

/// A feature for which others are looked for: its balls and boxes in the shape and at rest.
struct Own {
    balls: [Ball; 2],
    boxes: [Bounds; 2],
    moves: Option<Bounds>,
}

/// A search for pairs at the shape x and on its step d, of which `keep` gives the reach.
pub(super) struct Search<'a, K> {
    pub(super) sheet: &'a Sheet,
    pub(super) x: &'a [Vec3],
    pub(super) d: Option<&'a [Vec3]>,
    pub(super) limit: Limit<'a>,
    pub(super) keep: &'a K,
}

impl<K: Fn(Kind, &[u32; 4]) -> Option<f64> + Sync> Search<'_, K> {
    /// The pairs of a vertex and a triangle, in their order.
    pub(super) fn points(&self, triangles: &Features) -> Vec<Pair> {
        let Self { sheet, x, d, .. } = *self;
        in_order(sheet.vertex_count(), &|v, found| {
            let [place, rest] = [x, sheet.rest()].map(|x| [x[v as usize]]);
            let own = Own {
                balls: [Ball::around(place, d.map(|d| [d[v as usize]])), Ball::around(rest, None)],
                boxes: [Bounds::of(place), Bounds::of(rest)],
                moves: d.map(|d| bounds(&[v], d)),
            };
            self.around(Kind::PointTriangle, triangles, &own, |t| {
                let [a, b, c] = sheet.triangles()[t as usize];
                if v != a && v != b && v != c {
                    self.offer(Kind::PointTriangle, [v, t], [v, a, b, c], found);
                }
            });
        })
    }

    /// The pairs of edges, in their order.
    pub(super) fn edges(&self, edges: &Features) -> Vec<Pair> {
        let Self { sheet, x, d, .. } = *self;
        in_order(edges.balls.len(), &|e, found| {
            let [a, b] = sheet.edges()[e as usize].vertices;
            let own = Own {
                balls: [edges.balls[e as usize], edges.rest[e as usize]],
                boxes: [x, sheet.rest()].map(|x| bounds(&[a, b], x)),
                moves: d.map(|d| bounds(&[a, b], d)),
            };
            self.around(Kind::EdgeEdge, edges, &own, |f| {
                let [p, q] = sheet.edges()[f as usize].vertices;
                if f > e && a != p && a != q && b != p && b != q {
                    self.offer(Kind::EdgeEdge, [e, f], [a, b, p, q], found);
                }
            });
        })
    }

    /// Hands the features that may make a pair with `own` to `visit`.
    fn around(&self, kind: Kind, of: &Features, own: &Own, mut visit: impl FnMut(u32)) {
        let limit = &self.limit;
        let Own { balls: [ball, ball_at_rest], boxes: [now, at_rest], moves } = own;
        let enter = |node: &Node<'_>| {
            let both = node.moves.zip(moves.as_ref());
            let approach = both.map_or(0.0, |(theirs, own)| theirs.span(own));
            limit.holds(kind, node.now.gap(now) - approach, || node.rest.span(at_rest))
        };
        of.tree.visit(enter, 0, |k| {
            let (other, rest) = (&of.balls[k as usize], &of.rest[k as usize]);
            if limit.holds(kind, other.apart(ball), || rest.together(ball_at_rest)) {
                visit(k);
            }
        });
    }

    fn offer(&self, kind: Kind, features: [u32; 2], corners: [u32; 4], found: &mut Vec<Pair>) {
        let reach = (self.keep)(kind, &corners);
        found.extend(reach.map(|reach| Pair { kind, features, corners, reach }));
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

/// The box of some vertices in `x`.
#[inline]
fn bounds<const K: usize>(of: &[u32; K], x: &[Vec3]) -> Bounds {
    Bounds::of(of.map(|v| x[v as usize]))
}
