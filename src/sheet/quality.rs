//! How good the triangles of a sheet are.
//!
//! ```text
//! q = 4√3 A / (l₁² + l₂² + l₃²)       1 for an equilateral triangle, 0 for a collapsed one
//! ```
//!
//! (A: area, l: edge lengths; P. L. George and H. Borouchaki, Delaunay Triangulation and Meshing,
//! 1998.) q is free of units; lengths and areas are in the units of the positions.

use std::fmt;

use serde::Serialize;

use super::Sheet;
use rumple_numerics::Vec3;
use rumple_numerics::num::real;

/// Quality below which a triangle counts as one without area; rounding alone leaves about 1e-16.
pub(crate) const ZERO_QUALITY: f64 = 1e-12;

/// Quality q of a triangle, from 0 (collapsed) to 1 (equilateral); NaN for non-finite corners and
/// for three corners in one point.
#[must_use]
pub fn triangle_quality(corners: [Vec3; 3]) -> f64 {
    let [a, b, c] = corners;
    let (u, v, w) = (b - a, c - b, a - c);
    2.0 * 3f64.sqrt() * u.cross(&v).norm()
        / (u.norm_squared() + v.norm_squared() + w.norm_squared())
}

/// Interior angles at the three corners, in radians.
#[must_use]
pub fn triangle_angles(corners: [Vec3; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| {
        let (u, v) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
        // atan2 keeps full accuracy at all angles, unlike acos.
        u.cross(&v).norm().atan2(u.dot(&v))
    })
}

/// Smallest, mean and largest of something.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Smallest value.
    pub min: f64,
    /// Arithmetic mean.
    pub mean: f64,
    /// Largest value.
    pub max: f64,
}

impl Spread {
    /// The spread of some values; all NaN when there are none.
    fn new(values: impl Iterator<Item = f64>) -> Self {
        let (mut min, mut max, mut sum, mut count) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0);
        for v in values {
            min = min.min(v);
            max = max.max(v);
            sum += v;
            count += 1;
        }
        if count == 0 {
            return Self { min: f64::NAN, mean: f64::NAN, max: f64::NAN };
        }
        Self { min, mean: sum / real(count), max }
    }
}

/// Sizes and quality of a sheet at rest; [`fmt::Display`] prints it for people.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeshReport {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of triangles.
    pub triangles: usize,
    /// Number of edges (bonds).
    pub edges: usize,
    /// Number of vertices on the boundary.
    pub boundary_vertices: usize,
    /// Vertices off the boundary that have other than six neighbours.
    pub irregular_vertices: usize,
    /// χ = vertices - edges + triangles: 1 for a disc, 0 for a ring or tube, 2 for a sphere.
    pub euler_characteristic: i64,
    /// Total area (length²).
    pub area: f64,
    /// Quality q of the triangles.
    pub quality: Spread,
    /// Edge lengths.
    pub edge_length: Spread,
    /// Smallest interior angle, in degrees.
    pub min_angle: f64,
    /// Number of triangles with an angle above 90°.
    pub obtuse_triangles: usize,
    /// Number of triangles whose three vertices all lie on the boundary (they flap at no cost).
    pub all_boundary_triangles: usize,
    /// Mean |i - j| over the edges (i, j): small when neighbours are near in memory.
    pub mean_index_distance: f64,
}

impl MeshReport {
    /// Measures the rest state of a sheet; of a periodic one without images.
    #[must_use]
    pub fn new(sheet: &Sheet) -> Self {
        let x = sheet.rest();
        let owned = |count| sheet.reduction().owned(count);
        let triangles = &sheet.triangles()[..owned(sheet.triangle_count())];
        let corners = || triangles.iter().map(|t| t.map(|v| x[v as usize]));
        let angles = || corners().map(triangle_angles);
        let boundary = &sheet.boundary()[..owned(x.len())];
        let ends = || sheet.edges().iter().map(|e| e.vertices).filter(|e| sheet.counts(e));
        Self {
            vertices: boundary.len(),
            triangles: triangles.len(),
            edges: ends().count(),
            boundary_vertices: boundary.iter().filter(|&&r| r).count(),
            irregular_vertices: (0..boundary.len())
                .filter(|&v| !boundary[v] && sheet.vertex_edges().entries(v).len() != 6)
                .count(),
            euler_characteristic: sheet.euler_characteristic(),
            area: corners().map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm()).sum(),
            quality: Spread::new(corners().map(triangle_quality)),
            edge_length: Spread::new(ends().map(|[a, b]| (x[a as usize] - x[b as usize]).norm())),
            min_angle: angles().flatten().fold(f64::NAN, f64::min).to_degrees(),
            obtuse_triangles: angles()
                .filter(|a| a.iter().any(|&angle| angle > std::f64::consts::FRAC_PI_2))
                .count(),
            all_boundary_triangles: triangles
                .iter()
                .filter(|t| t.iter().all(|&v| sheet.boundary()[v as usize]))
                .count(),
            mean_index_distance: Spread::new(ends().map(|[a, b]| f64::from(b - a))).mean,
        }
    }
}

impl fmt::Display for MeshReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { quality: q, edge_length: l, .. } = self;
        writeln!(
            f,
            "vertices         {} ({} on the boundary, {} interior of valence other than 6)",
            self.vertices, self.boundary_vertices, self.irregular_vertices
        )?;
        writeln!(
            f,
            "triangles        {} ({} obtuse, {} with all vertices on the boundary)",
            self.triangles, self.obtuse_triangles, self.all_boundary_triangles
        )?;
        writeln!(
            f,
            "edges            {} (mean index distance {:.0})",
            self.edges, self.mean_index_distance
        )?;
        writeln!(f, "Euler number     {}", self.euler_characteristic)?;
        writeln!(f, "area             {:.6e}", self.area)?;
        writeln!(f, "quality          min {:.3}, mean {:.4}", q.min, q.mean)?;
        writeln!(f, "smallest angle   {:.1}°", self.min_angle)?;
        write!(f, "edge length      min {:.4e}, mean {:.4e}, max {:.4e}", l.min, l.mean, l.max)
    }
}
