//! The patch of the sheet around each cluster.
//!
//! The *patch* of a cluster is the part of the sheet in a ball around it, as far as clusters that meet the ball connect it. It
//! *covers* the clusters near it that clusters within the ball connect to it: of any two points in the cluster and in one that it
//! covers, a path within the patch leads from the one to the other with tangents that deviate from its chord by at most an
//! angle β. A patch of a surface with normals in a cone of half-angle ν that is a graph above a convex domain has β ≤ 2ν; where
//! its boundary is concave, what that turns comes on top.

use std::f64::consts::PI;

use rumple_numerics::Vec3;
use rumple_numerics::num::index;
use rumple_sheet::Sheet;

use crate::box_tree::{Bounds, BoxTree};

/// Clusters are covered whose centres are nearer than this many reaches beside the two radii …
const COVERED_REACHES: f64 = 1.5;
/// … but not beyond this many radii: boxes keep them apart from there on.
const COVERED_RADII: f64 = 6.0;
/// Radius of a patch in units of what it has to hold.
const RADIUS_FACTOR: f64 = 1.1;
/// Normals are the same that differ by less: no more than round-off.
const ROUND_OFF: f64 = 1e-9;
/// The largest β, radians, at which a patch is of use.
const LARGEST_TURN: f64 = 1.1;

/// The part of the sheet around a cluster; nothing where there is none of use.
#[derive(Debug, Default)]
pub(super) struct Patch {
    pub(super) triangles: Vec<u32>,
    /// The clusters of these, ascending.
    pub(super) clusters: Vec<u32>,
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

    /// c where t · M t goes from `least` to `largest`, and |M t - m t| to `whole`, m being the middle of these.
    pub(super) fn bound(&self, least: f64, largest: f64, whole: f64) -> f64 {
        let half = 0.5 * (largest - least);
        0.5 * (least + largest) - (half + self.turn * whole) / self.turn.cos()
    }

    /// The largest of the values of its clusters.
    pub(super) fn largest(&self, of: &[f64]) -> f64 {
        self.clusters.iter().map(|k| of[*k as usize]).fold(0.0, f64::max)
    }
}

/// Neighbouring features.
#[derive(Debug, Default)]
pub(super) struct Cluster {
    pub(super) vertices: Vec<u32>,
    pub(super) edges: Vec<u32>,
    pub(super) triangles: Vec<u32>,
    /// All corners of these, ascending.
    pub(super) corners: Vec<u32>,
    /// That of them which is nearest to the centre.
    pub(super) middle: u32,
    /// Centre and radius of a ball around the corners at rest.
    pub(super) centre: Vec3,
    pub(super) radius: f64,
    pub(super) patch: Patch,
    /// Which of two bodies it is of, where features of one body make no pairs.
    pub(super) body: Option<bool>,
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
        Bounds::enclosing(self.corners.iter().map(|v| x[*v as usize]))
    }
}

/// What patches are made with.
pub(super) struct Patches<'a> {
    sheet: &'a Sheet,
    clusters: &'a [Cluster],
    reach: f64,
    /// Of a cluster.
    largest_radius: f64,
    /// The clusters to which edges lead from each, ascending.
    next: Vec<Vec<u32>>,
    /// The unit normals of the triangles at rest.
    normals: Vec<Vec3>,
    /// The normal of every cluster whose triangles have the same.
    flat: Vec<Option<Vec3>>,
    /// How much the boundary turns inwards at every vertex, radians.
    concave: Vec<f64>,
    /// The sum of it over the corners of every cluster.
    most_concave: Vec<f64>,
    /// For which cluster another was last reached, from 1.
    reached: Vec<usize>,
}

