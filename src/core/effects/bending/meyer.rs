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
//! the boundary feel: `-B(1-ν) Σ_interior (2π - Σθ) = -B(1-ν) [2πχ - Σ_boundary (π - Σθ)]`.
//!
//! Where B or B(1-ν) differs from triangle to triangle, a vertex has the mean over its triangles, weighted by rest areas. The Gaussian
//! part is then summed over the interior vertices.
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
//! Boundary vertices carry no bending energy. Source: Zakharov & Dasbiswas (2021), eq. for U_b; Meyer
//! et al. (2003), doi:10.1007/978-3-662-05105-4_2. Rest shapes that are not flat and spontaneous curvature are in
//! the file `curved.rs`.

mod curved;
mod hessian;
mod kernels;
mod parts;
mod weight;

pub use parts::{MeyerBending, MeyerWork};
pub use weight::BendingWeight;

use std::f64::consts::PI;

use super::RestShape;
use crate::effects::material::at_vertices;
use crate::effects::{
    Coupling, Energy, FieldValues, HessianPart, MaterialField, ParameterField, Reads,
};
use crate::geometry::{AreaRule, Conditions, Shape, VertexArea, angle_at};
use crate::linear::BlockMatrix;
use crate::num::real;
use crate::parallel::element_blocks::F64x4;
use crate::sheet::Sheet;
use crate::{Vec3, parallel};
use kernels::{Gradient, VertexSums};
use parts::{At, CurvedAt, CurvedRest, VertexDerivatives};

impl MeyerBending {
    /// For `sheet` of the given material.
    #[must_use]
    pub fn new(
        sheet: &Sheet,
        material: impl Into<MaterialField>,
        weight: BendingWeight,
        area: AreaRule,
    ) -> Self {
        let material = material.into();
        let rigidity = at_vertices(&material.bending_rigidity(), sheet);
        let gaussian = match material.poisson {
            FieldValues::Same(poisson) => rigidity.map(|rigidity| rigidity * (1.0 - poisson)),
            FieldValues::Each(_) => at_vertices(
                &material.per_triangle(|m| m.bending_rigidity() * (1.0 - m.poisson)),
                sheet,
            ),
        };
        Self {
            gaussian,
            rigidity,
            weight,
            area: VertexArea::new(sheet, area),
            has_boundary: sheet.boundary().contains(&true),
            curved: None,
        }
    }

    /// The same with the rest shape `rest`, weighted by areas.
    #[must_use]
    pub fn with_rest(
        sheet: &Sheet,
        material: impl Into<MaterialField>,
        area: AreaRule,
        rest: &RestShape,
    ) -> Self {
        let material = material.into();
        let curved = CurvedRest::new(&material, sheet, rest);
        let flat = Self::new(sheet, material, BendingWeight::Area, area);
        Self { curved: Some(Box::new(curved)), ..flat }
    }

    /// Whether every interior vertex has a derivative by its angles: with one B the Gaussian part is a boundary term.
    fn has_angle_terms(&self) -> bool {
        self.weight == BendingWeight::Paper || !self.gaussian.is_uniform()
    }

    /// Fills [`MeyerWork::gathered`] at the shape.
    fn gather(&self, shape: &Shape<'_>, gathered: &mut Vec<[f64; 5]>) {
        gathered.resize(shape.x.len(), [0.0; 5]);
        let blocks = shape.sheet.triangle_blocks();
        let kernel = VertexSums { bending: self, shape: *shape };
        if self.has_angle_terms() {
            let write =
                |place: &mut [f64; 5],
                 [F64x4([x, y, z, area]), F64x4([angles, ..])]: &[F64x4; 2]| {
                    *place = [*x, *y, *z, *area, *angles];
                };
            blocks.accumulate::<2, _>(&kernel, gathered, write);
        } else {
            let write = |place: &mut [f64; 5], [F64x4([x, y, z, area])]: &[F64x4; 1]| {
                *place = [*x, *y, *z, *area, 0.0];
            };
            blocks.accumulate::<1, _>(&kernel, gathered, write);
        }
    }

    /// `B(1-ν) 2πχ`; 0 where B varies.
    fn topological_energy(&self, sheet: &Sheet) -> f64 {
        let FieldValues::Same(gaussian) = self.gaussian else { return 0.0 };
        let euler = sheet.euler_characteristic();
        let sign = if euler < 0 { -1.0 } else { 1.0 };
        let turns = real(usize::try_from(euler.abs()).unwrap_or(0)).copysign(sign);
        gaussian * 2.0 * PI * turns
    }

