//! The pairs of a vertex and a triangle, and of two edges, that are near one another.
//!
//! Each pair has a *reach*, the distance below which it counts: that of the whole range, but never more than half of
//! what the pair has in the rest positions, so that neighbours at rest do not count. Incident features (a vertex and
//! its triangles, edges with a vertex in common) make no pair.
//!
//! A list holds all pairs that may come within their reach while no vertex moves by more than a margin from where it
//! was when the list was made; it is made anew when one has. What is read from it (which pairs are within their reach,
//! how far a step may go) does not depend on when it was made.

use rumple_numerics::Vec3;
use rumple_numerics::num::index;
use rumple_numerics::parallel::{self, BLOCK};
use rumple_numerics::reduction::Reduction;
use rumple_sheet::Sheet;

use super::advance::{Kind, at};
use crate::box_tree::{Bounds, BoxTree};

/// Share of the distance at rest that bounds the reach of a pair.
const OF_REST: f64 = 0.5;
/// Motion of vertices for which a list of pairs serves, in mean edges of the rest positions. On a smooth sheet
/// neighbours are too far apart for the list then; a longer one would hold them, a shorter one is made more often.
const MARGIN: f64 = 0.15;
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
    fn of(&self, kind: Kind) -> f64 {
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
struct Features {
    tree: BoxTree,
    balls: Vec<Ball>,
}

impl Features {
    fn new(centres: &[Vec3]) -> Self {
        Self { tree: BoxTree::new(centres), balls: vec![Ball::NONE; centres.len()] }
    }

    /// Lets boxes and balls follow the shape `x` and its step `d`.
    fn follow<const K: usize>(
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

/// The pairs of one sheet.
#[derive(Debug)]
pub struct Proximity {
    triangles: Features,
    edges: Features,
    margin: f64,
    range: Range,
    /// Where the list was made; nothing before.
    made_at: Vec<Vec3>,
    /// By vertex and triangle, then by edges.
    pairs: Vec<Pair>,
    /// How many of them have a vertex and a triangle.
    points: usize,
}

impl Proximity {
    /// For the shapes of `sheet`, whose mean edge at rest is `edge`.
    #[must_use]
    pub fn new(sheet: &Sheet, edge: f64) -> Self {
        let rest = sheet.rest();
        let centre = |of: &[u32]| {
            of.iter().map(|v| rest[*v as usize]).sum::<Vec3>()
                / rumple_numerics::num::real(of.len())
        };
        let triangles: Vec<Vec3> = sheet.triangles().iter().map(|t| centre(t)).collect();
        let edges: Vec<Vec3> = sheet.edges().iter().map(|e| centre(&e.vertices)).collect();
        Self {
            triangles: Features::new(&triangles),
            edges: Features::new(&edges),
            margin: MARGIN * edge,
            range: Range { points: 0.0, edges: 0.0, shrinkage: 1.0 },
            made_at: Vec::new(),
            pairs: Vec::new(),
            points: 0,
        }
    }

    /// All pairs of a vertex and a triangle that may be within their reach at `x`, by vertex and triangle, and all such
    /// pairs of edges.
    pub fn near(&mut self, sheet: &Sheet, x: &[Vec3], range: &Range) -> (&[Pair], &[Pair]) {
        if self.range != *range || !self.serves(sheet.reduction(), x) {
            self.make(sheet, x, *range);
        }
        self.pairs.split_at(self.points)
    }

    /// Whether the list serves at `x`.
    fn serves(&self, reduction: &Reduction, x: &[Vec3]) -> bool {
        self.made_at.len() == x.len() && reduction.distance(&self.made_at, x) <= self.margin
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
        let end: Vec<Vec3> = x.iter().zip(direction).map(|(x, d)| x + d).collect();
        let share = |pair: &Pair| {
            let from = at(x, &pair.corners);
            let least = APPROACH * pair.reach.min(pair.kind.distance(&from));
            pair.kind.free_share(&from, &at(direction, &pair.corners), least)
        };
        let least = |pairs: &[Pair]| -parallel::max(pairs.len(), |k| -share(&pairs[k]));
        let listed = self.range == *range
            && self.serves(sheet.reduction(), x)
            && self.serves(sheet.reduction(), &end);
        let blocked = if listed {
            least(&self.pairs)
        } else if sheet.reduction().largest(direction) <= self.margin {
            self.make(sheet, x, *range);
            least(&self.pairs)
        } else {
            least(&self.on_path(sheet, (x, direction), range))
        };
        blocked.min(1.0)
    }

    /// Makes the list at `x`.
    fn make(&mut self, sheet: &Sheet, x: &[Vec3], range: Range) {
        self.follow(sheet, x, None);
        let slack = 2.0 * self.margin;
        let keep = |kind: Kind, corners: &[u32; 4]| {
            let distance = kind.distance(&at(x, corners)) - slack;
            // Distances at rest are asked for last: most pairs are out of reach without.
            let reach = (distance < range.of(kind)).then(|| reach(kind, sheet, corners, &range))?;
            (distance < reach).then_some(reach)
        };
        let mut search = Search { sheet, x, d: None, keep: &keep };
        let mut pairs = search.points(self, slack + range.points);
        let points = pairs.len();
        pairs.append(&mut search.edges(self, slack + range.edges));
        (self.pairs, self.points, self.range) = (pairs, points, range);
        self.made_at.clear();
        self.made_at.extend_from_slice(x);
    }

    /// All pairs that may touch on the step `d` from `x`.
    fn on_path(&mut self, sheet: &Sheet, (x, d): (&[Vec3], &[Vec3]), range: &Range) -> Vec<Pair> {
        self.follow(sheet, x, Some(d));
        let keep = |kind: Kind, corners: &[u32; 4]| Some(reach(kind, sheet, corners, range));
        let mut search = Search { sheet, x, d: Some(d), keep: &keep };
        let mut pairs = search.points(self, APPROACH * range.points);
        pairs.append(&mut search.edges(self, APPROACH * range.edges));
        pairs
    }

    fn follow(&mut self, sheet: &Sheet, x: &[Vec3], d: Option<&[Vec3]>) {
        self.triangles.follow(|t| sheet.triangles()[t as usize], x, d);
        self.edges.follow(|e| sheet.edges()[e as usize].vertices, x, d);
    }
}

/// A search for pairs at the shape x and on its step d, of which `keep` gives the reach.
struct Search<'a, K> {
    sheet: &'a Sheet,
    x: &'a [Vec3],
    d: Option<&'a [Vec3]>,
    keep: &'a K,
}

impl<K: Fn(Kind, &[u32; 4]) -> Option<f64> + Sync> Search<'_, K> {
    /// The pairs of a vertex and a triangle at most `far` apart, in their order.
    fn points(&mut self, of: &Proximity, far: f64) -> Vec<Pair> {
        let Self { sheet, x, d, keep } = *self;
        let Features { tree, balls } = &of.triangles;
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
    fn edges(&mut self, of: &Proximity, far: f64) -> Vec<Pair> {
        let Self { sheet, x, d, keep } = *self;
        let Features { tree, balls } = &of.edges;
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

/// The reach of a pair.
fn reach(kind: Kind, sheet: &Sheet, corners: &[u32; 4], range: &Range) -> f64 {
    let at_rest = kind.distance(&at(sheet.rest(), corners));
    range.of(kind).min(OF_REST * range.shrinkage * at_rest)
}

#[cfg(test)]
mod tests {
    use super::*;
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
            let mut proximity = Proximity::new(&sheet, 1.0);
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

    #[test]
    fn a_flat_sheet_has_no_pairs_and_its_list_is_empty() {
        let (sheet, _) = folded(12, 0.5, 0.0);
        let mut proximity = Proximity::new(&sheet, 1.0);
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
            let mut fresh = Proximity::new(&sheet, 1.0);
            let share = fresh.largest_step(&sheet, (&x, &direction), &RANGE);
            let mut listed = Proximity::new(&sheet, 1.0);
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
        let mut proximity = Proximity::new(&sheet, 1.0);
        let away: Vec<Vec3> = x.iter().map(|x| Vec3::new(0.0, 0.0, 20.0 * x.z)).collect();
        assert_eq!(proximity.largest_step(&sheet, (&x, &away), &RANGE), 1.0);
        let along = vec![Vec3::new(100.0, 3.0, -7.0); x.len()];
        assert_eq!(proximity.largest_step(&sheet, (&x, &along), &RANGE), 1.0);
    }
}
