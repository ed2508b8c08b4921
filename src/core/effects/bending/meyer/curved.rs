//! Meyer bending with a rest shape that is not flat, and with spontaneous curvature.
//!
//! With `n_i = N_i/|N_i|`, N the sum of the area vectors of the triangles around vertex i, and the signed
//! `2H_i = L_i·n_i/(2A_i)`, which is positive on a bump towards the normals:
//!
//! ```text
//! flat rest shape     U = (B/2) Σ_i A_i [ |L_i|²/(4A_i²) - 2 C₀ (2H_i) + C₀² - 2(1-ν) K_i ]
//! any other           U = (B/2) Σ_i A_i [ (1-s) (2H_i - 2H⁰_i)² - 2 C₀ (2H_i - 2H⁰_i) + C₀² ]  +  s U_hinge
//! ```
//!
//! over the interior vertices, `s = ¾(1-ν)`, `U_hinge` the energy of hinges with rest angles, of the same B.
//!
//! **What becomes of K.** A shell whose curvature tensor is b, and b⁰ at rest, has per area
//!
//! ```text
//! (B/2) [ (tr Δ)² - 2(1-ν) det Δ ],   Δ = b - b⁰,   det Δ = K + K⁰ - b : cof b⁰
//! ```
//!
//! so that the linear part of K is balanced by `b : cof b⁰`, which the curvatures H and K of a vertex do not know (on a
//! sphere it is 2H/R; on a cylinder it is the curvature along the axis). `K - K⁰` alone would pull at the boundary of a
//! shell at rest, and would leave inextensional bending, where K stays, without stiffness: that has
//! `tr Δ ≈ 0`, and all its energy is in `det Δ`. Hinges see all of Δ: on an equilateral lattice they cost
//! `(B/2) [(tr Δ)² - (8/3) det Δ]`, so the share s of them, with 1 - s of the vertices' `(tr Δ)²`, has both
//! moduli for every ν. The sum is at rest in the rest shape exactly, and its positive part is positive for
//! ν ≥ -1/3. Away from the boundary it agrees with the vertices alone to second order in the edge on
//! lattices; on irregular meshes the share s has the error of hinges, about 1 %.
//!
//! **Derivatives.** With `a = L·n`, `p = a/2 - 2H⁰ A`, `r = ∂a/∂N = (L - a n)/|N|` and `∂a/∂L = n`:
//! `f = B [ (1-s) p²/(2A) - C₀ p + C₀² A/2 ]`, `f_p = B [(1-s) p/A - C₀]`,
//!
//! ```text
//! ∂f = ½ f_p (n·∂L + r·∂N) + [ B/2 (C₀² - (1-s) p²/A²) - 2H⁰ f_p ] ∂A
//! ```
//!
//! and a triangle adds `½ W × e_k`, W the sum of `∂U/∂N` at its corners, to the gradient of the parent module.
//!
//! **Growth.** 2H⁰ is divided by the mean factor Φ of the edges around a vertex, as hinges keep their angles: a shell
//! that grows evenly rests as the same shape, enlarged. C₀ is a curvature and stays.

use super::hessian::curved::{RingDerivatives, SecondFactors, differentiate};
use super::hessian::ring;
use super::kernels::{AreaVectors, Gradient};
use super::parts::{
    CurvedRest, CurvedShape, CurvedWork, MeyerBending, MeyerWork, VertexDerivatives,
};
use crate::Vec3;
use crate::effects::bending::HingeBending;
use crate::effects::bending::rest::RestShape;
use crate::effects::material::at_vertices;
use crate::effects::{Energy, FieldValues, Material, MaterialField, Reads};
use crate::geometry::{Conditions, Shape};
use crate::num::real;
use crate::parallel;
use crate::parallel::element_blocks::F64x4;
use crate::sheet::Sheet;

/// Share of hinges at ν = 0.
const HINGE_SHARE: f64 = 0.75;

/// One vertex at a shape.
struct VertexState {
    l: Vec3,
    area: f64,
    /// n; 0 where the triangles around cancel.
    normal: Vec3,
    /// 1/|N|.
    inverse: f64,
}

impl VertexState {
    fn new(&[x, y, z, area, _]: &[f64; 5], normal: &Vec3) -> Self {
        let size = normal.norm();
        let inverse = if size > 0.0 { size.recip() } else { 0.0 };
        Self { l: Vec3::new(x, y, z), area, normal: inverse * normal, inverse }
    }

