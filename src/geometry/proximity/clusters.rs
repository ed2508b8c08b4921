//! Clusters of neighbouring vertices with their edges and triangles, and the patch of the sheet around each.
//!
//! Made once, at rest. Vertices are split along the longest extent at the median until a cluster is small; each feature
//! belongs to the cluster of its first corner. The *patch* of a cluster is the connected part of the sheet in a
//! ball around it that *covers* the clusters near it on the sheet: of any two points in the cluster and in one that it
//! covers, a path within the patch leads from the one to the other with tangents that deviate from its chord by at most
//! an angle β. A patch of a surface with normals in a cone of half-angle ν that is a graph above a convex domain has
//! β ≤ 2ν; where its boundary is concave, what that turns comes on top.

use std::f64::consts::PI;

use rumple_numerics::Vec3;
use rumple_numerics::num::{index, real};
use rumple_sheet::{Edge, Sheet};

use crate::box_tree::{Bounds, BoxTree};

/// Vertices of a cluster, unless the reach asks for larger ones.
const VERTICES: usize = 8;
/// Extent of a cluster up to which it may have more, in units of the reach.
const EXTENT: f64 = 1.0;
/// Clusters are covered whose centres are nearer than this many reaches beside the two radii …
const REACHES: f64 = 1.5;
/// … but not beyond this many radii: boxes keep them apart from there on.
const RADII: f64 = 6.0;
/// Radius of a patch in units of what it has to hold.
const WIDER: f64 = 1.1;
/// The largest β, radians, at which a patch is of use.
const LARGEST_TURN: f64 = 1.1;

/// Neighbouring features.
#[derive(Debug, Default)]
pub(super) struct Cluster {
    pub(super) vertices: Vec<u32>,
    pub(super) edges: Vec<u32>,
    pub(super) triangles: Vec<u32>,
    /// All corners of these, ascending.
    pub(super) corners: Vec<u32>,
    /// Centre and radius of a ball around the corners at rest.
    pub(super) centre: Vec3,
    pub(super) radius: f64,
    pub(super) patch: Patch,
    /// Which of two bodies it is of, where features of one body make no pairs.
    pub(super) body: Option<bool>,
}

/// The part of the sheet around a cluster; nothing where there is none of use.
#[derive(Debug, Default)]
pub(super) struct Patch {
    pub(super) triangles: Vec<u32>,
    /// The clusters that it covers, ascending, itself among them.
    pub(super) covers: Vec<u32>,
    /// β, radians.
    pub(super) turn: f64,
}

impl Patch {
    /// By how much c changes (`deformation.rs`) at most with F.
    pub(super) fn sensitivity(&self) -> f64 {
        (1.0 + self.turn) / self.turn.cos()
    }
}

impl Cluster {
    /// The largest distance at rest of a feature of the one from a feature of the other.
    #[inline]
    pub(super) fn span(&self, other: &Self) -> f64 {
        (self.centre - other.centre).norm() + self.radius + other.radius
    }

    /// Whether the two are of one body whose features make no pairs.
    #[inline]
    pub(super) fn same_body(&self, other: &Self) -> bool {
        self.body.is_some() && self.body == other.body
    }

    /// The box of its corners in `x`.
    pub(super) fn bounds(&self, x: &[Vec3]) -> Bounds {
        Bounds::of(self.corners.iter().map(|v| x[*v as usize]))
    }
}

/// The clusters of `sheet`, for features that reach as far as `reach`.
pub(super) fn clusters(sheet: &Sheet, reach: f64) -> Vec<Cluster> {
    let mut all: Vec<Cluster> = Vec::new();
    let mut of = vec![0; sheet.vertex_count()];
    for mut component in components(sheet) {
        split(&mut component, sheet.rest(), EXTENT * reach, &mut |vertices| {
            vertices.iter().for_each(|v| of[*v as usize] = all.len());
            all.push(Cluster { vertices: vertices.to_vec(), ..Cluster::default() });
        });
    }
    for (e, edge) in sheet.edges().iter().enumerate() {
        all[of[edge.vertices[0] as usize]].edges.push(index(e));
    }
    for (t, corners) in sheet.triangles().iter().enumerate() {
        all[of[corners[0] as usize]].triangles.push(index(t));
    }
    for cluster in &mut all {
        let edges = cluster.edges.iter().flat_map(|e| sheet.edges()[*e as usize].vertices);
        let triangles = cluster.triangles.iter().flat_map(|t| sheet.triangles()[*t as usize]);
        cluster.corners = cluster.vertices.iter().copied().chain(edges).chain(triangles).collect();
        cluster.corners.sort_unstable();
        cluster.corners.dedup();
        let places = || cluster.corners.iter().map(|v| sheet.rest()[*v as usize]);
        cluster.centre = places().sum::<Vec3>() / real(cluster.corners.len());
        cluster.radius = places().map(|x| (x - cluster.centre).norm()).fold(0.0, f64::max);
    }
    let patches = Patches::new(sheet, &all, reach).all();
    all.iter_mut().zip(patches).for_each(|(cluster, patch)| cluster.patch = patch);
    all
}

