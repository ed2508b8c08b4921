//! Stretching of the bonds.
//!
//! ```text
//! U_s = (Y/2) Σ_bonds w_ij ((l_ij - l̄_ij)/l̄_ij)²        Y = E h/(1-ν²)
//! ∂U_s/∂x_i = Σ_j k_ij (1 - l̄_ij/l_ij) (x_i - x_j)       k_ij = Y w_ij / l̄_ij²
//! ```
//!
//! * `weight = "optimal-area"`: `w_ij` is the sum of the optimal areas of the triangles that share
//!   the bond. On an equilateral mesh this is exactly a continuum with two-dimensional Young's
//!   modulus Y and ν = 1/3, and a grown region keeps its modulus.
//!   (Where optimal lengths make no triangle, see [`RestMetric::weight_area`].)
//!   In triangles that are not equilateral the stress of a uniform strain has a deviator: thin closed shells buckle at
//!   some 0.8 of the theoretical pressure, on every mesh.
//! * `weight = "paper"`: `w_ij = 1`, as printed. Energies and forces then depend on the mesh.
//!
//! Where Y differs from triangle to triangle, `Y w_ij` is `Σ_T Y_T Ā_T` over the triangles that share the bond, and
//! the mean of their Y with printed weights.
//!
//! The Hessian block of a bond is `k (1 - l̄/l) (I - d dᵀ) + k d dᵀ` with the unit bond vector d;
//! under compression the first, geometric, part is negative.
//!
//! Source: Zakharov & Dasbiswas (2021), eq. for U_s; weight after Seung & Nelson,
//! Phys. Rev. A 38 (1988) 1005, doi:10.1103/PhysRevA.38.1005. Not covered: ν ≠ 1/3.

use serde::{Deserialize, Serialize};

use crate::effects::{
    Coupling, Energy, FieldValues, ForceScales, HessianPart, MaterialField, ParameterField,
};
use crate::geometry::{Conditions, Shape};
use crate::linear::{BlockMatrix, LazyStencils};
use crate::parallel::element_blocks::{Corners, F64x4, Group, Kernel};
use crate::parallel::simd::{Lanes, Lanes3, Simd};
use crate::sheet::Edge;
use crate::{Vec3, parallel};

/// Weight `w_ij` of a bond.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StretchingWeight {
    /// Optimal areas of the sharing triangles.
    #[default]
    OptimalArea,
    /// 1, as printed in the paper.
    Paper,
}

/// Bond stretching of one sheet.
#[derive(Debug)]
pub struct BondStretching {
    /// Y of the triangles.
    modulus: FieldValues,
    weight: StretchingWeight,
}

/// Memory of evaluations.
#[derive(Debug, Default)]
pub struct BondWork {
    /// `Y w/l̄²` of every bond.
    stiffness: Vec<f64>,
    stencils: LazyStencils,
}

impl BondStretching {
    /// For a sheet of the given material; lengths come with the rest metric.
    #[must_use]
    pub fn new(material: impl Into<MaterialField>, weight: StretchingWeight) -> Self {
        Self { modulus: material.into().stretching_modulus(), weight }
    }

    /// `Σ_T Y_T Ā_T` over the triangles of a bond, or the mean of their Y for printed weights.
    fn varying(&self, edge: &Edge, modulus: &[f64], area: &[f64]) -> f64 {
        let sides = edge.triangles.into_iter().filter(|t| *t != Edge::NONE).map(|t| t as usize);
        match self.weight {
            StretchingWeight::OptimalArea => sides.map(|t| modulus[t] * area[t]).sum(),
            StretchingWeight::Paper => {
                let (sum, count) = sides.fold((0.0, 0.0), |(s, n), t| (s + modulus[t], n + 1.0));
                sum / count
            }
        }
    }
}

/// Energy of four bonds, and its derivatives by their ends.
struct Bonds<'a> {
    x: &'a [Vec3],
    length: &'a [f64],
    stiffness: &'a [f64],
}

impl Bonds<'_> {
    /// Energy, bond vector and pull per length.
    #[inline(always)]
    fn bond<S: Simd>(&self, simd: S, group: &Group<2>) -> (S::Lanes, Lanes3<S::Lanes>, S::Lanes) {
        let length = simd.gather(self.length, group.element);
        let stiffness = simd.gather(self.stiffness, group.element);
        let d = Lanes3::gather(simd, self.x, group.vertex[0])
            - Lanes3::gather(simd, self.x, group.vertex[1]);
        let l = d.dot(d).sqrt();
        let stretch = l - length;
        let tension = stiffness * stretch;
        (simd.splat(0.5) * tension * stretch, d, tension / l)
    }
}

impl Kernel<2, 1> for Bonds<'_> {
    #[inline(always)]
    fn evaluate<S: Simd>(&self, simd: S, group: &Group<2>) -> (S::Lanes, Corners<S::Lanes, 2, 1>) {
        let (energy, d, pull) = self.bond(simd, group);
        let (force, zero) = (d.scale(pull), simd.splat(0.0));
        (energy, [[force.with(zero)], [(-force).with(zero)]])
    }
}