    /// `a = L·n`.
    fn along(&self) -> f64 {
        self.l.dot(&self.normal)
    }

    /// `r = ∂a/∂N`.
    fn along_by_normal(&self) -> Vec3 {
        self.inverse * (self.l - self.along() * self.normal)
    }
}

impl CurvedRest {
    pub(super) fn new(material: &MaterialField, sheet: &Sheet, rest: &RestShape) -> Self {
        let share = |material: &Material| HINGE_SHARE * (1.0 - material.poisson);
        let rigidity = || material.per_triangle(|m| share(m) * m.bending_rigidity());
        let shaped = rest.positions.as_ref().map(|positions| CurvedShape {
            positions: positions.clone(),
            hinges: HingeBending::with_rigidity(
                sheet,
                &rigidity(),
                &RestShape::from_positions(positions),
            ),
        });
        let left = match &shaped {
            None => FieldValues::Same(1.0),
            Some(_) => vertices_share(material, sheet, share),
        };
        let spontaneous_curvature = rest.spontaneous_curvature.clone().unwrap_or_default();
        Self {
            shaped,
            spontaneous_curvature,
            variable_curvature: rest.variable_curvature.clone(),
            vertices_share: left,
        }
    }

    /// What C₀ depends on.
    pub(super) fn reads(&self) -> Reads<'static> {
        self.variable_curvature.reads()
    }

    /// The hinges of a rest shape that is not flat.
    pub(super) fn hinges(&self) -> Option<&HingeBending> {
        self.shaped.as_ref().map(|shaped| &shaped.hinges)
    }

    pub(super) fn prepare(
        &self,
        bending: &MeyerBending,
        conditions: &Conditions<'_>,
        work: &mut MeyerWork,
    ) {
        if self.variable_curvature.is_present() {
            let variable_curvature = &mut work.curved.get_or_insert_default().variable_curvature;
            variable_curvature.clear();
            variable_curvature.extend_from_slice(
                &self.variable_curvature.values_at(conditions).unwrap_or_default(),
            );
        }
        let Some(shaped) = &self.shaped else { return };
        let &Conditions { sheet, metric, time, .. } = conditions;
        let mut curved = work.curved.take().unwrap_or_default();
        shaped.hinges.prepare(conditions, &mut curved.hinge);
        if curved.reference.is_empty() {
            let shape = Shape { sheet, metric, time, x: &shaped.positions };
            bending.gather(&shape, &mut work.gathered);
            gather_normals(&shape, &mut curved.normals);
            let (gathered, normals) = (&work.gathered, &curved.normals);
            curved.reference = vec![0.0; normals.len()];
            parallel::fill(&mut curved.reference, |i| {
                let at = VertexState::new(&gathered[i], &normals[i]);
                if sheet.boundary()[i] { 0.0 } else { 0.5 * at.along() / at.area }
            });
        }
        let reference = &curved.reference;
        curved.grown_reference.resize(reference.len(), 0.0);
        parallel::fill(&mut curved.grown_reference, |i| reference[i] / growth_at(conditions, i));
        work.curved = Some(curved);
    }

    /// Derivatives of the energy of vertex `i`, those by N, and the energy.
    fn at_vertex(
        &self,
        bending: &MeyerBending,
        (shape, gathered, work): (&Shape<'_>, &[[f64; 5]], &CurvedWork),
        i: usize,
    ) -> (VertexDerivatives, Vec3, f64) {
        if shape.sheet.boundary()[i] {
            if self.shaped.is_some() {
                return Default::default();
            }
            let (derivatives, energy) = bending.at_vertex(shape, gathered, i);
            return (derivatives, Vec3::zeros(), energy);
        }
        let at = VertexState::new(&gathered[i], &work.normals[i]);
        let (b, c0) = (bending.rigidity.at(i), self.spontaneous_curvature(work, i));
        let constant = 0.5 * b * c0 * c0;
        if self.shaped.is_none() {
            let (mut derivatives, density) = bending.at_vertex(shape, gathered, i);
            derivatives.by_vector -= 0.5 * b * c0 * at.normal;
            derivatives.by_area += constant;
            let energy = density - 0.5 * b * c0 * at.along() + constant * at.area;
            return (derivatives, -0.5 * b * c0 * at.along_by_normal(), energy);
        }
        let rest = work.grown_reference[i];
        let p = 0.5 * at.along() - rest * at.area;
        let share = self.vertices_share.at(i);
        let density = 0.5 * share * b * p * p / at.area;
        let pull = share * b * p / at.area - b * c0;
        let derivatives = VertexDerivatives {
            by_vector: 0.5 * pull * at.normal,
            by_area: constant - density / at.area - rest * pull,
            by_angle: 0.0,
        };
        let energy = density - b * c0 * p + constant * at.area;
        (derivatives, 0.5 * pull * at.along_by_normal(), energy)
    }

    /// C₀ of vertex `i`.
    fn spontaneous_curvature(&self, work: &CurvedWork, i: usize) -> f64 {
        let own = self.spontaneous_curvature.get(i).copied().unwrap_or(0.0);
        match self.variable_curvature.is_present() {
            true => own + work.variable_curvature.get(i).copied().unwrap_or(0.0),
            false => own,
        }
    }

    /// Gathers at the shape and fills the derivatives; returns the energy of the vertices.
    pub(super) fn fill_derivatives(
        &self,
        bending: &MeyerBending,
        shape: &Shape<'_>,
        work: &mut MeyerWork,
    ) -> f64 {
        let mut curved = work.curved.take().unwrap_or_default();
        let MeyerWork { gathered, vertex, .. } = work;
        bending.gather(shape, gathered);
        gather_normals(shape, &mut curved.normals);
        vertex.resize(shape.x.len(), VertexDerivatives::default());
        let owned = shape.sheet.reduction().owned(shape.x.len());
        let energy = parallel::fill_and_sum(vertex, |i| {
            let (derivatives, _, energy) = self.at_vertex(bending, (shape, gathered, &curved), i);
            (derivatives, if i < owned { energy } else { 0.0 })
        });
        let mut by_normal = std::mem::take(&mut curved.by_normal);
        by_normal.resize(shape.x.len(), Vec3::zeros());
        parallel::fill(&mut by_normal, |i| {
            self.at_vertex(bending, (shape, gathered, &curved), i).1
        });
        curved.by_normal = by_normal;
        work.curved = Some(curved);
        energy
    }

    pub(super) fn evaluate(
        &self,
        bending: &MeyerBending,
        shape: &Shape<'_>,
        work: &mut MeyerWork,
        mut gradient: Option<&mut [Vec3]>,
    ) -> f64 {
        let mut energy = self.fill_derivatives(bending, shape, work);
        let MeyerWork { vertex, curved, .. } = work;
        let curved = curved.get_or_insert_default();
        if let Some(gradient) = gradient.as_deref_mut() {
            let by_normal = &curved.by_normal;
            if self.shaped.is_none() && (bending.has_angle_terms() || bending.has_boundary) {
                let kernel = Gradient::<true, true> { bending, vertex, by_normal, shape: *shape };
                kernel.add_to(gradient);
            } else {
                let kernel = Gradient::<false, true> { bending, vertex, by_normal, shape: *shape };
                kernel.add_to(gradient);
            }
        }
        match &self.shaped {
            None => energy -= bending.topological_energy(shape.sheet),
            Some(shaped) => energy += shaped.hinges.evaluate(shape, &mut curved.hinge, gradient),
        }
        energy
    }

    /// Second derivatives by what interior vertex `i` gathers.
    pub(super) fn second_factors(
        &self,
        bending: &MeyerBending,
        (gathered, work): (&[[f64; 5]], &CurvedWork),
        i: usize,
    ) -> SecondFactors {
        let at = VertexState::new(&gathered[i], &work.normals[i]);
        let (along, b, c0) =
            (at.along(), bending.rigidity.at(i), self.spontaneous_curvature(work, i));
        let (stiffness, pull) = match self.shaped {
            None => (0.0, -b * c0),
            Some(_) => {
                let stiffness = self.vertices_share.at(i) * b / at.area;
                (stiffness, stiffness * (0.5 * along - work.grown_reference[i] * at.area) - b * c0)
            }
        };
        SecondFactors {
            normal: at.normal,
            along_by_normal: at.along_by_normal(),
            inverse: at.inverse,
            along,
            mean: 0.5 * along / at.area,
            stiffness,
            pull,
        }
    }

    /// Derivatives of the forces by optimal lengths, after [`CurvedRest::fill_derivatives`] at the shape.
    pub(super) fn by_lengths(
        &self,
        bending: &MeyerBending,
        (shape, conditions): (&Shape<'_>, &Conditions<'_>),
        work: &mut MeyerWork,
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        let Some(shaped) = &self.shaped else { return };
        self.fill_derivatives(bending, shape, work);
        let MeyerWork { gathered, curved, .. } = work;
        let curved = curved.get_or_insert_default();
        shaped.hinges.by_lengths(shape, &mut curved.hinge, emit);
        let sheet = shape.sheet;
        let (mut vertices, mut derivatives) = (Vec::new(), Vec::new());
        for i in 0..shape.x.len() {
            ring(sheet, i, &mut vertices);
            derivatives.clear();
            derivatives.resize(vertices.len(), RingDerivatives::ZERO);
            differentiate(bending, shape, i, &vertices, &mut derivatives);
            let second = self.second_factors(bending, (gathered, curved), i);
            let area = gathered[i][3];
            let around = sheet.vertex_edges().entries(i);
            let by_factor =
                -curved.grown_reference[i] / (growth_at(conditions, i) * real(around.len()));
            for (v, at) in vertices.iter().zip(&derivatives) {
                let by_mean = -second.pull * at.area - second.stiffness * area * second.bent(at);
                for &(e, _) in around {
                    let by_length = by_factor / shape.metric.reference_length()[e as usize];
                    emit(*v as usize, e as usize, by_length * by_mean);
                }
            }
        }
    }
}

