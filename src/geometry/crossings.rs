//! Where a surface passes through itself: pairs of triangles that cross.
//!
//! Two triangles cross where an edge of one passes through the plane of the other inside of it (signs of the
//! volumes of tetrahedra; Guigue & Devillers, J. Graphics Tools 8 (2003) 25, doi:10.1080/10867651.2003.10487580). Of two that
//! share a corner only the edges opposite of it are asked; two that share an edge cross only where one lies folded
//! flat on the other. Triangles in one plane cross where they overlap. A touch does not count as a crossing.
//!
//! Candidates come from a tree of boxes that follows the shape (`box_tree.rs`). All pairs are found, in O(n log n) for
//! n triangles of a sheet that is not crumpled beyond recognition.

use rumple_numerics::Vec3;
use rumple_numerics::parallel::{self, BLOCK};
use rumple_sheet::Sheet;

use crate::box_tree::{Bounds, BoxTree};

/// Finds pairs of triangles of one sheet that cross.
#[derive(Debug, Clone)]
pub struct Crossings {
    tree: BoxTree,
    /// How many triangles the first of two bodies has, where crossings of the two are asked for.
    first: Option<usize>,
}

/// What crosses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CrossingPairs {
    /// Pairs of triangles.
    pub pairs: usize,
    /// The first of them by the numbers of the triangles.
    pub first: Option<[usize; 2]>,
}

impl CrossingPairs {
    /// Where the first pair of triangles crosses in the shape `x` of `sheet`, in words; empty where none does.
    #[must_use]
    pub fn place(&self, sheet: &Sheet, x: &[Vec3]) -> String {
        let Some([a, b]) = self.first else { return String::new() };
        let of = |t: usize| sheet.triangles()[t];
        let centre = of(a).map(|v| x[v as usize]).iter().sum::<Vec3>() / 3.0;
        format!(
            "first triangles {a} (vertices {:?}) and {b} (vertices {:?}) near ({:.4}, {:.4}, {:.4})",
            of(a),
            of(b),
            centre.x,
            centre.y,
            centre.z
        )
    }
}

impl Crossings {
    /// For the shapes of `sheet`.
    #[must_use]
    pub fn new(sheet: &Sheet) -> Self {
        let of = |t: &[u32; 3]| Bounds::enclosing(t.map(|v| sheet.rest()[v as usize]));
        let bounds: Vec<Bounds> = sheet.triangles().iter().map(of).collect();
        Self { tree: BoxTree::new(&bounds), first: None }
    }

    /// For two bodies, of which the `first` triangles are one: crossings within a body do not count.
    #[must_use]
    pub fn between(sheet: &Sheet, first: usize) -> Self {
        Self { first: Some(first), ..Self::new(sheet) }
    }

    /// All pairs of triangles that cross in the shape `x` of `sheet`, which it was made for.
    #[must_use]
    pub fn find(&mut self, sheet: &Sheet, x: &[Vec3]) -> CrossingPairs {
        let bounds =
            |t: u32| Bounds::enclosing(sheet.triangles()[t as usize].map(|v| x[v as usize]));
        self.tree.refit(bounds);
        let (this, count) = (&*self, self.tree.order().len());
        let block = |b: usize| {
            let mut found = CrossingPairs::default();
            for place in b * BLOCK..((b + 1) * BLOCK).min(count) {
                this.later(sheet, x, place, &mut |pair| {
                    found.pairs += 1;
                    found.first = found.first.into_iter().chain([pair]).min();
                });
            }
            found
        };
        let both = |a: CrossingPairs, b: CrossingPairs| CrossingPairs {
            pairs: a.pairs + b.pairs,
            first: a.first.into_iter().chain(b.first).min(),
        };
        parallel::reduce(count.div_ceil(BLOCK), &block, &both).unwrap_or_default()
    }

    /// All such pairs, in ascending order.
    #[must_use]
    pub fn all(&mut self, sheet: &Sheet, x: &[Vec3]) -> Vec<[usize; 2]> {
        let bounds =
            |t: u32| Bounds::enclosing(sheet.triangles()[t as usize].map(|v| x[v as usize]));
        self.tree.refit(bounds);
        let mut of = vec![Vec::new(); self.tree.order().len()];
        let this = &*self;
        parallel::update(&mut of, |place, found| {
            this.later(sheet, x, place, &mut |pair| found.push(pair));
        });
        let mut all = of.concat();
        all.sort_unstable();
        all
    }

