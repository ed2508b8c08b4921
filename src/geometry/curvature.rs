//! Curvature of a triangulated surface.
//!
//! With `L_i = Σ_{T∋i} n_T × e_T(i) = 2 ∂(area)/∂x_i` (the cotangent vector),
//!
//! ```text
//! |H_i| = |L_i| / (4 A_i)          mean curvature, 1/length
//! K_i   = (2π - Σ angles) / A_i    Gaussian curvature, 1/length²
//! ```
//!
//! `H_i > 0` where `L_i` points along the area-weighted vertex normal: with triangles
//! counter-clockwise seen from +z, a bump towards +z has H > 0 at its top. On the boundary both are 0.
//!
//! Reference: Meyer, Desbrun, Schröder & Barr (2003), doi:10.1007/978-3-662-05105-4_2.

use std::f64::consts::PI;

use super::{Face, Shape, VertexArea};
use rumple_numerics::Vec3;
use rumple_numerics::parallel;

/// Curvatures and areas at the vertices.
#[derive(Debug, Clone, Default)]
pub struct Curvature {
    /// Vertex areas `A_i`, length² (boundary vertices included).
    pub area: Vec<f64>,
    /// Signed mean curvature, 1/length.
    pub mean: Vec<f64>,
    /// Gaussian curvature, 1/length².
    pub gaussian: Vec<f64>,
}

impl Curvature {
    /// Evaluates all three at every vertex.
    #[must_use]
    pub fn evaluate(shape: &Shape<'_>, area: &VertexArea) -> Self {
        let mut all = vec![[0.0; 3]; shape.sheet.vertex_count()];
        parallel::fill(&mut all, |i| at_vertex(shape, area, i));
        Self {
            area: all.iter().map(|v| v[0]).collect(),
            mean: all.iter().map(|v| v[1]).collect(),
            gaussian: all.iter().map(|v| v[2]).collect(),
        }
    }
}

/// `[A_i, H_i, K_i]`.
fn at_vertex(shape: &Shape<'_>, rule: &VertexArea, i: usize) -> [f64; 3] {
    let mut area = 0.0;
    let mut l = Vec3::zeros();
    let mut normal = Vec3::zeros();
    let mut deficit = 2.0 * PI;
    for &(t, k) in shape.sheet.vertex_triangles().entries(i) {
        let (t, k) = (t as usize, k as usize);
        let face = shape.face(t);
        area += rule.corner_areas(shape, t)[k];
        l += face.normal.cross(&shape.edge_vectors(t)[k]);
        normal += face.area * face.normal;
        deficit -= angle_at(shape, t, k);
    }
    if shape.sheet.boundary()[i] {
        return [area, 0.0, 0.0];
    }
    let mean = (l.norm() / (4.0 * area)).copysign(l.dot(&normal));
    [area, mean, deficit / area]
}

/// Angle of triangle `t` at its corner `k`, radians; well conditioned for needles and caps.
#[must_use]
#[inline]
pub fn angle_at(shape: &Shape<'_>, t: usize, k: usize) -> f64 {
    angle(&shape.corners(t), k)
}

/// The same of a triangle with these corners; 0 where a side has no length.
#[must_use]
#[inline]
pub(super) fn angle(corners: &[Vec3; 3], k: usize) -> f64 {
    let [here, next, last] = [0, 1, 2].map(|j| corners[(k + j) % 3]);
    let (u, v) = (next - here, last - here);
    (2.0 * Face::from_corners(corners).area).atan2(u.dot(&v))
}