impl CurvedRest {
    /// `∂²U/∂x∂C₀ = B (C₀ ∂A - ∂p)` of the rings of interior vertices, `∂p = J + (a/(2A) - 2H⁰) ∂A` with the J of
    /// [`SecondFactors`].
    pub(super) fn by_curvature(
        &self,
        bending: &MeyerBending,
        shape: &Shape<'_>,
        work: &mut MeyerWork,
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        if !self.variable_curvature.law {
            return;
        }
        self.fill_derivatives(bending, shape, work);
        let MeyerWork { gathered, curved, .. } = work;
        let curved = curved.get_or_insert_default();
        let (mut vertices, mut derivatives) = (Vec::new(), Vec::new());
        for i in (0..shape.x.len()).filter(|&i| !shape.sheet.boundary()[i]) {
            ring(shape.sheet, i, &mut vertices);
            derivatives.clear();
            derivatives.resize(vertices.len(), RingDerivatives::ZERO);
            differentiate(bending, shape, i, &vertices, &mut derivatives);
            let second = self.second_factors(bending, (gathered, curved), i);
            let rest = curved.grown_reference.get(i).copied().unwrap_or(0.0);
            let by_area = self.spontaneous_curvature(curved, i) - second.mean + rest;
            let b = bending.rigidity.at(i);
            for (v, at) in vertices.iter().zip(&derivatives) {
                emit(*v as usize, i, b * (by_area * at.area - second.bent(at)));
            }
        }
    }
}

