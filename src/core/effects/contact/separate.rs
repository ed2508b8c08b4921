//! A start that touches or crosses itself slightly, pushed apart.
//!
//! Edges that cross triangles cut the sheet into parts, of which the smallest ones have passed through: an end v of a crossing
//! edge in such a part is on the wrong side, and the other end tells the right one. v and the triangle are moved along its
//! normal n until `n·(x_v - x_T) = g`. Where nothing crosses, pairs that are nearer than g are moved apart along their
//! connection. g is a share of the reach of the pair. Each pair moves its vertices by
//!
//! ```text
//! Δx_k = λ w_k n,   λ = (g - n·r)/Σ_k w_k²
//! ```
//!
//! (position based: Müller, Heidelberger, Hennix & Ratcliff, *Position based dynamics*, J. Vis. Commun. Image Represent. 18
//! (2007), doi:10.1016/j.jvcir.2007.01.005), and every vertex by the mean of what its pairs ask for, round after round.
//! No vertex goes further than the distance of contact: what has passed through by more is not known to be on the wrong
//! side, and is left to be refused.

use crate::Vec3;
use crate::effects::{Pins, SeparatedStart};
use crate::geometry::Crossings;
use crate::geometry::proximity::{
    Pair, PairKind, Proximity, Reach, corner_positions, edge_edge, point_triangle,
};
use crate::num::real;
use crate::sheet::Sheet;

/// Every gap is to exceed this share of the reach of its pair.
const MIN_GAP_SHARE: f64 = 0.25;
/// Pairs are moved apart by so much more than asked for, which rounds then reach.
const OVERSHOOT: f64 = 1.1;
/// Rounds after which it is given up: each moves vertices most of their way.
const MAX_ROUNDS: usize = 500;

/// A start to be pushed apart, and what bounds how.
pub(super) struct Start<'a> {
    pub(super) sheet: &'a Sheet,
    pub(super) x: &'a [Vec3],
    /// Directions in which vertices stay.
    pub(super) pins: &'a Pins,
    pub(super) range: Reach,
    pub(super) proximity: &'a mut Proximity,
}

/// What the pairs of one round ask for: the sum of displacements of every vertex, and how many.
struct Moves<'a> {
    pins: &'a Pins,
    all: Vec<(Vec3, usize)>,
    pairs: usize,
}

impl Start<'_> {
    /// A shape without crossings whose gaps are wide enough; `None` where this one has them, or where there is none within
    /// the distance.
    pub(super) fn separated(self) -> Option<SeparatedStart> {
        let Self { sheet, x: start, pins, range, proximity } = self;
        let (mut x, mut crossings) = (start.to_vec(), Crossings::new(sheet));
        let mut pairs = None;
        for _ in 0..MAX_ROUNDS {
            let mut moves = Moves { pins, all: vec![(Vec3::zeros(), 0); x.len()], pairs: 0 };
            let crossing = crossings.all(sheet, &x);
            moves.uncross((sheet, &x), &crossing, &range);
            if crossing.is_empty() {
                let (points, edges) = proximity.near(sheet, &x, &range);
                points.iter().chain(edges).for_each(|pair| moves.widen(&x, pair));
            }
            let found = if crossing.is_empty() { moves.pairs } else { crossing.len() };
            let first = *pairs.get_or_insert(found);
            if first == 0 || moves.pairs == 0 && !crossing.is_empty() {
                return None;
            }
            if moves.pairs == 0 {
                let moved = x.iter().zip(start).map(|(x, from)| (x - from).norm());
                let moved = moved.fold(0.0, f64::max);
                return Some(SeparatedStart { x, pairs: first, moved });
            }
            moves.apply(&mut x);
            let far = |(x, from): (&Vec3, &Vec3)| !((x - from).norm() <= range.points);
            if x.iter().zip(start).any(far) {
                return None;
            }
        }
        None
    }
}