    /// Hands the pairs of the triangle at `place` with those at later places to `found`.
    fn later(&self, sheet: &Sheet, x: &[Vec3], place: usize, found: &mut impl FnMut([usize; 2])) {
        let t = self.tree.order()[place];
        let corners = |t: u32| sheet.triangles()[t as usize];
        let bounds = |t: u32| Bounds::enclosing(corners(t).map(|v| x[v as usize]));
        let own = bounds(t);
        let of_first = |t: u32| self.first.is_some_and(|first| (t as usize) < first);
        let counts = |other: u32| self.first.is_none() || of_first(t) != of_first(other);
        self.tree.visit(
            |node| node.intersects(&own),
            place + 1,
            |other| {
                if counts(other)
                    && bounds(other).intersects(&own)
                    && cross(&corners(t), &corners(other), x)
                {
                    found([t.min(other) as usize, t.max(other) as usize]);
                }
            },
        );
    }
}

/// Whether two triangles cross.
fn cross(a: &[u32; 3], b: &[u32; 3], x: &[Vec3]) -> bool {
    let at = |t: &[u32; 3]| t.map(|v| x[v as usize]);
    let shared = a.iter().filter(|v| b.contains(v)).count();
    let [p, q] = [at(a), at(b)];
    if shared == 2 {
        return folded_flat(a, b, x);
    }
    let [of_a, of_b] = [[a, b], [b, a]].map(|[own, other]| edges(own, other, shared, x));
    let sides = q.map(|x| volume(&p, &x));
    // Most pairs whose boxes meet are those of neighbours, and those of the others that one plane parts.
    if shared == 0 && (sides.iter().all(|s| *s > 0.0) || sides.iter().all(|s| *s < 0.0)) {
        return false;
    }
    if sides.iter().all(|side| *side == 0.0) {
        let normal = (p[1] - p[0]).cross(&(p[2] - p[0]));
        let inside = |x: &Vec3, t: &[Vec3; 3]| {
            let side = |k: usize| area(&t[k], &t[(k + 1) % 3], x, &normal);
            (0..3).all(|k| side(k) > 0.0) || (0..3).all(|k| side(k) < 0.0)
        };
        return of_a.clone().any(|e| of_b.clone().any(|f| edges_cross(&e, &f, &normal)))
            || p.iter().any(|x| inside(x, &q))
            || q.iter().any(|x| inside(x, &p));
    }
    of_a.into_iter().any(|edge| pierces(&edge, &q))
        || of_b.into_iter().any(|edge| pierces(&edge, &p))
}

/// The edges of a triangle; of one that shares a corner with another those opposite of such corners.
fn edges(
    triangle: &[u32; 3],
    other: &[u32; 3],
    shared: usize,
    x: &[Vec3],
) -> impl Iterator<Item = [Vec3; 2]> + Clone {
    let asked = move |k: &usize| shared == 0 || other.contains(&triangle[*k]);
    let ends = |k: usize| [1, 2].map(|j| x[triangle[(k + j) % 3] as usize]);
    (0..3).filter(asked).map(ends)
}

/// Six times the volume of the tetrahedron of a triangle and a point.
fn volume([a, b, c]: &[Vec3; 3], x: &Vec3) -> f64 {
    (b - a).cross(&(c - a)).dot(&(x - a))
}

/// Whether an edge passes from one side of a triangle to the other through it.
fn pierces([from, to]: &[Vec3; 2], triangle: &[Vec3; 3]) -> bool {
    let sides = volume(triangle, from) * volume(triangle, to);
    if !(sides < 0.0) {
        return false;
    }
    let [a, b, c] = triangle;
    let turns = [[a, b], [b, c], [c, a]].map(|[a, b]| volume(&[*from, *to, *a], b));
    turns.iter().all(|t| *t >= 0.0) || turns.iter().all(|t| *t <= 0.0)
}

/// Twice the area of a triangle as seen along `normal`.
fn area(a: &Vec3, b: &Vec3, c: &Vec3, normal: &Vec3) -> f64 {
    (b - a).cross(&(c - a)).dot(normal)
}

/// Whether two edges in one plane cross.
fn edges_cross([a, b]: &[Vec3; 2], [c, d]: &[Vec3; 2], normal: &Vec3) -> bool {
    area(a, b, c, normal) * area(a, b, d, normal) < 0.0
        && area(c, d, a, normal) * area(c, d, b, normal) < 0.0
}