/// `1 - s` of every vertex with the share s of every triangle: weighted by B, so that both parts add up to the B of a vertex.
fn vertices_share(
    material: &MaterialField,
    sheet: &Sheet,
    share: impl Fn(&Material) -> f64,
) -> FieldValues {
    if material.poisson.is_uniform() {
        return FieldValues::Same(1.0 - share(&material.largest()));
    }
    let part =
        at_vertices(&material.per_triangle(|m| (1.0 - share(m)) * m.bending_rigidity()), sheet);
    let whole = at_vertices(&material.bending_rigidity(), sheet);
    FieldValues::Each((0..sheet.vertex_count()).map(|i| part.at(i) / whole.at(i)).collect())
}

/// Mean factor `l̄/l⁰` of the edges around vertex `i`.
fn growth_at(conditions: &Conditions<'_>, i: usize) -> f64 {
    let (length, reference) = (conditions.metric.length(), conditions.metric.reference_length());
    let around = conditions.sheet.vertex_edges().entries(i);
    let sum: f64 = around.iter().map(|&(e, _)| length[e as usize] / reference[e as usize]).sum();
    sum / real(around.len())
}

/// Sums of the area vectors around every vertex.
fn gather_normals(shape: &Shape<'_>, normals: &mut Vec<Vec3>) {
    normals.resize(shape.x.len(), Vec3::zeros());
    let write =
        |place: &mut Vec3, [F64x4([x, y, z, _])]: &[F64x4; 1]| *place = Vec3::new(*x, *y, *z);
    shape.sheet.triangle_blocks().accumulate::<1, _>(&AreaVectors { x: shape.x }, normals, write);
}
