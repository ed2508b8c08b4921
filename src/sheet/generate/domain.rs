//! What the random start and the relaxation need to know of a shape.

use rand_chacha::ChaCha8Rng;

use rumple_numerics::Vec3;
use rumple_numerics::num::index;

/// Smallest quality that a generated triangle may have; below it another random start is tried.
///
/// Relaxed meshes come out at 0.7-0.8, so this rejects accidents only.
pub(super) const MIN_QUALITY: f64 = 0.6;

/// A surface to be filled with vertices, in coordinates where distances are true.
///
/// The first vertices are fixed ones: those of the boundary, then others that the shape needs.
pub(super) trait Domain {
    /// Its size and boundary.
    fn frame(&self) -> &Frame;
    /// Least quality of a triangle.
    fn least_quality(&self) -> f64 {
        MIN_QUALITY
    }
    /// Whether a triangle with this centroid may have all its vertices on the boundary.
    fn may_span(&self, _centroid: Vec3) -> bool {
        false
    }
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
    /// After what lengths along x and y positions in space repeat themselves, infinite where they do not.
    fn period(&self) -> [f64; 2] {
        [f64::INFINITY; 2]
    }
}

/// Size and boundary of a domain.
pub(super) struct Frame {
    /// Vertices that do not move: first all of the boundary, then any others.
    pub(super) fixed: Vec<Vec3>,
    /// How many of these lie on the boundary.
    pub(super) boundary: usize,
    /// Edge length aimed at.
    pub(super) edge: f64,
    /// Of the finished mesh.
    pub(super) euler_characteristic: i64,
    /// Corners of a box around the domain.
    pub(super) bounds: [Vec3; 2],
}

impl Frame {
    /// That of a domain whose `fixed` vertices are those of its boundary.
    pub(super) fn new(
        fixed: Vec<Vec3>,
        edge: f64,
        euler_characteristic: i64,
        bounds: [Vec3; 2],
    ) -> Self {
        Self { boundary: fixed.len(), fixed, edge, euler_characteristic, bounds }
    }
}

/// Corners next to one another, of a triangle whose positions repeat themselves after `period`.
pub(super) fn unfolded(mut corners: [Vec3; 3], period: [f64; 2]) -> [Vec3; 3] {
    let first = corners[0];
    for corner in &mut corners[1..] {
        for axis in (0..2).filter(|axis| period[*axis].is_finite()) {
            corner[axis] += period[axis] * ((first[axis] - corner[axis]) / period[axis]).round();
        }
    }
    corners
}

/// Delaunay triangles of the (x, y) of points in the plane, counter-clockwise.
pub(super) fn delaunay(points: &[Vec3]) -> Vec<[u32; 3]> {
    let flat: Vec<_> = points.iter().map(|p| delaunator::Point { x: p.x, y: p.y }).collect();
    let found = delaunator::triangulate(&flat).triangles;
    // delaunator turns clockwise in a frame whose y axis points up.
    found.chunks_exact(3).map(|t| [t[0], t[2], t[1]].map(index)).collect()
}

/// Width of the copies around a periodic domain in edge lengths; a Delaunay circle of the random start is at most a few
/// edges wide.
const COPIED_WIDTH: f64 = 4.0;

/// Delaunay triangles of points in a plane that repeats itself after `periods` along x and y (infinite where it does
/// not), in which edges are about `edge` long.
///
/// Of the points with copies on all sides, the triangles whose smallest vertex is an original: every triangle of the
/// periodic mesh has exactly one such copy.
pub(super) fn periodic(points: &[Vec3], periods: [f64; 2], edge: f64) -> Vec<[u32; 3]> {
    let mut all = points.to_vec();
    let mut original: Vec<u32> = (0..index(points.len())).collect();
    let first = points.first().copied().unwrap_or_default();
    let low = points.iter().fold(first, |low, p| low.inf(p));
    for axis in [0, 1] {
        let period = periods[axis];
        if !period.is_finite() {
            continue;
        }
        let margin = (COPIED_WIDTH * edge).min(0.5 * period);
        // The domain is one period from the least coordinate on; copies along x are copied along y too.
        let end = low[axis] + period;
        for v in 0..all.len() {
            let p = all[v];
            let shift = if p[axis] < low[axis] + margin {
                period
            } else if p[axis] > end - margin {
                -period
            } else {
                continue;
            };
            let mut copy = p;
            copy[axis] += shift;
            all.push(copy);
            original.push(original[v]);
        }
    }
    delaunay(&all)
        .into_iter()
        .filter(|t| {
            let smallest = t.iter().min_by_key(|&&v| original[v as usize]);
            smallest.is_some_and(|&v| (v as usize) < points.len())
        })
        .map(|t| t.map(|v| original[v as usize]))
        .collect()
}
