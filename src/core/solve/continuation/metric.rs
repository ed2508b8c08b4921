//! The arc length of a branch: what a change of shape counts beside one of species and one of the parameter.
//!
//! ```text
//! ds² = Σ_i A⁰_i |dx_i|² / (A⁰ L²) + Σ_s Σ_p A⁰_p dc_s,p² / (A⁰ C_s²) + (dλ/Λ)²
//! ```
//!
//! with the rest areas A⁰_i of the vertices, A⁰_p of the points of the species, and their sum A⁰: the root mean square
//! displacement in units of L, that of the species in units of their typical magnitudes C_s, and the parameter in units
//! of Λ. s has no unit, and depends little on the mesh. L, C_s and Λ change which points of a branch are
//! computed, and not the branch.

use super::{Direction, Unknowns};
use crate::geometry::{face_areas, lumped_areas};
use crate::parallel;
use crate::reduction::Reduction;
use crate::sheet::Sheet;

/// The inner product of changes.
pub(super) struct Metric {
    /// A⁰_i/(A⁰ L²).
    weight: Vec<f64>,
    /// A⁰_p/(A⁰ C_s²).
    species: Vec<Vec<f64>>,
    /// Λ.
    scale: f64,
    reduction: Reduction,
}

impl Metric {
    /// On `sheet` with L = `length` and Λ = `scale`, and for species of these typical magnitudes at so many points each.
    pub(super) fn new(
        sheet: &Sheet,
        (length, scale): (f64, f64),
        (typical, points): (&[f64], usize),
    ) -> Self {
        let reduction = sheet.reduction();
        let vertices = lumped_areas(sheet);
        let faces = face_areas(sheet, sheet.rest());
        let shares = |areas: Vec<f64>| {
            let total = reduction.sum(areas.len(), |i| areas[i]);
            // A point has no area.
            let equal = 1.0 / crate::num::real(areas.len());
            let share = |area: f64| if total > 0.0 { area / total } else { equal };
            areas.into_iter().map(share).collect::<Vec<_>>()
        };
        let faces = if points == faces.len() && points != vertices.len() {
            faces
        } else {
            vertices.clone()
        };
        let faces = shares(faces);
        let of = |typical: &f64| faces.iter().map(|share| share / (typical * typical)).collect();
        let weight = shares(vertices).iter().map(|share| share / (length * length)).collect();
        Self {
            weight,
            species: typical.iter().map(of).collect(),
            scale,
            reduction: reduction.clone(),
        }
    }

    /// `⟨a, b⟩`.
    pub(super) fn inner(&self, a: &Direction, b: &Direction) -> f64 {
        let by_parameter = a.parameter * b.parameter / (self.scale * self.scale);
        let (x, y) = (&a.unknowns.x, &b.unknowns.x);
        let of_shape = self.reduction.sum(x.len(), |i| self.weight[i] * x[i].dot(&y[i]));
        let species = a.unknowns.species.iter().zip(&b.unknowns.species).zip(&self.species);
        let of_species = |((c, d), weight): ((&Vec<f64>, &Vec<f64>), &Vec<f64>)| {
            self.reduction.sum(c.len(), |p| weight[p] * c[p] * d[p])
        };
        of_shape + species.map(of_species).sum::<f64>() + by_parameter
    }

    /// Length of a change.
    pub(super) fn norm(&self, a: &Direction) -> f64 {
        self.inner(a, a).sqrt()
    }

    /// The linear form `b ↦ ⟨a, b⟩`, as its coefficients.
    pub(super) fn form(&self, a: &Direction) -> Direction {
        let mut unknowns = a.unknowns.clone();
        parallel::update(&mut unknowns.x, |i, v| *v *= self.weight[i]);
        for (values, weight) in unknowns.species.iter_mut().zip(&self.species) {
            parallel::update(values, |p, value| *value *= weight[p]);
        }
        Direction { unknowns, parameter: a.parameter / (self.scale * self.scale) }
    }

    /// The direction of length 1 along the parameter.
    pub(super) fn parameter(&self, like: &Unknowns) -> Direction {
        Direction { unknowns: like.zeros_like(), parameter: self.scale }
    }

    /// Λ.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }
}
