//! Distance to the boundary at rest.
//!
//! ```text
//! d(X) = min_e |X - P_e(X)|        over the boundary edges e, P_e(X) the point of e nearest to X
//! ```
//!
//! It is straight, in space: exact within a flat sheet that is convex, and at most the distance along others.

use rumple_numerics::Vec3;
use rumple_numerics::parallel;

use crate::{Edge, Sheet};

/// Numbers of an edge: the coordinates of both ends.
const NUMBERS: usize = 6;

impl Sheet {
    /// The distance (length) at rest of every vertex, or of the centroid of every triangle, to the nearest boundary edge.
    ///
    /// # Errors
    /// A sheet without a boundary, and a part of which the whole boundary is not known.
    pub fn distances_to_boundary(&self, on_triangles: bool) -> Result<&[f64], &'static str> {
        if self.is_lone_part() {
            return Err("a lattice over ranks has no distance to the boundary");
        }
        let distances = self.stored_distances(on_triangles, || {
            // Images of edges of the boundary are as near; the rim of all images does not count.
            let periodic = !self.reduction().periods().is_empty();
            let here = |e: &&Edge| match periodic {
                true => e.vertices.iter().all(|v| self.boundary()[*v as usize]),
                false => self.counts(&e.vertices),
            };
            let ends = self.edges().iter().filter(|e| e.is_boundary()).filter(here);
            let ends = ends.flat_map(|e| e.vertices.map(|v| self.rest()[v as usize]));
            let all = self.reduction().gathered(ends.flat_map(<[f64; 3]>::from).collect());
            let point = |at: &[f64]| Vec3::new(at[0], at[1], at[2]);
            let edges: Vec<[Vec3; 2]> =
                all.chunks_exact(NUMBERS).map(|e| [point(e), point(&e[NUMBERS / 2..])]).collect();
            if edges.is_empty() {
                return Vec::new();
            }
            let points: Vec<Vec3> = match on_triangles {
                true => self.triangle_places(),
                false => self.places().to_vec(),
            };
            let mut distances = vec![0.0; points.len()];
            parallel::fill(&mut distances, |i| {
                let squares = edges.iter().map(|edge| squared_distance(points[i], edge));
                squares.fold(f64::INFINITY, f64::min).sqrt()
            });
            distances
        });
        match distances {
            [] => Err("the sheet is closed: it has no boundary"),
            distances => Ok(distances),
        }
    }
}

fn squared_distance(p: Vec3, [a, b]: &[Vec3; 2]) -> f64 {
    let along = b - a;
    let share = ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
    (p - a - along * share).norm_squared()
}
