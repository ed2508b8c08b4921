//! Bending energy of the cotangent mean curvature.
//!
//! ```text
//! U_b = (B/2) Σ_{interior i} W_i [ (2H_i)² - 2(1-ν) K_i ]       B = E h³/(12(1-ν²))
//! 2|H_i| = |L_i|/(2A_i),  L_i = Σ_{T∋i} n_T × e_T(i),  K_i = (2π - Σθ)/A_i
//! ```
//!
//! with `W_i = A_i` (default; an integral over the sheet) or 1 (`weight = "paper"`, as printed: a
//! sum of densities). So `U_b = Σ_i B|L_i|²/(8 A_i^p) + Gaussian part`, p = 1 or 2.
//!
//! With `W = A` the Gaussian part is, by Gauss-Bonnet, a boundary term that only the triangles at
//! the rim feel: `-B(1-ν) Σ_interior (2π - Σθ) = -B(1-ν) [2πχ - Σ_rim (π - Σθ)]`.
//!
//! **Gradient.** Let `g_i = ∂U/∂L_i`, `a_i = ∂U/∂A_i`, `s_i = ∂U/∂(Σθ)_i`. One triangle contributes
//! `n·V` with `V = Σ_k e_k × g_k`, and because `∂n·V = (P V)·∂N/(2A) + n·∂V`,
//!
//! ```text
//! ∂U/∂x_k = Q × e_k + (g_{k+1} - g_{k+2}) × n,   Q = (V - n(n·V))/(2A) + ½ a_T n
//! ```
//!
//! (`a_T = Σ_k a_k ω_{T,k}`) plus the angle terms `∂θ_k/∂x_{k+1} = -n × u/|u|²` with
//! `u = x_{k+1} - x_k`, and so on round the corner. No cotangent is needed, so right angles and
//! obtuse triangles are nothing special.
//!
//! Rim vertices carry no bending energy. Source: Zakharov & Dasbiswas (2021), eq. for U_b; Meyer
//! et al. (2003), doi:10.1007/978-3-662-05105-4_2. Not covered: spontaneous curvature.

mod hessian;

use std::f64::consts::PI;

use super::BendingWeight;
use crate::Vec3;
use crate::effects::{Energy, HessianPart, Material};
use crate::geometry::{AreaRule, RestMetric, Shape, VertexArea, angle_at};
use crate::num::real;
use crate::parallel;
use crate::sheet::Sheet;
use crate::solve::linear::BlockMatrix;

/// The derivatives of the energy by what a vertex gathers from its triangles.
#[derive(Debug, Clone, Copy, Default)]
struct VertexDerivatives {
    /// `∂U/∂L_i`.
    by_vector: Vec3,
    /// `∂U/∂A_i`.
    by_area: f64,
    /// `∂U/∂(Σθ)_i`.
    by_angle: f64,
}

/// Meyer bending of one sheet.
#[derive(Debug)]
pub struct MeyerBending {
    rigidity: f64,
    /// `B(1-ν)`.
    gaussian: f64,
    weight: BendingWeight,
    area: VertexArea,
    vertex: Vec<VertexDerivatives>,
    corner: Vec<[Vec3; 3]>,
}

impl MeyerBending {
    /// For `sheet` of the given material.
    #[must_use]
    pub fn new(sheet: &Sheet, material: &Material, weight: BendingWeight, area: AreaRule) -> Self {
        let rigidity = material.bending_rigidity();
        Self {
            rigidity,
            gaussian: rigidity * (1.0 - material.poisson),
            weight,
            area: VertexArea::new(sheet, area),
            vertex: vec![VertexDerivatives::default(); sheet.vertex_count()],
            corner: vec![[Vec3::zeros(); 3]; sheet.triangle_count()],
        }
    }

