//! Bending energy of the angles between neighbouring triangles, in the tangent form.
//!
//! ```text
//! U_b = (B/2) Σ_{interior edges} l̄²/(Ā₁+Ā₂) (ψ - ψ⁰)²,   ψ = 2 tan(θ/2),   B = E h³/(12(1-ν²))
//! ψ⁰ = ψ(rest shape) + C₀ (Ā₁+Ā₂)/l̄ + β
//! ```
//!
//! θ is the angle by which the normal turns across the edge (0 where flat, positive on a ridge
//! seen from the side of the normals), l̄ the optimal length of the edge, Ā₁ and Ā₂ the optimal
//! areas of its triangles ([`RestMetric::weight_area`]). ψ = θ + O(θ³) and grows without bound
//! towards a closed fold, so triangles do not pass through one another at an edge.
//!
//! **Rest angles.** ψ⁰ = 0 for a flat rest shape ([`Flat`]). A curved one gives the angles of its own edges,
//! which uniform growth keeps: the sheet then rests as the same shape, enlarged. The spontaneous curvature C₀
//! (1/length, the mean of its values at the ends of the edge) enters the energy linearly as
//! `-B C₀ Σ l̄ ψ`, and `Σ l θ` is Steiner's `∫ 2H dA` on every mesh: so C₀ is that of Helfrich's `(2H - C₀)²`,
//! H > 0 on a bump towards the normals. That of a law is added. β is what the angles have flowed by ([`remodelling`](super::remodelling)), 0 where
//! they do not.
//!
//! Where B differs from triangle to triangle, an edge has the mean of its two, weighted by their rest areas.
//!
//! **Calibration.** On an equilateral lattice with smooth curvatures an edge sees
//! `θ = (√3/2) l (κ_nn - κ_tt/3)`, n across and t along it. The sum over the three directions is
//!
//! ```text
//! (B/2) [ (4/3) m² + (8/3) d² ] = (B/2) [ (2H)² - 2(1-ν_h) K ],   ν_h = -1/3
//! ```
//!
//! per area, m and d half the sum and difference of the principal curvatures. So a cylinder costs
//! B κ²/2 exactly as in the continuum, but the Gaussian curvature has a modulus of its own
//! (`-4B/3`) that no choice of ν changes; ν enters through B alone. The Gaussian part is a
//! boundary term: away from the boundary this model and Meyer's agree for smooth shapes at any ν, with
//! a difference of second order in the edge length. They are not the same matrix (Meyer's reaches
//! two edges far along a line of the lattice, a hinge does not), and free or simply supported boundaries
//! see ν_h. On irregular meshes the stiffness depends on the mesh and does not converge to B: a
//! cylinder costs 2.5 % too much on generated meshes of any fineness, and 11 % on a lattice whose
//! vertices are moved at random by a quarter of the edge length.
//!
//! **Derivatives.** For the triangle (0, 1, 2) at the edge e = x₁ - x₀ of length l, with
//! N = e × (x₂ - x₀) and m = N/|N|²,
//!
//! ```text
//! tan(θ/2) = -l N₁·(x₃ - x₀)/(|N₁||N₂| + N₁·N₂)
//! ∂θ = b m (at 0), a m (at 1), -l m (at 2),   a = (x₂ - x₀)·e/l,   b = (x₁ - x₂)·e/l
//! ```
//!
//! plus the same of the other triangle (1, 0, 3). With c = 1 + ψ²/4 and δ = ψ - ψ⁰: `∂U = kδc ∂θ`,
//! `∂²U = k(c² + δψc/2) ∂θ ⊗ ∂θ + kδc ∂²θ`; the first term, with δψ where that is positive, is the positive
//! part.
//!
//! Source: Grinspun, Hirani, Desbrun & Schröder, "Discrete shells" (2003),
//! doi:10.2312/SCA03/062-067; moduli of the lattice after Seung & Nelson,
//! Phys. Rev. A 38 (1988) 1005, doi:10.1103/PhysRevA.38.1005; ∫ 2H dA of a polyhedron after Steiner, e.g.
//! Cohen-Steiner & Morvan, doi:10.1145/777792.777839. Not covered: spontaneous curvature with a direction.

use super::dihedral::{WING_CORNERS, angle_gradient, angle_outer_product, hinges, state};
use super::rest::{REMODELLING_NAME, RestAngles, RestShape, VariableCurvature};
use crate::effects::element::{self, Element, Mesh};
use crate::effects::material::at_edges;
use crate::effects::{
    Coupling, Energy, FieldValues, HessianPart, MaterialField, ParameterField, Reads,
};
use crate::geometry::{Conditions, Shape};
use crate::linear::{Block, BlockMatrix, LazyStencils};
use crate::num::index;
use crate::sheet::{Incidence, Sheet};
use crate::{Vec3, parallel};

/// One hinge: corners 0 and 1 are the ends of the edge, 2 is opposite in the triangle in which the
/// edge runs from 0 to 1, 3 in the other.
#[derive(Debug, Clone, Copy, Default)]
struct Hinge {
    /// `k = B l̄²/(Ā₁+Ā₂)`, energy.
    stiffness: f64,
    /// ψ⁰.
    rest: f64,
}

