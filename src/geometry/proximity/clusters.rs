//! Clusters of neighbouring vertices with their edges and triangles.
//!
//! Made once, at rest. Vertices are split along the longest extent at the median until a cluster is small, and each such part
//! where edges do not connect it; each feature belongs to the cluster of its first corner.

use rumple_numerics::Vec3;
use rumple_numerics::num::{index, real};
use rumple_sheet::Sheet;

use super::patches::{Cluster, Patches};
use crate::box_tree::Bounds;

/// Vertices of a cluster, unless the reach asks for larger ones.
const CLUSTER_VERTICES: usize = 8;
/// Extent of a cluster up to which it may have more, in units of the reach.
const CLUSTER_EXTENT: f64 = 1.0;

/// The clusters of `sheet`, for features that reach as far as `reach`.
pub(super) fn clusters(sheet: &Sheet, reach: f64) -> Vec<Cluster> {
    let mut vertices: Vec<u32> = (0..index(sheet.vertex_count())).collect();
    let (mut part, mut parts) = (vec![0; vertices.len()], 0);
    split(&mut vertices, sheet.rest(), CLUSTER_EXTENT * reach, &mut |vertices| {
        vertices.iter().for_each(|v| part[*v as usize] = parts);
        parts += 1;
    });
    let mut all: Vec<Cluster> = Vec::new();
    let mut of = vec![0; sheet.vertex_count()];
    for vertices in connected(sheet, &part) {
        vertices.iter().for_each(|v| of[*v as usize] = all.len());
        all.push(Cluster { vertices, ..Cluster::default() });
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
        let apart = |x: &Vec3| (x - cluster.centre).norm();
        cluster.radius = places().map(|x| apart(&x)).fold(0.0, f64::max);
        let apart = |v: &u32| apart(&sheet.rest()[*v as usize]);
        let order = |a: &&u32, b: &&u32| apart(a).total_cmp(&apart(b));
        cluster.middle = cluster.corners.iter().min_by(order).copied().unwrap_or(0);
    }
    let patches = Patches::new(sheet, (&all, &of), reach).all();
    all.iter_mut().zip(patches).for_each(|(cluster, patch)| cluster.patch = patch);
    all
}

/// The connected components of every part of the sheet, of which `part` tells the number by vertex.
fn connected(sheet: &Sheet, part: &[u32]) -> Vec<Vec<u32>> {
    let mut seen = vec![false; part.len()];
    let mut all = Vec::new();
    for first in 0..index(part.len()) {
        if std::mem::replace(&mut seen[first as usize], true) {
            continue;
        }
        let (mut found, mut next) = (vec![first], 0);
        while let Some(v) = found.get(next).copied() {
            next += 1;
            for (_, other) in sheet.vertex_edges().entries(v as usize) {
                let same = part[*other as usize] == part[v as usize];
                if same && !std::mem::replace(&mut seen[*other as usize], true) {
                    found.push(*other);
                }
            }
        }
        found.sort_unstable();
        all.push(found);
    }
    all
}

/// Splits `vertices` at the median of their longest extent until they are few, or within `extent`.
fn split(vertices: &mut [u32], rest: &[Vec3], extent: f64, take: &mut dyn FnMut(&[u32])) {
    let size = Bounds::enclosing(vertices.iter().map(|v| rest[*v as usize])).size();
    if vertices.len() <= CLUSTER_VERTICES || size.max() <= extent {
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