impl Moves<'_> {
    /// Moves the ends of edges back that have passed through a triangle of the `crossing` ones.
    fn uncross(&mut self, (sheet, x): (&Sheet, &[Vec3]), crossing: &[[usize; 2]], range: &Reach) {
        let both = crossing.iter().flat_map(|[t, u]| [[*t, *u], [*u, *t]]);
        let all: Vec<Pierced> = both.flat_map(|[t, u]| pierced((sheet, x), t, u)).collect();
        let sizes = sizes_of_parts(sheet, &all);
        for Pierced { edge, triangle, weights } in all {
            let ends = sheet.edges()[edge].vertices;
            let corners = sheet.triangles()[triangle];
            let [one, other] = ends.map(|v| sizes[v as usize]);
            let [wrong, right] = if one <= other { ends } else { [ends[1], ends[0]] };
            let least = one.min(other);
            // Ends of one part tell nothing; a part that is smaller still has passed through instead.
            if one == other || corners.iter().any(|v| sizes[*v as usize] < least) {
                continue;
            }
            let [a, b, c] = corners.map(|v| x[v as usize]);
            let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) else { continue };
            let [depth, height] = [wrong, right].map(|v| normal.dot(&(x[v as usize] - a)));
            let four = [wrong, corners[0], corners[1], corners[2]];
            let at_rest = point_triangle(&corner_positions(sheet.rest(), &four)).0.distance();
            let gap =
                MIN_GAP_SHARE * OVERSHOOT * range.limited_by_rest(PairKind::PointTriangle, at_rest);
            let [p, q, r] = weights;
            let side = height.signum();
            self.push(&four, &[1.0, -p, -q, -r], gap - side * depth, side * normal);
        }
    }

    /// Moves a pair apart that is too near.
    fn widen(&mut self, x: &[Vec3], pair: &Pair) {
        let place = corner_positions(x, &pair.corners);
        let nearest = match pair.kind {
            PairKind::PointTriangle => point_triangle(&place).0,
            PairKind::EdgeEdge => edge_edge(&place),
        };
        let d = nearest.distance();
        if d < MIN_GAP_SHARE * pair.reach
            && let Some(normal) = nearest.connection().try_normalize(0.0)
        {
            let gap = MIN_GAP_SHARE * OVERSHOOT * pair.reach;
            self.push(&pair.corners, nearest.weights(), gap - d, normal);
        }
    }

    /// Asks the corners of a pair to part by `by` along `normal`.
    fn push(&mut self, corners: &[u32; 4], weights: &[f64; 4], by: f64, normal: Vec3) {
        let free =
            |k: usize| self.pins.get(corners[k] as usize).is_none_or(|pin| *pin != [true; 3]);
        let moving: Vec<usize> = (0..4).filter(|k| weights[*k] != 0.0 && free(*k)).collect();
        let sum: f64 = moving.iter().map(|k| weights[*k] * weights[*k]).sum();
        if sum > 0.0 {
            self.pairs += 1;
            for k in moving {
                let (total, count) = &mut self.all[corners[k] as usize];
                *total += (by * weights[k] / sum) * normal;
                *count += 1;
            }
        }
    }

    /// Moves every vertex.
    fn apply(&self, x: &mut [Vec3]) {
        for (i, (total, count)) in self.all.iter().enumerate().filter(|(_, (_, n))| *n > 0) {
            let mut by = *total / real(*count);
            if let Some(pin) = self.pins.get(i) {
                (0..3).filter(|a| pin[*a]).for_each(|a| by[a] = 0.0);
            }
            x[i] += by;
        }
    }
}

/// An edge that crosses a triangle, with the weights of its corners where it does.
struct Pierced {
    edge: usize,
    triangle: usize,
    weights: [f64; 3],
}

/// The edges of triangle `t` that cross `triangle`, without a vertex of it.
fn pierced<'a>(
    (sheet, x): (&'a Sheet, &'a [Vec3]),
    t: usize,
    triangle: usize,
) -> impl Iterator<Item = Pierced> + 'a {
    let corners = sheet.triangles()[triangle];
    sheet.triangle_edges()[t].into_iter().filter_map(move |edge| {
        let edge = edge as usize;
        let ends = sheet.edges()[edge].vertices;
        if ends.iter().any(|v| corners.contains(v)) {
            return None;
        }
        let weights = hit(ends.map(|v| x[v as usize]), corners.map(|v| x[v as usize]))?;
        Some(Pierced { edge, triangle, weights })
    })
}

/// Where an edge passes through a triangle, as weights of its corners; if it does.
fn hit([from, to]: [Vec3; 2], [a, b, c]: [Vec3; 3]) -> Option<[f64; 3]> {
    let normal = (b - a).cross(&(c - a));
    let [above, below] = [from, to].map(|p| normal.dot(&(p - a)));
    if !(above * below < 0.0) {
        return None;
    }
    let point = from + above / (above - below) * (to - from);
    let area = |p: &Vec3, q: &Vec3| normal.dot(&(p - point).cross(&(q - point)));
    let weights = [area(&b, &c), area(&c, &a), area(&a, &b)].map(|w| w / normal.norm_squared());
    weights.iter().all(|w| *w >= 0.0).then_some(weights)
}

/// How many vertices the part of every vertex has, where edges that cross triangles connect nothing.
fn sizes_of_parts(sheet: &Sheet, crossing: &[Pierced]) -> Vec<usize> {
    let mut cut = vec![false; sheet.edges().len()];
    crossing.iter().for_each(|one| cut[one.edge] = true);
    let mut sizes = vec![0; sheet.vertex_count()];
    for first in 0..sizes.len() {
        if sizes[first] > 0 {
            continue;
        }
        let (mut part, mut next) = (vec![first], 0);
        sizes[first] = 1;
        while let Some(v) = part.get(next).copied() {
            next += 1;
            for (edge, other) in sheet.vertex_edges().entries(v) {
                let other = *other as usize;
                if !cut[*edge as usize] && sizes[other] == 0 {
                    sizes[other] = 1;
                    part.push(other);
                }
            }
        }
        part.iter().for_each(|v| sizes[*v] = part.len());
    }
    sizes
}
