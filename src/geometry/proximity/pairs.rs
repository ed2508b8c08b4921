//! The pairs of a vertex and a triangle, and of two edges, that are near one another.
//!
//! Each pair has a *reach*, the distance below which it counts: that of the whole range, but never more than half of
//! what the pair has in the rest positions, so that neighbours at rest do not count. Incident features (a vertex and
//! its triangles, edges with a vertex in common) make no pair.
//!
//! A list holds all pairs that may come within their reach while no vertex moves by more than a margin from where it
//! was when the list was made; it is then rebuilt out of a longer list for a wider margin, which in turn comes
//! out of trees of boxes. What is read from it (which pairs are within their reach, how far a step may go) does not
//! depend on when it was made.

use rumple_numerics::Vec3;
use rumple_numerics::parallel::{self, BLOCK};
use rumple_numerics::reduction::Reduction;
use rumple_sheet::Sheet;

use super::advance::{Kind, at};
use super::search::{Features, Limit, Search};

/// Share of the distance at rest that bounds the reach of a pair.
const OF_REST: f64 = 0.5;
/// Motion of vertices for which a list of pairs serves, in mean edges of the rest positions. On a smooth sheet
/// neighbours are too far apart for the list then; a longer one would hold them, a shorter one is made more often.
const MARGIN: f64 = 0.15;
/// The same for the longer list.
const WIDE: f64 = 0.5;
/// Motion since the last list beyond which the next longer list would not last: the pairs come out of the trees.
const CALM: f64 = 0.3;
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
    triangles: Features,
    edges: Features,
    /// Mean edge at rest.
    edge: f64,
    range: Range,
    /// The longer list, with the distances of its pairs where it was made.
    wide: List<(Pair, f64)>,
    list: List<Pair>,
}

/// Pairs by vertex and triangle, then by edges.
#[derive(Debug)]
struct List<P> {
    /// Where it was made; nothing before.
    at: Vec<Vec3>,
    pairs: Vec<P>,
}

impl<P> List<P> {
    const NONE: Self = Self { at: Vec::new(), pairs: Vec::new() };

    /// Whether no vertex of `x` is further than `margin` from where the list was made.
    fn serves(&self, reduction: &Reduction, x: &[Vec3], margin: f64) -> bool {
        self.at.len() == x.len() && reduction.distance(&self.at, x) <= margin
    }

    fn set(&mut self, x: &[Vec3], pairs: Vec<P>) {
        self.at.clear();
        self.at.extend_from_slice(x);
        self.pairs = pairs;
    }
}

impl Proximity {
    /// For the shapes of `sheet`, whose mean edge at rest is `edge`.
    #[must_use]
    pub fn new(sheet: &Sheet, edge: f64) -> Self {
        Self {
            triangles: Features::new(sheet.triangles(), sheet.rest()),
            edges: Features::new(&ends(sheet), sheet.rest()),
            edge,
            range: Range { points: 0.0, edges: 0.0, shrinkage: 1.0 },
            wide: List::NONE,
            list: List::NONE,
        }
    }

    /// All pairs of a vertex and a triangle that may be within their reach at `x`, by vertex and triangle, and all such
    /// pairs of edges.
    pub fn near(&mut self, sheet: &Sheet, x: &[Vec3], range: &Range) -> (&[Pair], &[Pair]) {
        if self.range != *range || !self.list.serves(sheet.reduction(), x, MARGIN * self.edge) {
            self.make(sheet, x, *range);
        }
        let points = self.list.pairs.partition_point(|pair| pair.kind == Kind::PointTriangle);
        self.list.pairs.split_at(points)
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
        let (reduction, same) = (sheet.reduction(), self.range == *range);
        let margin = MARGIN * self.edge;
        let serves = |x: &[Vec3]| self.list.serves(reduction, x, margin);
        let blocked = if same && serves(x) && serves(&end) {
            least(&self.list.pairs)
        } else if reduction.largest(direction) <= margin {
            self.make(sheet, x, *range);
            least(&self.list.pairs)
        } else {
            let serves = |x: &[Vec3]| self.wide.serves(reduction, x, WIDE * self.edge);
            if same && serves(x) && serves(&end) {
                least(&self.wide_on_path(x, direction))
            } else {
                least(&self.on_path(sheet, (x, direction), range))
            }
        };
        blocked.min(1.0)
    }