/// The vertices of every connected component.
fn components(sheet: &Sheet) -> Vec<Vec<u32>> {
    let mut seen = vec![false; sheet.vertex_count()];
    let mut all = Vec::new();
    for first in 0..index(sheet.vertex_count()) {
        if std::mem::replace(&mut seen[first as usize], true) {
            continue;
        }
        let (mut found, mut next) = (vec![first], 0);
        while let Some(v) = found.get(next).copied() {
            next += 1;
            for (_, other) in sheet.vertex_edges().of(v as usize) {
                if !std::mem::replace(&mut seen[*other as usize], true) {
                    found.push(*other);
                }
            }
        }
        all.push(found);
    }
    all
}

/// Splits `vertices` at the median of their longest extent until they are few, or within `extent`.
fn split(vertices: &mut [u32], rest: &[Vec3], extent: f64, take: &mut dyn FnMut(&[u32])) {
    let size = Bounds::of(vertices.iter().map(|v| rest[*v as usize])).size();
    if vertices.len() <= VERTICES || size.max() <= extent {
        vertices.sort_unstable();
        take(vertices);
        return;
    }
    let (axis, middle) = (size.imax(), vertices.len() / 2);
    let order = |a: &u32, b: &u32| {
        let along = |v: &u32| rest[*v as usize][axis];
        along(a).total_cmp(&along(b)).then(a.cmp(b))
    };
    vertices.select_nth_unstable_by(middle, order);
    let (low, high) = vertices.split_at_mut(middle);
    split(low, rest, extent, take);
    split(high, rest, extent, take);
}

/// What patches are made with.
struct Patches<'a> {
    sheet: &'a Sheet,
    clusters: &'a [Cluster],
    reach: f64,
    /// The unit normals of the triangles at rest.
    normals: Vec<Vec3>,
    /// How much the boundary turns inwards at every vertex, radians.
    concave: Vec<f64>,
    /// For which cluster a triangle or vertex was last reached, from 1.
    reached: (Vec<usize>, Vec<usize>),
}

impl<'a> Patches<'a> {
    fn new(sheet: &'a Sheet, clusters: &'a [Cluster], reach: f64) -> Self {
        let at = |t: &[u32; 3]| t.map(|v| sheet.rest()[v as usize]);
        let normal = |t: &[u32; 3]| {
            let [a, b, c] = at(t);
            (b - a).cross(&(c - a)).normalize()
        };
        let mut angle = vec![0.0; sheet.vertex_count()];
        for triangle in sheet.triangles() {
            let x = at(triangle);
            for k in 0..3 {
                let [p, q] = [1, 2].map(|j| x[(k + j) % 3] - x[k]);
                angle[triangle[k] as usize] += p.angle(&q);
            }
        }
        let concave = angle.iter().zip(sheet.boundary());
        let concave = concave.map(|(angle, rim)| if *rim { (angle - PI).max(0.0) } else { 0.0 });
        Self {
            sheet,
            clusters,
            reach,
            normals: sheet.triangles().iter().map(normal).collect(),
            concave: concave.collect(),
            reached: (vec![0; sheet.triangle_count()], vec![0; sheet.vertex_count()]),
        }
    }

    fn all(mut self) -> Vec<Patch> {
        let boxes: Vec<Bounds> =
            self.clusters.iter().map(|c| c.bounds(self.sheet.rest())).collect();
        let tree = BoxTree::new(&boxes);
        (0..self.clusters.len()).map(|k| self.of(k, &boxes, &tree)).collect()
    }

