//! The contacts of a shape: pairs of features within their reach, each an element of the energy.
//!
//! A vertex v near a surface of triangles feels it once, wherever its nearest point lies: the sum over triangles less
//! that over edges plus that over vertices,
//!
//! ```text
//! Σ_T b(d(v, T)) + Σ_e c_e b(d(v, e)) + Σ_p c_p b(d(v, p))
//! c_e = 1 - n_e,    c_p = 1 - n_p - Σ_{e∋p} c_e
//! ```
//!
//! n the triangles at an edge or a vertex (Li, Ferguson, Schneider, Langlois, Zorin, Panozzo, Jiang & Kaufman,
//! *Convergent incremental potential contact* (2023), arXiv:2307.15908, in general form: c_e = -1 and c_p = 1 inside).
//! Terms with the same nearest feature are one contact. Pairs whose reach their distance at rest bounds are near on the
//! sheet too; each counts by itself.

use super::distance_potential::DistancePotential;
use super::mollifier::Mollifier;
use crate::Vec3;
use crate::effects::{Block, HessianPart};
use crate::geometry::proximity::{
    Nearest, Pair, PairKind, corner_positions, edge_edge, point_edge, point_point, point_triangle,
};
use crate::num::real;
use crate::parallel::{self, BLOCK};

/// What weighs contacts.
pub(super) struct Weights<'a> {
    /// That of vertices and triangles that are far apart at rest.
    pub(super) potential: DistancePotential,
    /// Half the rest area of every vertex and of every edge.
    pub(super) vertex: &'a [f64],
    pub(super) edge: &'a [f64],
    pub(super) rest: &'a [Vec3],
}

/// Two features within their reach.
#[derive(Debug, Clone)]
pub(super) struct ContactPair {
    pub(super) corners: [u32; 4],
    pub(super) nearest: Nearest,
    /// Area.
    weight: f64,
    potential: DistancePotential,
    mollifier: Option<Mollifier>,
}

impl ContactPair {
    /// Distance.
    pub(super) fn distance(&self) -> f64 {
        self.nearest.distance()
    }

    /// The corners that it depends on, as places among the four.
    pub(super) fn carriers(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        let all = self.mollifier.is_some();
        (0..4).filter(move |k| all || self.nearest.weights()[*k] != 0.0)
    }

    pub(super) fn energy(&self) -> f64 {
        let share = self.mollifier.as_ref().map_or(1.0, |m| m.value);
        self.weight * share * self.potential.energy(self.distance())
    }

    /// Derivatives of the energy by the corners.
    pub(super) fn gradient(&self) -> [Vec3; 4] {
        let d = self.distance();
        let n = self.nearest.connection() / d;
        let share = self.mollifier.as_ref().map_or(1.0, |m| m.value);
        let slope = self.weight * share * self.potential.slope(d);
        let mut all = self.nearest.weights().map(|w| slope * w * n);
        if let Some(m) = &self.mollifier {
            let energy = self.weight * self.potential.energy(d);
            all.iter_mut().zip(m.gradient()).for_each(|(all, by)| *all += energy * by);
        }
        all
    }

    /// Second derivatives by the corners, at `x`. Their positive part is the one across the gap.
    pub(super) fn hessian(&self, x: &[Vec3; 4], part: HessianPart) -> [[Block; 4]; 4] {
        let d = self.distance();
        let n = self.nearest.connection() / d;
        let w = self.nearest.weights();
        let share = self.mollifier.as_ref().map_or(1.0, |m| m.value);
        let (b, slope) = (self.potential.energy(d), self.potential.slope(d));
        let across = n * n.transpose();
        let block = |stiffness: f64| -> [[Block; 4]; 4] {
            w.map(|k| w.map(|m| stiffness * k * m * across))
        };
        let curvature = self.weight * share * self.potential.curvature(d);
        if part == HessianPart::Positive {
            return block(curvature.max(0.0));
        }
        let slope_here = self.weight * share * slope;
        let mut all = block(curvature - slope_here / d);
        let squared = self.nearest.squared_hessian(x);
        let (by, twice) = match &self.mollifier {
            Some(m) => (m.gradient(), m.hessian()),
            None => ([Vec3::zeros(); 4], [[Block::zeros(); 4]; 4]),
        };
        for (k, row) in all.iter_mut().enumerate() {
            for (m, block) in row.iter_mut().enumerate() {
                *block += slope_here / (2.0 * d) * squared[k][m];
                let mixed = w[k] * n * by[m].transpose() + w[m] * by[k] * n.transpose();
                *block += self.weight * (slope * mixed + b * twice[k][m]);
            }
        }
        all
    }
}

/// All contacts at `x` among the pairs of vertices with triangles, by vertex, and of edges.
pub(super) fn contacts(
    (points, edges): (&[Pair], &[Pair]),
    x: &[Vec3],
    weights: &Weights<'_>,
) -> Vec<ContactPair> {
    let groups: Vec<&[Pair]> = points.chunk_by(|a, b| a.features[0] == b.features[0]).collect();
    let both = |mut a: Vec<ContactPair>, mut b: Vec<ContactPair>| {
        a.append(&mut b);
        a
    };
    let blocks = |count: usize, one: &(dyn Fn(usize, &mut Vec<ContactPair>) + Sync)| {
        let block = |b: usize| {
            let mut all = Vec::new();
            (b * BLOCK..((b + 1) * BLOCK).min(count)).for_each(|k| one(k, &mut all));
            all
        };
        parallel::reduce(count.div_ceil(BLOCK), &block, &both).unwrap_or_default()
    };
    let of_points = blocks(groups.len(), &|k, all| of_vertex(groups[k], x, weights, all));
    let of_edges = blocks(edges.len(), &|k, all| all.extend(of_edges(&edges[k], x, weights)));
    both(of_points, of_edges)
}

