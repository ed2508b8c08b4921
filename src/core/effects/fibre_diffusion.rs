//! What diffusion along fibres adds to the weights of the cotangent scheme.
//!
//! ```text
//! ∂c/∂t = … + ∇·(D ∇c),   D = D_∥ a⊗a + D_⊥ b⊗b,   a = F a⁰/λ,   λ = |F a⁰|
//! ```
//!
//! with the fibre a⁰ in the sheet at rest, carried by its deformation F, and b across it. With the derivatives `α_k = a⁰·∂φ_k` of the
//! shape functions along the fibre at rest, the flow between the corners i and j of a triangle, opposite corner k, is
//!
//! ```text
//! ½ w_k (c_j - c_i),   w_k = D_⊥ cot θ_k - 2A (D_∥ - D_⊥) α_i α_j/λ²
//! ∂w_k/∂x_m = D_⊥ ∂cot θ_k/∂x_m - 2 (D_∥ - D_⊥) α_i α_j/λ² (∂A/∂x_m - 2A α_m F a⁰/λ²)
//! ```
//!
//! the stiffness of linear elements, so that totals are conserved. Weights may be negative where D_∥ and D_⊥ differ: c ≥ 0 is then not kept
//! on every mesh.

use super::FieldValues;
use super::fibre::shape_slopes;
use crate::Vec3;
use crate::sheet::Sheet;

/// Fibres with what D along them exceeds D across by.
#[derive(Debug)]
pub struct AnisotropicDiffusivity {
    triangles: Vec<Fibre>,
}

#[derive(Debug, Clone, Copy)]
struct Fibre {
    /// D_∥ - D_⊥.
    excess: f64,
    /// α.
    slope: [f64; 3],
}

impl AnisotropicDiffusivity {
    /// On `sheet`, with the unit vectors `fibres` in its triangles at rest.
    pub(super) fn new(
        sheet: &Sheet,
        fibres: &[Vec3],
        along: &FieldValues,
        across: &FieldValues,
    ) -> Self {
        let of = |(t, fibre): (usize, &Vec3)| Fibre {
            excess: along.at(t) - across.at(t),
            slope: shape_slopes(sheet, t, fibre),
        };
        Self { triangles: fibres.iter().enumerate().map(of).collect() }
    }

    /// D_∥ - D_⊥ of triangle `t`.
    pub(super) fn excess(&self, t: usize) -> f64 {
        self.triangles[t].excess
    }

    /// What is added to w of triangle `t`, whose corners are at `x`, of the area `double_area`/2.
    pub(super) fn weights(&self, t: usize, x: &[Vec3; 3], double_area: f64) -> [f64; 3] {
        let Fibre { excess, slope } = self.triangles[t];
        let square = stretched(&slope, x).norm_squared();
        [0, 1, 2].map(|k| -double_area * excess * slope[(k + 1) % 3] * slope[(k + 2) % 3] / square)
    }

    /// The derivatives by the corners of what is added to w_k; `area_slopes` are those of the area.
    pub(super) fn slopes(
        &self,
        t: usize,
        x: &[Vec3; 3],
        (double_area, area_slopes): (f64, &[Vec3; 3]),
        k: usize,
    ) -> [Vec3; 3] {
        let Fibre { excess, slope } = self.triangles[t];
        let along = stretched(&slope, x);
        let square = along.norm_squared();
        let factor = -2.0 * excess * slope[(k + 1) % 3] * slope[(k + 2) % 3] / square;
        [0, 1, 2].map(|m| factor * (area_slopes[m] - (double_area * slope[m] / square) * along))
    }
}

/// F a⁰.
fn stretched(slope: &[f64; 3], x: &[Vec3; 3]) -> Vec3 {
    slope[0] * x[0] + slope[1] * x[1] + slope[2] * x[2]
}
