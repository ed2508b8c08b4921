//! The effects a scene can list: each file holds one, from its equation to its derivatives.
//!
//! An effect plays one of three roles: it has an [`Energy`], it takes directions away from the
//! motion (a pin), or it moves a species about (diffusion). What a scene does not list is not
//! built.

mod bending;
mod stretching;

pub use bending::{Bending, BendingModel, BendingWeight, MeyerBending};
pub use stretching::{BondStretching, Stretching, StretchingModel, StretchingWeight};

use crate::Vec3;
use crate::geometry::{RestMetric, Shape};
use crate::sheet::Sheet;
use crate::solve::linear::BlockMatrix;

/// Material of the sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Young's modulus E, stress.
    pub young: f64,
    /// Poisson's ratio ν.
    pub poisson: f64,
    /// Thickness h, length.
    pub thickness: f64,
}

impl Material {
    /// Stretching modulus `Y = E h/(1-ν²)`, force per length, as the paper defines it.
    #[must_use]
    pub fn stretching_modulus(&self) -> f64 {
        self.young * self.thickness / (1.0 - self.poisson * self.poisson)
    }

    /// Bending rigidity `B = E h³/(12(1-ν²))`, energy.
    #[must_use]
    pub fn bending_rigidity(&self) -> f64 {
        self.stretching_modulus() * self.thickness * self.thickness / 12.0
    }
}

/// Which second derivatives are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HessianPart {
    /// A positive semi-definite approximation: what remains when compressive geometric stiffness
    /// and terms linear in the curvature are dropped. The metric of descent methods.
    Positive,
    /// Everything; indefinite where the sheet buckles.
    Full,
}

/// An effect with an energy `U(x; l̄)`.
pub trait Energy: Send + Sync {
    /// Name under which the ledger and `inspect` list it.
    fn name(&self) -> &str;

    /// Takes notice of new optimal lengths; called before the first evaluation.
    fn set_rest_metric(&mut self, sheet: &Sheet, metric: &RestMetric);

    /// The energy at `shape`; with `gradient` given, `∂U/∂x_i` is **added** to `gradient[i]`.
    fn evaluate(&mut self, shape: &Shape<'_>, gradient: Option<&mut [Vec3]>) -> f64;

    /// Adds second derivatives (blocks `∂²U/∂x_i∂x_j`, j ≥ i) to `into`.
    fn add_hessian(&mut self, shape: &Shape<'_>, part: HessianPart, into: &mut BlockMatrix);

    /// Size of the force on a vertex at unit strain, for tolerances; 0 if it has none.
    fn force_scale(&self) -> f64 {
        0.0
    }
}
