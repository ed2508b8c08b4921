//! The arc length of a branch: what a change of shape counts beside one of the parameter.
//!
//! ```text
//! ds² = Σ_i A⁰_i |dx_i|² / (A⁰ L²) + (dλ/Λ)²
//! ```
//!
//! with the rest areas A⁰_i of the vertices and their sum A⁰: the root mean square displacement in units of L and the
//! parameter in units of Λ. s has no unit, and depends little on the mesh. L and Λ change which points of a branch are
//! computed, and not the branch.

use crate::Vec3;
use crate::parallel;
use crate::reduction::Reduction;

/// A change of shape and parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    /// Of the positions; 0 along fixed directions.
    pub x: Vec<Vec3>,
    /// Of the parameter.
    pub parameter: f64,
}

impl Direction {
    /// Multiplies it by `factor`.
    pub(super) fn scale(&mut self, factor: f64) {
        parallel::update(&mut self.x, |_, v| *v *= factor);
        self.parameter *= factor;
    }
}

/// The inner product of changes.
pub(super) struct Metric {
    /// A⁰_i/(A⁰ L²).
    weight: Vec<f64>,
    /// Λ.
    scale: f64,
    reduction: Reduction,
}

impl Metric {
    /// With the rest areas `mass` of the vertices, L = `length` and Λ = `scale`.
    pub(super) fn new(mass: &[f64], (length, scale): (f64, f64), reduction: &Reduction) -> Self {
        let total = reduction.sum(mass.len(), |i| mass[i]);
        let weight = mass.iter().map(|m| m / (total * length * length)).collect();
        Self { weight, scale, reduction: reduction.clone() }
    }

    /// `⟨a, b⟩`.
    pub(super) fn inner(&self, a: &Direction, b: &Direction) -> f64 {
        let shape = self.reduction.sum(a.x.len(), |i| self.weight[i] * a.x[i].dot(&b.x[i]));
        shape + a.parameter * b.parameter / (self.scale * self.scale)
    }

    /// The length of `a`.
    pub(super) fn norm(&self, a: &Direction) -> f64 {
        self.inner(a, a).sqrt()
    }

    /// The linear form `⟨a, ·⟩`.
    pub(super) fn form(&self, a: &Direction) -> Direction {
        let mut x = a.x.clone();
        parallel::update(&mut x, |i, v| *v *= self.weight[i]);
        Direction { x, parameter: a.parameter / (self.scale * self.scale) }
    }

    /// The direction of length 1 along the parameter.
    pub(super) fn parameter(&self, vertices: usize) -> Direction {
        Direction { x: vec![Vec3::zeros(); vertices], parameter: self.scale }
    }

    /// Λ.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }
}