    /// Energy of vertex `i` and its derivatives, from what it has gathered.
    fn at_vertex(
        &self,
        shape: &Shape<'_>,
        gathered: &[[f64; 5]],
        i: usize,
    ) -> (VertexDerivatives, f64) {
        let boundary = shape.sheet.boundary()[i];
        let [x, y, z, area, angles] = gathered[i];
        let l = Vec3::new(x, y, z);
        let varies = !self.gaussian.is_uniform();
        let (rigidity, gaussian) = (self.rigidity.at(i), self.gaussian.at(i));
        match (self.weight, boundary) {
            (BendingWeight::Area, true) if varies => Default::default(),
            (BendingWeight::Area, true) => {
                let incident = shape.sheet.vertex_triangles().entries(i);
                let angles: f64 =
                    incident.iter().map(|&(t, k)| angle_at(shape, t as usize, k as usize)).sum();
                (
                    VertexDerivatives { by_angle: -gaussian, ..Default::default() },
                    gaussian * (PI - angles),
                )
            }
            (BendingWeight::Paper, true) => Default::default(),
            (BendingWeight::Area, false) => {
                let inverse = area.recip();
                let density = 0.125 * rigidity * l.norm_squared() * inverse;
                let derivatives = VertexDerivatives {
                    by_vector: (0.25 * rigidity * inverse) * l,
                    by_area: -density * inverse,
                    by_angle: if varies { gaussian } else { 0.0 },
                };
                let defect = if varies { gaussian * (2.0 * PI - angles) } else { 0.0 };
                (derivatives, density - defect)
            }
            (BendingWeight::Paper, false) => {
                let inverse = area.recip();
                let square = rigidity * inverse * inverse;
                let mean = 0.125 * square * l.norm_squared();
                let gaussian_part = -gaussian * (2.0 * PI - angles) * inverse;
                (
                    VertexDerivatives {
                        by_vector: (0.25 * square) * l,
                        by_area: -(2.0 * mean + gaussian_part) * inverse,
                        by_angle: gaussian * inverse,
                    },
                    mean + gaussian_part,
                )
            }
        }
    }
}

impl Energy for MeyerBending {
    type Work = MeyerWork;

    fn name(&self) -> &'static str {
        "bending"
    }

    fn coupling(&self) -> Coupling {
        Coupling::TWO_RINGS
    }

    fn reads(&self) -> Reads<'_> {
        self.curved.as_ref().map_or_else(Reads::default, |curved| curved.reads())
    }

    fn supports_ranks(&self) -> bool {
        true
    }

    fn prepare(&self, conditions: &Conditions<'_>, work: &mut Self::Work) {
        if let Some(curved) = &self.curved {
            curved.prepare(self, conditions, work);
        }
    }

    fn mixed_derivatives(
        &self,
        shape: &Shape<'_>,
        conditions: &Conditions<'_>,
        work: &mut Self::Work,
        by: ParameterField,
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        let Some(curved) = &self.curved else { return };
        match by {
            ParameterField::OptimalLength => {
                curved.by_lengths(self, (shape, conditions), work, emit);
            }
            ParameterField::SpontaneousCurvature => curved.by_curvature(self, shape, work, emit),
            ParameterField::Species(_) => {}
        }
    }

    fn evaluate(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        gradient: Option<&mut [Vec3]>,
    ) -> f64 {
        if let Some(curved) = &self.curved {
            return curved.evaluate(self, shape, work, gradient);
        }
        let MeyerWork { gathered, vertex, .. } = work;
        self.gather(shape, gathered);
        vertex.resize(shape.x.len(), VertexDerivatives::default());
        let owned = shape.sheet.reduction().owned(shape.x.len());
        let mut energy = parallel::fill_and_sum(vertex, |i| {
            let (derivatives, energy) = self.at_vertex(shape, gathered, i);
            (derivatives, if i < owned { energy } else { 0.0 })
        });
        if self.weight == BendingWeight::Area {
            energy -= self.topological_energy(shape.sheet);
        }
        if let Some(gradient) = gradient {
            let (by_normal, shape): (&[Vec3], _) = (&[], *shape);
            if self.has_angle_terms() || self.has_boundary {
                Gradient::<true, false> { bending: self, vertex, by_normal, shape }
                    .add_to(gradient);
            } else {
                Gradient::<false, false> { bending: self, vertex, by_normal, shape }
                    .add_to(gradient);
            }
        }
        energy
    }

    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        part: HessianPart,
        into: &mut BlockMatrix,
    ) {
        if let Some(curved) = &self.curved {
            curved.fill_derivatives(self, shape, work);
        } else {
            let MeyerWork { gathered, vertex, .. } = work;
            self.gather(shape, gathered);
            vertex.resize(shape.x.len(), VertexDerivatives::default());
            if part == HessianPart::Full {
                parallel::fill(vertex, |i| self.at_vertex(shape, gathered, i).0);
            }
        }
        let MeyerWork { gathered, vertex, places, curved } = work;
        let at = self.curved.as_deref().zip(curved.as_deref());
        let at = at.map(|(rest, work)| CurvedAt { rest, work });
        let at = At { bending: self, gathered, vertex, curved: at };
        hessian::add(&at, places, shape, part, into);
        if let (Some(rest), Some(curved)) = (&self.curved, curved)
            && let Some(hinges) = rest.hinges()
        {
            hinges.add_hessian(shape, &mut curved.hinge, part, into);
        }
    }
}