/// Adds the contacts of one vertex with triangles.
fn of_vertex(pairs: &[Pair], x: &[Vec3], weights: &Weights<'_>, all: &mut Vec<ContactPair>) {
    let mut features = Features::default();
    for pair in pairs {
        let (nearest, between) = point_triangle(&corner_positions(x, &pair.corners));
        if !(nearest.distance() < pair.reach) {
            continue;
        }
        if pair.reach < weights.potential.reach() {
            let weight = weights.vertex[pair.corners[0] as usize];
            let (corners, potential) = (pair.corners, weights.potential.of_neighbours(pair.reach));
            all.extend(potential.map(|potential| ContactPair {
                corners,
                nearest,
                weight,
                potential,
                mollifier: None,
            }));
        } else {
            features.add_triangle(&pair.corners, nearest, between);
        }
    }
    features.into_contacts(x, weights, all);
}

/// A feature of triangles as one vertex is near it, with how often it counts.
struct Feature {
    /// The corners that the nearest point lies between, ascending.
    between: [u32; 3],
    count: i32,
    corners: [u32; 4],
    nearest: Nearest,
}

/// The features of the triangles within reach of one vertex.
#[derive(Default)]
struct Features {
    nearest: Vec<Feature>,
    /// The triangles, with the vertex before them.
    triangles: Vec<[u32; 4]>,
}

impl Features {
    fn add_triangle(&mut self, corners: &[u32; 4], nearest: Nearest, between: u8) {
        self.triangles.push(*corners);
        self.add(corners, (nearest, between), 1);
    }

    fn add(&mut self, corners: &[u32; 4], (nearest, between): (Nearest, u8), count: i32) {
        let of = |k: usize| if between >> k & 1 == 1 { corners[k + 1] } else { u32::MAX };
        let mut between = [of(0), of(1), of(2)];
        between.sort_unstable();
        self.nearest.push(Feature { between, count, corners: *corners, nearest });
    }

    /// Adds what counts with them to `all`.
    fn into_contacts(mut self, x: &[Vec3], weights: &Weights<'_>, all: &mut Vec<ContactPair>) {
        if self.triangles.len() > 1 {
            self.count_shared(x);
        }
        self.nearest.sort_by_key(|feature| feature.between);
        for same in self.nearest.chunk_by(|a, b| a.between == b.between) {
            let count: i32 = same.iter().map(|feature| feature.count).sum();
            let Feature { corners, nearest, .. } = same[0];
            if count != 0 && nearest.distance() < weights.potential.reach() {
                let weight = f64::from(count) * weights.vertex[corners[0] as usize];
                let potential = weights.potential;
                all.push(ContactPair { corners, nearest, weight, potential, mollifier: None });
            }
        }
    }

    /// Adds the edges and vertices of more than one triangle.
    fn count_shared(&mut self, x: &[Vec3]) {
        // (edge, where one has it as triangle and corners)
        let mut edges = Vec::with_capacity(3 * self.triangles.len());
        for (t, [_, a, b, c]) in self.triangles.iter().enumerate() {
            for (p, q, ends) in [(a, b, [1, 2]), (a, c, [1, 3]), (b, c, [2, 3])] {
                edges.push(([*p.min(q), *p.max(q)], t, ends));
            }
        }
        edges.sort_unstable();
        // (vertex, what it has to add, where one has it)
        let mut vertices = Vec::with_capacity(5 * self.triangles.len());
        for (t, corners) in self.triangles.iter().enumerate() {
            (1..4).for_each(|k| vertices.push((corners[k], t, k, -1)));
        }
        let triangles = std::mem::take(&mut self.triangles);
        for same in edges.chunk_by(|a, b| a.0 == b.0) {
            let (_, t, ends) = same[0];
            let count = 1 - i32::try_from(same.len()).unwrap_or(i32::MAX);
            if count != 0 {
                let corners = &triangles[t];
                self.add(corners, point_edge(&corner_positions(x, corners), ends), count);
                ends.iter().for_each(|k| vertices.push((corners[*k], t, *k, -count)));
            }
        }
        vertices.sort_unstable();
        for same in vertices.chunk_by(|a, b| a.0 == b.0) {
            let (_, t, k, _) = same[0];
            let count = 1 + same.iter().map(|(.., count)| count).sum::<i32>();
            if count != 0 {
                let corners = &triangles[t];
                self.add(
                    corners,
                    (point_point(&corner_positions(x, corners), k), 1 << (k - 1)),
                    count,
                );
            }
        }
    }
}

/// The contact of two edges, if there is one.
fn of_edges(pair: &Pair, x: &[Vec3], weights: &Weights<'_>) -> Option<ContactPair> {
    debug_assert_eq!(pair.kind, PairKind::EdgeEdge);
    let place = corner_positions(x, &pair.corners);
    let nearest = edge_edge(&place);
    if !(nearest.distance() < pair.reach) {
        return None;
    }
    let [e, f] = pair.features.map(|e| weights.edge[e as usize]);
    let potential = weights.potential.of_neighbours(pair.reach)?;
    let mollifier = Mollifier::new(&place, &corner_positions(weights.rest, &pair.corners));
    Some(ContactPair {
        corners: pair.corners,
        nearest,
        weight: (e + f) / real(2),
        potential,
        mollifier: Some(mollifier),
    })
}
