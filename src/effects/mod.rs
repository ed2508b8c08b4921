//! The effects a scene can list: each file holds one, from its equation to its derivatives.
//!
//! An effect plays one of three roles: it has an [`Energy`], it takes directions away from the
//! motion (a pin), or it moves a species about (diffusion). What a scene does not list is not
//! built.

mod bending;
mod diffusion;
mod element;
mod green_gauss;
mod load;
mod pin;
mod pressure;
mod region;
mod stretching;

pub use bending::{Bending, BendingModel, BendingWeight, HingeBending, MeyerBending};
pub use diffusion::{Cotan, Diffusion, DiffusionMetric, DiffusionScheme};
pub use green_gauss::GreenGauss;
pub use load::{DeadLoad, Load, LoadForce};
pub use pin::{Axes, Pin};
pub use pressure::{FollowerPressure, Pressure};
pub use region::Region;
pub use stretching::{
    BondStretching, Stretching, StretchingModel, StretchingModulus, StretchingWeight,
    StvkStretching,
};

use crate::Vec3;
use crate::geometry::{AreaRule, RestMetric, Shape};
use crate::kinetics::{Descriptor, Location};
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

/// An effect as a scene lists it: its kind and parameters, not yet bound to a sheet.
#[typetag::serde(tag = "kind")]
pub trait EffectSpec: std::fmt::Debug + Send + Sync {
    /// What the effect is called in results.
    fn name(&self) -> String;

    /// The rule by which it gives areas to vertices, if it has one: the scene's signals, fields and
    /// reports then go by the same.
    fn vertex_area(&self) -> Option<AreaRule> {
        None
    }

    /// Binds it to a sheet, a material and the species there are.
    ///
    /// # Errors
    /// A parameter that does not fit the sheet or the kinetics.
    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError>;

    /// What it does there that the author of a scene may not have meant.
    fn notes(&self, _context: &EffectContext<'_>) -> Vec<String> {
        Vec::new()
    }
}

/// What an effect is bound to.
#[derive(Clone, Copy)]
pub struct EffectContext<'a> {
    /// The sheet in its rest state.
    pub sheet: &'a Sheet,
    /// Its material.
    pub material: &'a Material,
    /// Species, if the scene has kinetics.
    pub kinetics: Option<(&'a Descriptor, Location)>,
    /// What the values of species are per.
    pub measure: Measure,
}

/// What a species' value is an amount per.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Measure {
    /// Current area; growth does not dilute (the paper has no dilution term).
    #[default]
    Concentration,
    /// Rest area; growth dilutes, and the total is conserved.
    Amount,
}

/// A parameter of an effect that does not fit, with the key to blame.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct EffectError {
    /// The key in the effect's table.
    pub key: &'static str,
    /// What is wrong.
    pub message: String,
    /// What would be right.
    pub help: Option<String>,
}

/// The error for a key that `model` does not have, but `other` has.
fn misplaced(key: &'static str, model: &str, reason: &str, other: &str) -> EffectError {
    EffectError {
        key,
        message: format!("model = \"{model}\" has no {key}: it {reason}"),
        help: Some(format!("leave {key} out, or choose model = \"{other}\"")),
    }
}

/// An effect bound to a sheet, by its role.
pub enum Effect {
    /// It has an energy.
    Energy(Box<dyn Energy>),
    /// It holds these directions.
    Pins(Vec<[bool; 3]>),
    /// It moves a species about.
    Transport(Box<dyn Transport>),
}

/// Transport of one species, `dc/dt = … + transport(c)`, linear in c.
pub trait Transport: Send + Sync {
    /// Number of the species in the kinetics' descriptor.
    fn species(&self) -> usize;

    /// Takes notice of a new shape.
    fn update(&mut self, sheet: &Sheet, x: &[Vec3]);

    /// Adds the rate of change to `out`.
    fn add_rate(&self, sheet: &Sheet, c: &[f64], out: &mut [f64]);

    /// A bound on the largest decay rate, 1/time.
    fn spectral_bound(&self) -> f64;

    /// Hands the matrix of the transport to `emit` as (point, by point, value); order and pairs
    /// depend on the sheet alone, pairs may come more than once.
    fn entries(&self, sheet: &Sheet, emit: &mut dyn FnMut(usize, usize, f64));

    /// Hands the derivatives of the rate at `c` by positions to `emit` as (point, by vertex, vector),
    /// in an order that depends on the sheet alone.
    fn shape_derivatives(
        &self,
        sheet: &Sheet,
        x: &[Vec3],
        c: &[f64],
        emit: &mut dyn FnMut(usize, usize, Vec3),
    );
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
    /// Name under which the ledger and `inspect` list it; they number those that share one.
    fn name(&self) -> &str;

    /// Takes notice of new optimal lengths; called before the first evaluation.
    fn set_rest_metric(&mut self, sheet: &Sheet, metric: &RestMetric);

    /// The energy at `shape`; with `gradient` given, `∂U/∂x_i` is **added** to `gradient[i]`.
    fn evaluate(&mut self, shape: &Shape<'_>, gradient: Option<&mut [Vec3]>) -> f64;

    /// Adds second derivatives (blocks `∂²U/∂x_i∂x_j`, j ≥ i) to `into`.
    fn add_hessian(&mut self, shape: &Shape<'_>, part: HessianPart, into: &mut BlockMatrix);

    /// Hands all `∂²U/∂x_i∂l̄_e` that can be different from zero to `emit` as (i, e, vector): how the
    /// forces change with the optimal lengths. Which pairs come in which order depends on the sheet
    /// alone; a pair may come more than once, and then counts as the sum. Nothing for an energy
    /// that knows no optimal lengths.
    fn metric_derivatives(
        &mut self,
        _shape: &Shape<'_>,
        _emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
    }

    /// Size of the force on a vertex at unit strain, for tolerances; 0 if it has none.
    fn force_scale(&self) -> f64 {
        0.0
    }

    /// Largest force on a vertex that is given from outside, as it is on the sheet at rest; 0 if
    /// none is.
    fn applied_force(&self) -> f64 {
        0.0
    }
}
