//! Normals, areas, angles and curvatures of a shape, and the rest metric it is compared with.
//!
//! Everything here is kinematics: it knows positions and lengths, no energy and no field.

mod align;
mod average;
mod boundary;
mod box_tree;
mod crossings;
mod curvature;
mod faces;
mod measure;
pub mod proximity;
mod rest_metric;
mod vertex_area;

pub use align::{aligned, aligned_by};
pub use average::FaceVertexAverage;
pub use boundary::BoundaryFit;
pub use crossings::{CrossingPairs, Crossings};
pub use curvature::{Curvature, angle_at};
pub use faces::{Face, Faces, face_areas, vertex_normals};
pub use measure::{area, volume};
pub use rest_metric::RestMetric;
pub use vertex_area::{AreaRule, VertexArea, lumped_areas, sum_at_corners};

use rumple_numerics::Vec3;
use rumple_sheet::Sheet;

/// What energies depend on besides positions.
#[derive(Clone, Copy)]
pub struct Conditions<'a> {
    /// Topology and rest positions.
    pub sheet: &'a Sheet,
    /// Optimal lengths and areas.
    pub metric: &'a RestMetric,
    /// Time.
    pub time: f64,
    /// Internal variables, and what laws give, by name; none without an effect that owns some or a law that gives it.
    pub internal: &'a [(&'static str, Vec<f64>)],
    /// Species at the vertices by their numbers; an empty list for one that no energy reads.
    pub species: &'a [Vec<f64>],
}

impl<'a> Conditions<'a> {
    /// The values of the internal variables, or of what laws give, of this name.
    #[must_use]
    pub fn internal(&self, name: &str) -> Option<&'a [f64]> {
        self.internal.iter().find(|(known, _)| *known == name).map(|(_, values)| values.as_slice())
    }

    /// The values of a species at the vertices, of those that an energy says it reads; zeros before there is a state.
    #[must_use]
    pub fn species(&self, number: usize) -> &'a [f64] {
        self.species.get(number).map_or(&[], Vec::as_slice)
    }
}

/// A shape of a sheet, as the effects see it.
#[derive(Clone, Copy)]
pub struct Shape<'a> {
    /// Topology and rest positions.
    pub sheet: &'a Sheet,
    /// Optimal lengths and areas.
    pub metric: &'a RestMetric,
    /// Time.
    pub time: f64,
    /// Current positions `x_i`.
    pub x: &'a [Vec3],
}

impl Shape<'_> {
    /// Corners of triangle `t`.
    #[must_use]
    #[inline]
    pub fn corners(&self, t: usize) -> [Vec3; 3] {
        self.sheet.triangles()[t].map(|v| self.x[v as usize])
    }

    /// Normal and area of triangle `t`.
    #[must_use]
    #[inline]
    pub fn face(&self, t: usize) -> Face {
        Face::from_corners(&self.corners(t))
    }

    /// Edge vectors of triangle `t`, `e_k` opposite corner `k`, oriented with the triangle.
    #[must_use]
    #[inline]
    pub fn edge_vectors(&self, t: usize) -> [Vec3; 3] {
        let [a, b, c] = self.corners(t);
        [c - b, a - c, b - a]
    }
}