    /// The patch around cluster `k`.
    fn of(&mut self, k: usize, boxes: &[Bounds], tree: &BoxTree) -> Patch {
        let own = &self.clusters[k];
        let mut covers = Vec::new();
        let limit = |radius: f64| (REACHES * self.reach + 2.0 * radius).min(RADII * radius);
        let far = limit(self.clusters.iter().map(|c| c.radius).fold(0.0, f64::max));
        let enter = |node: &Bounds| node.gap(&boxes[k]) <= far;
        tree.visit(enter, 0, |j| {
            let other = &self.clusters[j as usize];
            let apart = (own.centre - other.centre).norm();
            if apart <= limit(own.radius.max(other.radius)) || boxes[k].meets(&boxes[j as usize]) {
                covers.push(j);
            }
        });
        let of = |j: &u32| {
            let other = &self.clusters[*j as usize];
            (own.centre - other.centre).norm() + other.radius
        };
        let radius = WIDER * covers.iter().map(of).fold(0.0, f64::max);
        let triangles = self.around(k, radius);
        let Some(turn) = self.turn(&triangles).filter(|turn| *turn <= LARGEST_TURN) else {
            return Patch::default();
        };
        covers.retain(|j| self.holds(k, *j));
        covers.sort_unstable();
        Patch { triangles, covers, turn }
    }

    /// The triangles within `radius` of cluster `k` that are connected to its own.
    fn around(&mut self, k: usize, radius: f64) -> Vec<u32> {
        let Self { sheet, clusters, reached: (triangles, vertices), .. } = self;
        let (own, mark) = (&clusters[k], k + 1);
        let mut found: Vec<u32> = Vec::new();
        let mut reach = |t: u32, found: &mut Vec<u32>| {
            let corners = sheet.triangles()[t as usize];
            let within = |v: &u32| (sheet.rest()[*v as usize] - own.centre).norm() <= radius;
            if triangles[t as usize] != mark && corners.iter().any(within) {
                triangles[t as usize] = mark;
                corners.iter().for_each(|v| vertices[*v as usize] = mark);
                found.push(t);
            }
        };
        let first = own.vertices.iter().flat_map(|v| sheet.vertex_triangles().of(*v as usize));
        first.for_each(|(t, _)| reach(*t, &mut found));
        let mut next = 0;
        while let Some(t) = found.get(next).copied() {
            next += 1;
            for e in sheet.triangle_edges()[t as usize] {
                let both = sheet.edges()[e as usize].triangles;
                both.iter().filter(|t| **t != Edge::NONE).for_each(|t| reach(*t, &mut found));
            }
        }
        found.sort_unstable();
        found
    }

    /// Whether the patch last reached, of cluster `k`, holds all features of cluster `j`.
    fn holds(&self, k: usize, j: u32) -> bool {
        let (triangles, vertices) = &self.reached;
        let other = &self.clusters[j as usize];
        other.triangles.iter().all(|t| triangles[*t as usize] == k + 1)
            && other.corners.iter().all(|v| vertices[*v as usize] == k + 1)
    }

    /// β of a patch; nothing where its normals are in no cone.
    fn turn(&self, triangles: &[u32]) -> Option<f64> {
        let sum: Vec3 = triangles.iter().map(|t| self.normals[*t as usize]).sum();
        let axis = sum.try_normalize(f64::EPSILON)?;
        let angle = |t: &u32| axis.cross(&self.normals[*t as usize]).norm();
        let upright = triangles.iter().all(|t| axis.dot(&self.normals[*t as usize]) > 0.0);
        let cone = triangles.iter().map(angle).fold(0.0, f64::max).min(1.0).asin();
        let mut corners: Vec<u32> =
            triangles.iter().flat_map(|t| self.sheet.triangles()[*t as usize]).collect();
        corners.sort_unstable();
        corners.dedup();
        let concave: f64 = corners.iter().map(|v| self.concave[*v as usize]).sum();
        let turn = 2.0 * cone + concave;
        // What round-off makes of a flat patch with straight sides.
        let turn = if turn < 1e-7 { 0.0 } else { turn };
        upright.then_some(turn)
    }
}