impl Kernel<2, 0> for Bonds<'_> {
    #[inline(always)]
    fn evaluate<S: Simd>(&self, simd: S, group: &Group<2>) -> (S::Lanes, Corners<S::Lanes, 2, 0>) {
        (self.bond(simd, group).0, [[]; 2])
    }
}

impl Energy for BondStretching {
    type Work = BondWork;

    fn name(&self) -> &'static str {
        "stretching"
    }

    fn coupling(&self) -> Coupling {
        Coupling::ONE_RING
    }

    fn supports_ranks(&self) -> bool {
        true
    }

    fn prepare(&self, conditions: &Conditions<'_>, work: &mut Self::Work) {
        let edges = conditions.sheet.edges();
        let (length, area) = (conditions.metric.length(), conditions.metric.weight_area());
        let share = |t: u32| if t == Edge::NONE { 0.0 } else { area[t as usize] };
        let weight = |e: usize| match self.weight {
            StretchingWeight::OptimalArea => {
                share(edges[e].triangles[0]) + share(edges[e].triangles[1])
            }
            StretchingWeight::Paper => 1.0,
        };
        work.stiffness.resize(edges.len(), 0.0);
        match &self.modulus {
            FieldValues::Same(modulus) => parallel::fill(&mut work.stiffness, |e| {
                modulus * weight(e) / (length[e] * length[e])
            }),
            FieldValues::Each(modulus) => parallel::fill(&mut work.stiffness, |e| {
                self.varying(&edges[e], modulus, area) / (length[e] * length[e])
            }),
        }
    }

    fn evaluate(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        gradient: Option<&mut [Vec3]>,
    ) -> f64 {
        let kernel =
            Bonds { x: shape.x, length: shape.metric.length(), stiffness: &work.stiffness };
        let blocks = shape.sheet.edge_blocks();
        match gradient {
            None => blocks.total(&kernel),
            Some(gradient) => {
                blocks.accumulate(&kernel, gradient, |g, [F64x4([x, y, z, _])]: &[F64x4; 1]| {
                    *g += Vec3::new(*x, *y, *z);
                })
            }
        }
    }

    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        part: HessianPart,
        into: &mut BlockMatrix,
    ) {
        let x = shape.x;
        let (length, stiffness) = (shape.metric.length(), &work.stiffness);
        let edges = shape.sheet.edges();
        let ends = || edges.iter().map(|e| e.vertices);
        let stencils = work.stencils.for_pattern(into.pattern(), ends);
        stencils.assemble(into, |e, sink| {
            let [i, j] = edges[e].vertices.map(|v| v as usize);
            let d = x[i] - x[j];
            let l = d.norm();
            let d = d / l;
            let geometric = stiffness[e] * (1.0 - length[e] / l);
            let geometric = match part {
                HessianPart::Positive => geometric.max(0.0),
                HessianPart::Full => geometric,
            };
            let mut block = (stiffness[e] - geometric) * d * d.transpose();
            for a in 0..3 {
                block[(a, a)] += geometric;
            }
            sink.add(0, 0, &block);
            sink.add(1, 1, &block);
            sink.add(0, 1, &-block);
        });
    }

    fn mixed_derivatives(
        &self,
        shape: &Shape<'_>,
        _: &Conditions<'_>,
        work: &mut Self::Work,
        by: ParameterField,
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        if by != ParameterField::OptimalLength {
            return;
        }
        let sheet = shape.sheet;
        let triangles = sheet.triangle_edges();
        let (length, stiffness, modulus) = (shape.metric.length(), &work.stiffness, &self.modulus);
        let bond = |e: usize| {
            let [i, j] = sheet.edges()[e].vertices.map(|v| v as usize);
            let d = shape.x[i] - shape.x[j];
            let l = d.norm();
            (i, j, d / l, l)
        };
        // The force k (l - l̄) d of a bond with k = Y w/l̄², by its own l̄ …
        for e in 0..sheet.edges().len() {
            let (i, j, d, l) = bond(e);
            let slope = stiffness[e] * (1.0 - 2.0 * l / length[e]);
            emit(i, e, slope * d);
            emit(j, e, -slope * d);
        }
        // … and by the lengths that its weight depends on.
        if self.weight == StretchingWeight::OptimalArea {
            for (t, edges) in triangles.iter().enumerate() {
                let by_length = shape.metric.weight_area_gradient(sheet, t);
                for e in edges.map(|e| e as usize) {
                    let (i, j, d, l) = bond(e);
                    let force = modulus.at(t) * (l - length[e]) / (length[e] * length[e]);
                    for (f, slope) in edges.map(|f| f as usize).into_iter().zip(by_length) {
                        emit(i, f, (force * slope) * d);
                        emit(j, f, (-force * slope) * d);
                    }
                }
            }
        }
    }

    /// Y·(edge length) for area weights, Y/(edge length) for the printed ones.
    fn force_scales(&self, edge: f64) -> ForceScales {
        let unit_strain = match self.weight {
            StretchingWeight::OptimalArea => self.modulus.mean() * edge,
            StretchingWeight::Paper => self.modulus.mean() / edge,
        };
        ForceScales { unit_strain, ..ForceScales::default() }
    }
}
