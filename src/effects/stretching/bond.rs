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
//! * `weight = "paper"`: `w_ij = 1`, as printed. Energies and forces then depend on the mesh.
//!
//! The Hessian block of a bond is `k (1 - l̄/l) (I - d dᵀ) + k d dᵀ` with the unit bond vector d;
//! under compression the first, geometric, part is negative.
//!
//! Source: Zakharov & Dasbiswas (2021), eq. for U_s; weight after Seung & Nelson,
//! Phys. Rev. A 38 (1988) 1005, doi:10.1103/PhysRevA.38.1005. Not covered: ν ≠ 1/3.

use super::StretchingWeight;
use crate::Vec3;
use crate::effects::{Energy, HessianPart, Material};
use crate::geometry::{RestMetric, Shape};
use crate::parallel;
use crate::sheet::{Edge, Sheet};
use crate::solve::linear::{Block, BlockMatrix};

/// Bond stretching of one sheet.
#[derive(Debug)]
pub struct BondStretching {
    modulus: f64,
    weight: StretchingWeight,
    length: Vec<f64>,
    stiffness: Vec<f64>,
    force_scale: f64,
    pull: Vec<f64>,
}

impl BondStretching {
    /// For a sheet of the given material; lengths come with the rest metric.
    #[must_use]
    pub fn new(material: &Material, weight: StretchingWeight) -> Self {
        Self {
            modulus: material.stretching_modulus(),
            weight,
            length: Vec::new(),
            stiffness: Vec::new(),
            force_scale: 0.0,
            pull: Vec::new(),
        }
    }
}

impl Energy for BondStretching {
    fn name(&self) -> &'static str {
        "stretching"
    }

    fn set_rest_metric(&mut self, sheet: &Sheet, metric: &RestMetric) {
        let edges = sheet.edges();
        let (length, area) = (metric.length(), metric.weight_area());
        let share = |t: u32| if t == Edge::NONE { 0.0 } else { area[t as usize] };
        let weight = |e: usize| match self.weight {
            StretchingWeight::OptimalArea => {
                share(edges[e].triangles[0]) + share(edges[e].triangles[1])
            }
            StretchingWeight::Paper => 1.0,
        };
        self.length.resize(edges.len(), 0.0);
        self.length.copy_from_slice(length);
        self.stiffness.resize(edges.len(), 0.0);
        self.pull.resize(edges.len(), 0.0);
        let modulus = self.modulus;
        parallel::fill(&mut self.stiffness, |e| modulus * weight(e) / (length[e] * length[e]));
        // Y·(edge length) for area weights, Y/(edge length) for the printed ones.
        let edge = metric.mean_edge();
        self.force_scale = match self.weight {
            StretchingWeight::OptimalArea => modulus * edge,
            StretchingWeight::Paper => modulus / edge,
        };
    }

    fn evaluate(&mut self, shape: &Shape<'_>, gradient: Option<&mut [Vec3]>) -> f64 {
        let (edges, x) = (shape.sheet.edges(), shape.x);
        let (length, stiffness) = (&self.length, &self.stiffness);
        let energy = parallel::fill_and_sum(&mut self.pull, |e| {
            let [a, b] = edges[e].vertices;
            let l = (x[a as usize] - x[b as usize]).norm();
            let stretch = l - length[e];
            (stiffness[e] * stretch / l, 0.5 * stiffness[e] * stretch * stretch)
        });
        if let Some(gradient) = gradient {
            let (pull, incident) = (&self.pull, shape.sheet.vertex_edges());
            parallel::update(gradient, |i, g| {
                for &(e, j) in incident.of(i) {
                    *g += pull[e as usize] * (x[i] - x[j as usize]);
                }
            });
        }
        energy
    }

    fn add_hessian(&mut self, shape: &Shape<'_>, part: HessianPart, into: &mut BlockMatrix) {
        let x = shape.x;
        let (length, stiffness) = (&self.length, &self.stiffness);
        let block = |e: usize, i: usize, j: usize| -> Block {
            let d = x[i] - x[j];
            let l = d.norm();
            let d = d / l;
            let geometric = stiffness[e] * (1.0 - length[e] / l);
            let geometric = match part {
                HessianPart::Positive => geometric.max(0.0),
                HessianPart::Full => geometric,
            };
            let along = d * d.transpose();
            geometric * (Block::identity() - along) + stiffness[e] * along
        };
        let incident = shape.sheet.vertex_edges();
        into.update_rows(|i, row| {
            for &(e, j) in incident.of(i) {
                let b = block(e as usize, i, j as usize);
                row.add(i, &b);
                if j as usize > i {
                    row.add(j as usize, &-b);
                }
            }
        });
    }

    fn force_scale(&self) -> f64 {
        self.force_scale
    }
}
