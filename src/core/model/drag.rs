//! Drag: what resists the motion of a vertex.
//!
//! ```text
//! γ_i dx_i/dt = -∂U/∂x_i,     γ_i = g s_i (1 + (r - 1) n nᵀ)
//! ```
//!
//! g is the drag of the scene, s_i is 1 (`per-vertex`, the paper's) or the vertex's share of the rest area
//! (`per-area`, the same for every mesh), n the normal of the sheet and r the ratio of the drag along
//! it to that in the plane. Rigid boundaries and surrounding fluids resist both, a substrate that the
//! sheet slides on only the second.

use crate::Vec3;
use crate::effects::FieldValues;
use crate::geometry::{lumped_areas, vertex_normals};
use crate::reduction::Reduction;
use crate::sheet::Sheet;

/// Drag of every vertex, force per velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct Drag {
    /// In the plane of the sheet.
    tangential: FieldValues,
    /// Of the drag along the normal to that in the plane.
    ratio: f64,
}

impl Drag {
    /// Of every vertex.
    #[must_use]
    pub fn per_vertex(value: impl Into<FieldValues>) -> Self {
        Self { tangential: value.into(), ratio: 1.0 }
    }

    /// `value` times the area that every vertex has at rest, a third of its triangles'.
    #[must_use]
    pub fn per_area(value: impl Into<FieldValues>, sheet: &Sheet) -> Self {
        let value = value.into();
        let areas = lumped_areas(sheet);
        let all = areas.iter().enumerate().map(|(i, area)| value.at(i) * area).collect();
        Self { tangential: FieldValues::Each(all), ratio: 1.0 }
    }

    /// The same with `ratio` times as much along the normal of the sheet.
    #[must_use]
    pub fn with_ratio(self, ratio: f64) -> Self {
        Self { ratio, ..self }
    }

    /// Whether it is the same in all directions.
    #[must_use]
    pub(crate) fn is_isotropic(&self) -> bool {
        self.ratio == 1.0
    }

    /// That of vertex `i` in the plane of the sheet.
    #[must_use]
    pub fn tangential(&self, i: usize) -> f64 {
        self.tangential.at(i)
    }

    /// Mean over the vertices of `sheet` of the drag in its plane.
    #[must_use]
    pub fn mean(&self, sheet: &Sheet) -> f64 {
        let (reduction, vertices) = (sheet.reduction(), sheet.vertex_count());
        reduction.sum(vertices, |i| self.tangential(i)) / reduction.count(vertices).max(1.0)
    }

    /// The same along the normal.
    #[must_use]
    pub fn mean_normal(&self, sheet: &Sheet) -> f64 {
        self.ratio * self.mean(sheet)
    }

    /// The matrices `factor · γ_i` at the shape `x`.
    #[must_use]
    pub fn weights(&self, sheet: &Sheet, x: &[Vec3], factor: f64) -> Weights {
        let scalar = (0..x.len()).map(|i| factor * self.tangential(i)).collect();
        let normals = (!self.is_isotropic()).then(|| vertex_normals(sheet, x));
        Weights { scalar, more: self.ratio - 1.0, normals }
    }
}

/// A symmetric, positive 3 × 3 matrix for every vertex: `w_i (1 + m n nᵀ)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights {
    scalar: Vec<f64>,
    more: f64,
    normals: Option<Vec<Vec3>>,
}

impl Weights {
    /// `W_i v`.
    #[must_use]
    pub fn apply(&self, i: usize, v: Vec3) -> Vec3 {
        let along = self.normals.as_ref().map_or_else(Vec3::zeros, |normals| {
            let n = normals[i];
            self.more * n.dot(&v) * n
        });
        self.scalar[i] * (v + along)
    }

    /// The least w_i of all directions and all vertices.
    #[must_use]
    pub fn least(&self, reduction: &Reduction) -> f64 {
        let least = reduction.min(self.scalar.len(), |i| self.scalar[i]);
        least * (1.0 + self.more).min(1.0)
    }

    /// `W_i` as a matrix.
    #[must_use]
    pub fn block(&self, i: usize) -> nalgebra::Matrix3<f64> {
        let identity = nalgebra::Matrix3::identity();
        let along = self.normals.as_ref().map_or_else(nalgebra::Matrix3::zeros, |normals| {
            self.more * normals[i] * normals[i].transpose()
        });
        self.scalar[i] * (identity + along)
    }
}