    /// Makes the list at `x`.
    fn make(&mut self, sheet: &Sheet, x: &[Vec3], range: Range) {
        let (margin, reduction) = (MARGIN * self.edge, sheet.reduction());
        if self.range != range {
            self.wide = List::NONE;
        }
        let serves = self.wide.serves(reduction, x, WIDE * self.edge - margin);
        if !serves && !self.list.serves(reduction, x, CALM * self.edge) {
            let pairs = self.around(sheet, x, &range, margin);
            self.list.set(x, pairs);
            self.range = range;
            return;
        }
        if !serves {
            let pairs = self.around(sheet, x, &range, WIDE * self.edge);
            let with = |pair: Pair| (pair, pair.kind.distance(&at(x, &pair.corners)));
            self.wide.set(x, pairs.into_iter().map(with).collect());
        }
        let slack = 2.0 * margin;
        let List { at: from, pairs } = &self.wide;
        let near = filtered(pairs, &|(pair, distance)| {
            let moved = pair.corners.map(|v| x[v as usize] - from[v as usize]);
            let bound = distance - pair.kind.approach(&moved) - slack;
            bound < pair.reach && pair.kind.distance(&at(x, &pair.corners)) - slack < pair.reach
        });
        self.list.set(x, near.into_iter().map(|(pair, _)| pair).collect());
        self.range = range;
    }

    /// All pairs that may come within their reach while no vertex moves by more than `margin` from `x`.
    fn around(&mut self, sheet: &Sheet, x: &[Vec3], range: &Range, margin: f64) -> Vec<Pair> {
        self.follow(sheet, x, None);
        let slack = 2.0 * margin;
        let keep = |kind: Kind, corners: &[u32; 4]| {
            let distance = kind.distance(&at(x, corners)) - slack;
            // Distances at rest are asked for last: most pairs are out of reach without.
            let reach = (distance < range.of(kind)).then(|| reach(kind, sheet, corners, range))?;
            (distance < reach).then_some(reach)
        };
        let limit = Limit { range, share: 1.0, slack };
        let search = Search { sheet, x, d: None, limit, keep: &keep };
        let mut pairs = search.points(&self.triangles);
        pairs.append(&mut search.edges(&self.edges));
        pairs
    }

    /// All pairs of the longer list that may touch on the step `d` from `x`.
    fn wide_on_path(&self, x: &[Vec3], d: &[Vec3]) -> Vec<Pair> {
        let List { at: from, pairs } = &self.wide;
        let near = filtered(pairs, &|(pair, distance)| {
            let moved = pair.corners.map(|v| x[v as usize] - from[v as usize]);
            let step = at(d, &pair.corners);
            let bound = distance - pair.kind.approach(&moved) - pair.kind.approach(&step);
            bound < APPROACH * pair.reach
        });
        near.into_iter().map(|(pair, _)| pair).collect()
    }

    /// All pairs that may touch on the step `d` from `x`.
    fn on_path(&mut self, sheet: &Sheet, (x, d): (&[Vec3], &[Vec3]), range: &Range) -> Vec<Pair> {
        self.follow(sheet, x, Some(d));
        let keep = |kind: Kind, corners: &[u32; 4]| Some(reach(kind, sheet, corners, range));
        let limit = Limit { range, share: APPROACH, slack: 0.0 };
        let search = Search { sheet, x, d: Some(d), limit, keep: &keep };
        let mut pairs = search.points(&self.triangles);
        pairs.append(&mut search.edges(&self.edges));
        pairs
    }

    fn follow(&mut self, sheet: &Sheet, x: &[Vec3], d: Option<&[Vec3]>) {
        self.triangles.follow(|t| sheet.triangles()[t as usize], x, d);
        self.edges.follow(|e| sheet.edges()[e as usize].vertices, x, d);
    }
}

/// The `pairs` of which `keep` holds, in their order.
fn filtered<P: Copy + Send + Sync>(pairs: &[P], keep: &(impl Fn(&P) -> bool + Sync)) -> Vec<P> {
    let block = |b: usize| {
        let of = &pairs[b * BLOCK..((b + 1) * BLOCK).min(pairs.len())];
        of.iter().filter(|pair| keep(pair)).copied().collect::<Vec<P>>()
    };
    let both = |mut a: Vec<P>, mut b: Vec<P>| {
        a.append(&mut b);
        a
    };
    parallel::reduce(pairs.len().div_ceil(BLOCK), &block, &both).unwrap_or_default()
}

/// The ends of all edges.
fn ends(sheet: &Sheet) -> Vec<[u32; 2]> {
    sheet.edges().iter().map(|edge| edge.vertices).collect()
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
