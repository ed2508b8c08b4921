//! What the random start and the relaxation need to know of a shape.

use rand_chacha::ChaCha8Rng;

use rumple_numerics::Vec3;

/// A surface to be filled with vertices, in coordinates where distances are true.
///
/// The first vertices are fixed ones: those of the boundary, then others that the shape needs.
pub(super) trait Domain {
    /// Vertices that do not move: first all of the boundary, then any others.
    fn fixed(&self) -> &[Vec3];
    /// How many of the fixed vertices lie on the boundary.
    fn fixed_boundary(&self) -> usize {
        self.fixed().len()
    }
    /// Edge length aimed at.
    fn edge(&self) -> f64;
    /// χ of the finished mesh.
    fn euler_characteristic(&self) -> i64;
    /// Corners of a box around the domain.
    fn bounds(&self) -> [Vec3; 2];
    /// A random point, uniform in area; `None` where a free vertex may not start.
    fn sample(&self, rng: &mut ChaCha8Rng) -> Option<Vec3>;
    /// Copies of `point` that matter to its neighbours besides itself (periodic domains).
    fn image(&self, _point: Vec3) -> Option<Vec3> {
        None
    }
    /// The copy of `point` nearest to `to`.
    fn nearest(&self, point: Vec3, _to: Vec3) -> Vec3 {
        point
    }
    /// The allowed place nearest to `point` for a free vertex.
    fn constrain(&self, point: Vec3) -> Vec3;
    /// The Delaunay triangles of the points, positively oriented.
    fn triangles(&self, points: &[Vec3]) -> Vec<[u32; 3]>;
    /// The position in space.
    fn place(&self, point: Vec3) -> Vec3 {
        point
    }
}

/// Delaunay triangles of the (x, y) of points in the plane, counter-clockwise.
pub(super) fn delaunay(points: &[Vec3]) -> Vec<[u32; 3]> {
    let flat: Vec<_> = points.iter().map(|p| delaunator::Point { x: p.x, y: p.y }).collect();
    let found = delaunator::triangulate(&flat).triangles;
    // delaunator turns clockwise in a frame whose y axis points up.
    found.chunks_exact(3).map(|t| [t[0], t[2], t[1]].map(rumple_numerics::num::index)).collect()
}