impl<'a> Patches<'a> {
    /// For the clusters of `sheet`, and the number of that of every vertex.
    pub(super) fn new(
        sheet: &'a Sheet,
        (clusters, of): (&'a [Cluster], &[usize]),
        reach: f64,
    ) -> Self {
        let concave = concave(sheet);
        let sum = |cluster: &Cluster| cluster.corners.iter().map(|v| concave[*v as usize]).sum();
        let most_concave = clusters.iter().map(sum).collect();
        let mut next = vec![Vec::new(); clusters.len()];
        for edge in sheet.edges() {
            let [a, b] = edge.vertices.map(|v| of[v as usize]);
            if a != b {
                next[a].push(index(b));
                next[b].push(index(a));
            }
        }
        for next in &mut next {
            next.sort_unstable();
            next.dedup();
        }
        let normal = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| sheet.rest()[v as usize]);
            (b - a).cross(&(c - a)).normalize()
        };
        let normals: Vec<Vec3> = sheet.triangles().iter().map(normal).collect();
        let flat = clusters.iter().map(|cluster| {
            let mut all = cluster.triangles.iter().map(|t| normals[*t as usize]);
            let first = all.next()?;
            all.all(|normal| same(&normal, &first)).then_some(first)
        });
        let flat = flat.collect();
        let reached = vec![0; clusters.len()];
        let largest_radius = clusters.iter().map(|c| c.radius).fold(0.0, f64::max);
        Self {
            sheet,
            clusters,
            reach,
            largest_radius,
            next,
            normals,
            flat,
            concave,
            most_concave,
            reached,
        }
    }

    /// The patches of all clusters.
    pub(super) fn all(mut self) -> Vec<Patch> {
        let boxes: Vec<Bounds> =
            self.clusters.iter().map(|c| c.bounds(self.sheet.rest())).collect();
        let tree = BoxTree::new(&boxes);
        (0..self.clusters.len()).map(|k| self.patch(k, &boxes, &tree)).collect()
    }

    /// The patch around cluster `k`.
    fn patch(&mut self, k: usize, boxes: &[Bounds], tree: &BoxTree) -> Patch {
        let own = &self.clusters[k];
        let mut covers = Vec::new();
        let limit =
            |radius: f64| (COVERED_REACHES * self.reach + 2.0 * radius).min(COVERED_RADII * radius);
        let far = limit(self.largest_radius);
        let enter = |node: &Bounds| node.gap(&boxes[k]) <= far;
        tree.visit(enter, 0, |j| {
            let other = &self.clusters[j as usize];
            let apart = (own.centre - other.centre).norm();
            if apart <= limit(own.radius.max(other.radius))
                || boxes[k].intersects(&boxes[j as usize])
            {
                covers.push(j);
            }
        });
        let of = |j: &u32| {
            let other = &self.clusters[*j as usize];
            (own.centre - other.centre).norm() + other.radius
        };
        let radius = RADIUS_FACTOR * covers.iter().map(of).fold(0.0, f64::max);
        let (clusters, within) = self.around(k, radius);
        let in_ball = |v: &u32| {
            let apart = self.sheet.rest()[*v as usize] - own.centre;
            apart.norm_squared() <= radius * radius
        };
        let meets = |t: &u32| self.sheet.triangles()[*t as usize].iter().any(in_ball);
        let mut triangles = Vec::new();
        for k in &clusters {
            let other = &self.clusters[*k as usize];
            let whole = (other.centre - own.centre).norm() + other.radius <= radius;
            let all = other.triangles.iter().copied();
            triangles.extend(all.filter(|t| whole || meets(t)));
        }
        let Some(turn) = self.turn((&triangles, &clusters)).filter(|turn| *turn <= LARGEST_TURN)
        else {
            return Patch::default();
        };
        covers.retain(|j| within.binary_search(j).is_ok());
        covers.sort_unstable();
        Patch { triangles, clusters, covers, turn }
    }

    /// The clusters that meet the ball of this radius around cluster `k` and are connected to it by such, and those that are
    /// connected to it within the ball.
    fn around(&mut self, k: usize, radius: f64) -> (Vec<u32>, Vec<u32>) {
        let Self { clusters, next, reached, .. } = self;
        let (centre, mark) = (clusters[k].centre, k + 1);
        reached[k] = mark;
        let mut found = vec![index(k)];
        let mut extend = |found: &mut Vec<u32>, holds: &dyn Fn(&Cluster) -> bool| {
            let mut place = 0;
            while let Some(from) = found.get(place).copied() {
                place += 1;
                for to in &next[from as usize] {
                    let other = *to as usize;
                    if reached[other] != mark && holds(&clusters[other]) {
                        reached[other] = mark;
                        found.push(*to);
                    }
                }
            }
        };
        let distance = |other: &Cluster| (other.centre - centre).norm();
        extend(&mut found, &|other| distance(other) + other.radius <= radius);
        let mut within = found.clone();
        extend(&mut found, &|other| distance(other) - other.radius <= radius);
        found.retain(|k| !clusters[*k as usize].triangles.is_empty());
        found.sort_unstable();
        within.sort_unstable();
        (found, within)
    }

    /// β of a patch; nothing where its normals are in no cone.
    fn turn(&self, (triangles, clusters): (&[u32], &[u32])) -> Option<f64> {
        let turn = 2.0 * self.cone(triangles, clusters)? + self.concave(triangles, clusters);
        // What round-off makes of a flat patch with straight sides.
        Some(if turn < 1e-7 { 0.0 } else { turn })
    }

    /// The half-angle of a cone around the normals of a patch, radians, if there is one.
    fn cone(&self, triangles: &[u32], clusters: &[u32]) -> Option<f64> {
        let first = self.flat[*clusters.first()? as usize];
        let flat = |k: &u32| Some(same(&self.flat[*k as usize]?, &first?));
        if clusters.iter().all(|k| flat(k) == Some(true)) {
            return Some(0.0);
        }
        let normals = || triangles.iter().map(|t| self.normals[*t as usize]);
        let axis = normals().sum::<Vec3>().try_normalize(f64::EPSILON)?;
        let (mut upright, mut sine) = (true, 0.0f64);
        for normal in normals() {
            upright &= axis.dot(&normal) > 0.0;
            sine = sine.max(axis.cross(&normal).norm_squared());
        }
        upright.then(|| sine.sqrt().min(1.0).asin())
    }

    /// How much the boundary of a patch turns inwards, radians.
    fn concave(&self, triangles: &[u32], clusters: &[u32]) -> f64 {
        if clusters.iter().all(|k| self.most_concave[*k as usize] == 0.0) {
            return 0.0;
        }
        let of = |t: &u32| self.sheet.triangles()[*t as usize];
        let mut corners: Vec<u32> = triangles.iter().flat_map(of).collect();
        corners.sort_unstable();
        corners.dedup();
        corners.iter().map(|v| self.concave[*v as usize]).sum()
    }
}

/// Whether two normals are the same.
fn same(one: &Vec3, other: &Vec3) -> bool {
    (one - other).norm_squared() <= ROUND_OFF * ROUND_OFF
}

/// How much the boundary of a sheet turns inwards at every vertex, radians.
fn concave(sheet: &Sheet) -> Vec<f64> {
    let mut angle = vec![0.0; sheet.vertex_count()];
    for triangle in sheet.triangles() {
        let x = triangle.map(|v| sheet.rest()[v as usize]);
        for k in 0..3 {
            let [p, q] = [1, 2].map(|j| x[(k + j) % 3] - x[k]);
            angle[triangle[k] as usize] += p.angle(&q);
        }
    }
    let inwards = |(angle, rim): (&f64, &bool)| if *rim { (angle - PI).max(0.0) } else { 0.0 };
    angle.iter().zip(sheet.boundary()).map(inwards).collect()
}