impl Element<4> for Hinge {
    fn gradient(&self, x: &[Vec3; 4]) -> (f64, [Vec3; 4]) {
        let (wings, psi) = state(x);
        let off = psi - self.rest;
        let moment = self.stiffness * off * (1.0 + 0.25 * psi * psi);
        let pull = angle_gradient(&wings).map(|g| moment * g);
        (0.5 * self.stiffness * off * off, pull)
    }

    fn hessian(&self, x: &[Vec3; 4], part: HessianPart) -> [[Block; 4]; 4] {
        let (wings, psi) = state(x);
        let off = psi - self.rest;
        let c = 1.0 + 0.25 * psi * psi;
        let mut bent = 0.5 * off * psi;
        if part == HessianPart::Positive {
            bent = bent.max(0.0);
        }
        let tangent = self.stiffness * c * (c + bent);
        let mut blocks = angle_outer_product(&wings, tangent);
        if part == HessianPart::Full {
            let moment = self.stiffness * off * c;
            for (wing, places) in wings.iter().zip(WING_CORNERS) {
                let inner = wing.hessian();
                for (j, row) in places.into_iter().zip(&inner) {
                    for (k, block) in places.into_iter().zip(row) {
                        blocks[j][k] += moment * block;
                    }
                }
            }
        }
        blocks
    }
}

/// Hinge bending of one sheet.
#[derive(Debug)]
pub struct HingeBending {
    /// B of every hinge.
    rigidity: FieldValues,
    /// Numbers of the interior edges.
    edge: Vec<u32>,
    corners: Vec<[u32; 4]>,
    incident: Incidence,
    /// None where it is at rest flat.
    rest: Option<RestAngles>,
}

/// Memory of evaluations.
#[derive(Debug, Default)]
pub struct HingeWork {
    hinge: Vec<Hinge>,
    pull: Vec<[Vec3; 4]>,
    places: LazyStencils,
    /// C₀ of every hinge that changes in a run; empty without.
    variable_curvature: Vec<f64>,
}

impl HingeBending {
    /// For `sheet` of the given material, at rest where it is flat.
    #[must_use]
    pub fn new(sheet: &Sheet, material: impl Into<MaterialField>) -> Self {
        Self::build(sheet, &material.into().bending_rigidity(), |_| None)
    }

    /// For `sheet` of the given material, with the rest shape `rest`.
    #[must_use]
    pub fn with_rest(sheet: &Sheet, material: impl Into<MaterialField>, rest: &RestShape) -> Self {
        Self::with_rigidity(sheet, &material.into().bending_rigidity(), rest)
    }

    /// For `sheet` of the given bending rigidity of its triangles, with the rest shape `rest`.
    pub(super) fn with_rigidity(sheet: &Sheet, rigidity: &FieldValues, rest: &RestShape) -> Self {
        Self::build(sheet, rigidity, |corners| Some(rest.at_hinges(corners)))
    }

    fn build(
        sheet: &Sheet,
        rigidity: &FieldValues,
        rest: impl FnOnce(&[[u32; 4]]) -> Option<RestAngles>,
    ) -> Self {
        let (edge, corners): (Vec<u32>, Vec<[u32; 4]>) = hinges(sheet).unzip();
        let triples = corners
            .iter()
            .enumerate()
            .flat_map(|(h, corner)| (0u32..4).map(move |k| (corner[k as usize], index(h), k)));
        let incident = Incidence::new(sheet.vertex_count(), triples);
        let rest = rest(&corners);
        let rigidity = at_edges(rigidity, sheet, &edge);
        Self { rigidity, edge, corners, incident, rest }
    }

    /// The C₀ that is added and changes in a run.
    fn variable_curvature(&self) -> Option<&VariableCurvature> {
        self.rest.as_ref().map(|rest| &rest.variable_curvature)
    }

    /// `B C₀ ∂ψ` of hinge `h`.
    fn spontaneous_gradient(&self, h: usize, curvature: f64, x: &[Vec3; 4]) -> [Vec3; 4] {
        let (wings, psi) = state(x);
        let moment = self.rigidity.at(h) * curvature * (1.0 + 0.25 * psi * psi);
        angle_gradient(&wings).map(|g| moment * g)
    }