/// Whether two triangles with an edge in common lie in one plane and on the same side of it.
fn folded_flat(a: &[u32; 3], b: &[u32; 3], x: &[Vec3]) -> bool {
    let (Some(ka), Some(kb)) =
        ((0..3).find(|k| !b.contains(&a[*k])), (0..3).find(|k| !a.contains(&b[*k])))
    else {
        return false;
    };
    let [here, from, to] = [0, 1, 2].map(|j| x[a[(ka + j) % 3] as usize]);
    let there = x[b[kb] as usize];
    let normal = (to - from).cross(&(here - from));
    volume(&[here, from, to], &there) == 0.0 && area(&from, &to, &there, &normal) > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use rumple_numerics::num::index;
    use std::f64::consts::TAU;

    /// A ribbon of two rows of vertices along `curve`.
    fn ribbon(curve: impl Fn(f64) -> Vec3, steps: usize) -> Sheet {
        let place = |k: usize| {
            #[allow(clippy::cast_precision_loss)]
            let s = (k / 2) as f64 / steps as f64;
            let side = if k.is_multiple_of(2) { 0.0 } else { 0.2 };
            curve(s) + Vec3::new(0.0, 0.0, side)
        };
        let rest = (0..2 * steps + 2).map(place).collect();
        let two = |k: usize| [2 * k, 2 * k + 2, 2 * k + 1, 2 * k + 2, 2 * k + 3, 2 * k + 1];
        let corners: Vec<u32> = (0..steps).flat_map(two).map(index).collect();
        Sheet::new(rest, corners.as_chunks::<3>().0.to_vec()).unwrap()
    }

    /// Every pair, one by one.
    fn slowly(sheet: &Sheet, x: &[Vec3]) -> CrossingPairs {
        let mut found = CrossingPairs::default();
        let all = sheet.triangles();
        for s in 0..all.len() {
            for t in s + 1..all.len() {
                if cross(&all[s], &all[t], x) {
                    found.pairs += 1;
                    found.first = found.first.or(Some([s, t]));
                }
            }
        }
        found
    }

    #[test]
    fn an_eight_crosses_where_it_should_and_a_ring_does_not() {
        let eight = |s: f64| Vec3::new((TAU * s).sin(), (2.0 * TAU * s).sin(), 0.01 * s);
        let sheet = ribbon(|s| eight(0.97 * s + 0.26), 97);
        let mut crossings = Crossings::new(&sheet);
        let found = crossings.find(&sheet, sheet.rest());
        assert!(found.pairs > 0, "{found:?}");
        assert_eq!(found, slowly(&sheet, sheet.rest()));
        let [a, b] = found.first.unwrap();
        let middle = |t: usize| {
            sheet.triangles()[t].map(|v| sheet.rest()[v as usize]).iter().sum::<Vec3>() / 3.0
        };
        assert!(middle(a).xy().norm() < 0.2 && middle(b).xy().norm() < 0.2, "{a} {b}");
        // The same triangles as an arc of a circle.
        let ring = ribbon(|s| Vec3::new((6.0 * s).cos(), (6.0 * s).sin(), 0.0), 97);
        assert_eq!(crossings.find(&sheet, ring.rest()), CrossingPairs::default());
    }

    #[test]
    fn a_crumpled_ribbon_has_all_its_crossings_found() {
        let sheet = ribbon(|s| Vec3::new(s, 0.0, 0.0), 300);
        let mut seed = 7u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            #[allow(clippy::cast_precision_loss)]
            let unit = (seed >> 11) as f64 / (1u64 << 53) as f64;
            unit
        };
        let x: Vec<Vec3> =
            sheet.rest().iter().map(|x| x + Vec3::from_fn(|_, _| 0.1 * random())).collect();
        let found = Crossings::new(&sheet).find(&sheet, &x);
        assert!(found.pairs > 1000, "{found:?}");
        assert_eq!(found, slowly(&sheet, &x));
    }

    #[test]
    fn in_a_plane_overlap_and_folds_count_and_touch_does_not() {
        let flat = |x: f64, y: f64| Vec3::new(x, y, 0.0);
        // Two triangles with an edge in common, a third that shares one corner.
        let x = [
            flat(0.0, 0.0),
            flat(1.0, 0.0),
            flat(0.0, 1.0),
            flat(1.0, 1.0),
            flat(2.0, 0.5),
            flat(2.0, 1.5),
        ];
        let triangles = [[0, 1, 2], [1, 3, 2], [3, 4, 5]];
        let pairs = |x: &[Vec3]| {
            let all: Vec<(usize, usize)> = vec![(0, 1), (0, 2), (1, 2)];
            all.into_iter()
                .filter(|(s, t)| cross(&triangles[*s], &triangles[*t], x))
                .collect::<Vec<_>>()
        };
        assert_eq!(pairs(&x), []);
        let mut folded = x;
        folded[3] = flat(0.1, 0.1);
        folded[4] = flat(2.0, 0.2);
        assert!(pairs(&folded).contains(&(0, 1)));
        let mut over = x;
        over[4] = flat(0.5, 0.8);
        assert!(pairs(&over).contains(&(1, 2)));
    }
}