    /// Energy of vertex `i` and its derivatives.
    fn at_vertex(&self, shape: &Shape<'_>, i: usize) -> (VertexDerivatives, f64) {
        let rim = shape.sheet.rim()[i];
        let angles_count = rim || self.weight == BendingWeight::Paper;
        let (mut l, mut area, mut angles) = (Vec3::zeros(), 0.0, 0.0);
        for &(t, k) in shape.sheet.vertex_triangles().of(i) {
            let (t, k) = (t as usize, k as usize);
            l += shape.faces.all()[t].normal.cross(&shape.edge_vectors(t)[k]);
            area += self.area.corners(shape, t)[k];
            if angles_count {
                angles += angle_at(shape, t, k);
            }
        }
        match (self.weight, rim) {
            (BendingWeight::Area, true) => (
                VertexDerivatives { by_angle: -self.gaussian, ..Default::default() },
                self.gaussian * (PI - angles),
            ),
            (BendingWeight::Paper, true) => Default::default(),
            (BendingWeight::Area, false) => {
                let density = self.rigidity * l.norm_squared() / (8.0 * area);
                (
                    VertexDerivatives {
                        by_vector: (0.25 * self.rigidity / area) * l,
                        by_area: -density / area,
                        by_angle: 0.0,
                    },
                    density,
                )
            }
            (BendingWeight::Paper, false) => {
                let mean = self.rigidity * l.norm_squared() / (8.0 * area * area);
                let gaussian = -self.gaussian * (2.0 * PI - angles) / area;
                (
                    VertexDerivatives {
                        by_vector: (0.25 * self.rigidity / (area * area)) * l,
                        by_area: -(2.0 * mean + gaussian) / area,
                        by_angle: self.gaussian / area,
                    },
                    mean + gaussian,
                )
            }
        }
    }

    /// `∂U/∂x` of the three corners through triangle `t`.
    fn at_triangle(&self, shape: &Shape<'_>, t: usize) -> [Vec3; 3] {
        let d = shape.sheet.triangles()[t].map(|v| self.vertex[v as usize]);
        let face = shape.faces.all()[t];
        let (n, e) = (face.normal, shape.edge_vectors(t));
        let v =
            e[0].cross(&d[0].by_vector) + e[1].cross(&d[1].by_vector) + e[2].cross(&d[2].by_vector);
        let by_area = d.map(|d| d.by_area);
        let frozen = self.area.rule() != AreaRule::MixedVoronoi;
        let a = if frozen { 0.5 * self.area.area_factor(t, by_area) } else { 0.0 };
        let q = (v - n.dot(&v) * n) / (2.0 * face.area) + a * n;
        let mut gradient: [Vec3; 3] = std::array::from_fn(|k| {
            q.cross(&e[k]) + (d[(k + 1) % 3].by_vector - d[(k + 2) % 3].by_vector).cross(&n)
        });
        if !frozen {
            self.area.add_gradient(shape, t, by_area, &mut gradient);
        }
        for k in 0..3 {
            if d[k].by_angle != 0.0 {
                hessian::angle_gradient(&e, &n, k, d[k].by_angle, &mut gradient);
            }
        }
        gradient
    }
}

impl Energy for MeyerBending {
    fn name(&self) -> &'static str {
        "bending"
    }

    fn set_rest_metric(&mut self, _: &Sheet, _: &RestMetric) {}

    fn evaluate(&mut self, shape: &Shape<'_>, gradient: Option<&mut [Vec3]>) -> f64 {
        let mut vertex = std::mem::take(&mut self.vertex);
        let mut energy = parallel::fill_and_sum(&mut vertex, |i| self.at_vertex(shape, i));
        self.vertex = vertex;
        if self.weight == BendingWeight::Area {
            let euler = shape.sheet.euler_characteristic();
            let turns = real(usize::try_from(euler.abs()).unwrap_or(0)).copysign(if euler < 0 {
                -1.0
            } else {
                1.0
            });
            energy -= self.gaussian * 2.0 * PI * turns;
        }
        if let Some(gradient) = gradient {
            let mut corner = std::mem::take(&mut self.corner);
            parallel::fill(&mut corner, |t| self.at_triangle(shape, t));
            self.corner = corner;
            let (corner, incident) = (&self.corner, shape.sheet.vertex_triangles());
            parallel::update(gradient, |i, g| {
                for &(t, k) in incident.of(i) {
                    *g += corner[t as usize][k as usize];
                }
            });
        }
        energy
    }

    fn add_hessian(&mut self, shape: &Shape<'_>, part: HessianPart, into: &mut BlockMatrix) {
        if part == HessianPart::Full {
            let mut vertex = std::mem::take(&mut self.vertex);
            parallel::fill(&mut vertex, |i| self.at_vertex(shape, i).0);
            self.vertex = vertex;
        }
        hessian::add(self, shape, part, into);
    }
}