    /// `∂²U/∂x∂l̄`.
    pub(super) fn by_lengths(
        &self,
        shape: &Shape<'_>,
        work: &mut HingeWork,
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        let (sheet, metric) = (shape.sheet, shape.metric);
        for (h, corners) in self.corners.iter().enumerate() {
            let e = self.edge[h] as usize;
            let corners = corners.map(|v| v as usize);
            let (_, pull) = work.hinge[h].gradient(&corners.map(|v| shape.x[v]));
            // All of the energy is in proportion to l̄²/(Ā_1 + Ā_2) …
            let mut by = |f: usize, slope: f64, pull: &[Vec3; 4]| {
                for (v, pull) in corners.into_iter().zip(pull) {
                    emit(v, f, slope * pull);
                }
            };
            let length = metric.length()[e];
            by(e, 2.0 / length, &pull);
            // … but for -B C₀ l̄ ψ, which knows no areas.
            let bent = self.rest.as_ref().map(|rest| {
                let variable = work.variable_curvature.get(h).copied().unwrap_or(0.0);
                let curvature = rest.spontaneous_curvature(h) + variable;
                self.spontaneous_gradient(h, curvature, &corners.map(|v| shape.x[v]))
            });
            if let Some(bent) = &bent {
                by(e, 1.0, bent);
            }
            let sides = sheet.edges()[e].triangles.map(|t| t as usize);
            let area: f64 = sides.iter().map(|&t| metric.weight_area()[t]).sum();
            for t in sides {
                let slopes = metric.weight_area_gradient(sheet, t);
                for (f, slope) in sheet.triangle_edges()[t].into_iter().zip(slopes) {
                    by(f as usize, -slope / area, &pull);
                    if let Some(bent) = &bent {
                        by(f as usize, -slope * length / area, bent);
                    }
                }
            }
        }
    }

    /// `∂²U/∂x∂C₀`: `-B l̄ ∂ψ` for the C₀ of a hinge, half of it for that of either end.
    fn by_curvature(&self, shape: &Shape<'_>, emit: &mut dyn FnMut(usize, usize, Vec3)) {
        if !self.variable_curvature().is_some_and(|curvature| curvature.law) {
            return;
        }
        let length = shape.metric.length();
        for (h, corners) in self.corners.iter().enumerate() {
            let half = -0.5 * length[self.edge[h] as usize];
            let by = self.spontaneous_gradient(h, half, &corners.map(|v| shape.x[v as usize]));
            for (v, by) in corners.iter().zip(by) {
                for end in &corners[..2] {
                    emit(*v as usize, *end as usize, by);
                }
            }
        }
    }
}

impl Energy for HingeBending {
    type Work = HingeWork;

    fn name(&self) -> &'static str {
        "bending"
    }

    fn coupling(&self) -> Coupling {
        Coupling::TWO_RINGS
    }

    fn reads(&self) -> Reads<'_> {
        self.variable_curvature().map_or_else(Reads::default, |curvature| curvature.reads())
    }

    fn supports_ranks(&self) -> bool {
        true
    }

    fn prepare(&self, conditions: &Conditions<'_>, work: &mut Self::Work) {
        let (sheet, metric) = (conditions.sheet, conditions.metric);
        let (length, area) = (metric.length(), metric.weight_area());
        let Self { edge, rigidity, rest, corners, .. } = self;
        let shift = conditions
            .internal(REMODELLING_NAME)
            .filter(|_| rest.as_ref().is_some_and(|rest| rest.flows));
        let variable_curvature =
            self.variable_curvature().and_then(|curvature| curvature.values_at(conditions));
        work.variable_curvature.resize(variable_curvature.as_ref().map_or(0, |_| edge.len()), 0.0);
        if let Some(at) = &variable_curvature {
            parallel::fill(&mut work.variable_curvature, |h| {
                let [a, b, ..] = corners[h];
                0.5 * (at[a as usize] + at[b as usize])
            });
        }
        let added = &work.variable_curvature;
        work.hinge.resize(edge.len(), Hinge::default());
        parallel::fill(&mut work.hinge, |h| {
            let e = edge[h] as usize;
            let [first, second] = sheet.edges()[e].triangles.map(|t| area[t as usize]);
            let stiffness = rigidity.at(h) * length[e] * length[e] / (first + second);
            let mut shift = shift.map_or(0.0, |shift| shift[e]);
            if let Some(curvature) = added.get(h) {
                shift += curvature * (first + second) / length[e];
            }
            let sizes = (length[e], first + second);
            Hinge { stiffness, rest: rest.as_ref().map_or(0.0, |rest| rest.angle(h, sizes, shift)) }
        });
    }

    fn evaluate(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        gradient: Option<&mut [Vec3]>,
    ) -> f64 {
        let hinge = &work.hinge;
        let mesh = Mesh { corners: &self.corners, incident: &self.incident, sheet: shape.sheet };
        element::evaluate(&mesh, |h| &hinge[h], shape.x, &mut work.pull, gradient)
    }

    fn mixed_derivatives(
        &self,
        shape: &Shape<'_>,
        _: &Conditions<'_>,
        work: &mut Self::Work,
        by: ParameterField,
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        match by {
            ParameterField::OptimalLength => self.by_lengths(shape, work, emit),
            ParameterField::SpontaneousCurvature => self.by_curvature(shape, emit),
            ParameterField::Species(_) => {}
        }
    }

    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        part: HessianPart,
        into: &mut BlockMatrix,
    ) {
        let hinge = &work.hinge;
        let mesh = Mesh { corners: &self.corners, incident: &self.incident, sheet: shape.sheet };
        element::add_hessian(&mesh, |h| &hinge[h], shape.x, part, &mut work.places, into);
    }
}
