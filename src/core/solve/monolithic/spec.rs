//! Parameters of the monolithic integrator in a scene.

use serde::{Deserialize, Serialize};

use super::Monolithic;
use crate::linear::LinearChoice;
use crate::model::{MassWeights, Subsystem};
use crate::num::checked::Positive;
use crate::ode::OdeMethod;
use crate::solve::{Integrator, IntegratorSpec, Result, scaled};

/// Parameters of the monolithic integrator in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MonolithicSpec {
    /// The method.
    #[serde(default)]
    pub method: ImplicitMethod,
    /// Relative tolerance of displacements and species.
    #[serde(default = "default_rtol")]
    pub rtol: Positive,
    /// Absolute tolerance, in units of the mean edge and of each species' typical magnitude.
    #[serde(default = "default_atol")]
    pub atol: Positive,
    /// First step; chosen from the first rates if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<Positive>,
    /// How linear systems are solved.
    #[serde(default)]
    pub linear: LinearChoice,
}

/// diffsol's implicit methods.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ImplicitMethod {
    /// Backward differences of variable order 1 to 5.
    #[default]
    Bdf,
    /// Trapezoidal rule and second backward difference, order 2.
    TrBdf2,
    /// Singly diagonally implicit Runge-Kutta of order 3.
    Esdirk34,
}

impl From<ImplicitMethod> for OdeMethod {
    fn from(method: ImplicitMethod) -> Self {
        match method {
            ImplicitMethod::Bdf => Self::Bdf,
            ImplicitMethod::TrBdf2 => Self::TrBdf2,
            ImplicitMethod::Esdirk34 => Self::Esdirk34,
        }
    }
}

/// Tolerances below this one are made proportional to errors.
const PROPORTIONAL_BELOW: f64 = 1e-4;
/// Relative tolerances of a step are not below this: round-off would not let a step meet them.
const FINEST_RTOL: f64 = 1e-13;

pub(in crate::solve) fn default_rtol() -> Positive {
    const { Positive::constant(1e-4) }
}

pub(in crate::solve) fn default_atol() -> Positive {
    const { Positive::constant(1e-6) }
}

#[typetag::serialize(name = "monolithic")]
impl IntegratorSpec for MonolithicSpec {
    fn name(&self) -> String {
        format!("monolithic, {}", OdeMethod::from(self.method).name())
    }

    fn needs_sparse_motion(&self) -> bool {
        true
    }

    fn uses_jacobian(&self) -> bool {
        true
    }

    fn at_tolerance(&self, tolerance: Positive, _: Positive) -> Box<dyn IntegratorSpec> {
        let (rtol, atol) = scaled(tolerance, self.rtol, self.atol);
        Box::new(Self { rtol, atol, ..self.clone() })
    }

    fn atol(&self) -> Option<f64> {
        Some(self.atol.get())
    }

    fn rtol(&self) -> Option<f64> {
        Some(self.rtol.get())
    }

    fn build(&self, _: MassWeights) -> Result<Box<dyn Integrator>> {
        let tolerance = (self.rtol.get(), self.atol.get());
        let step = self.step.map(Positive::get);
        let made = Monolithic::new(Subsystem::Whole, self.method.into(), tolerance, step);
        let local_share = step_tolerance_share(self.method, self.rtol.get());
        Ok(Box::new(Monolithic { linear: self.linear, local_share, ..made }))
    }
}

/// The tolerance of the error of one step, relative to that of the solution.
///
/// A method of fixed order p that controls errors of `h^(p+1)` in a step errs by `tol^(p/(p+1))` at the end, far above a
/// tight tolerance. With `tol_step = tol (tol/tol₀)^(1/p)` the error of the solution goes with its tolerance (tolerance
/// proportionality; Shampine, Numerical Solution of Ordinary Differential Equations (1994), chapter 7).
fn step_tolerance_share(method: ImplicitMethod, rtol: f64) -> f64 {
    let order = match method {
        // Orders change, so that the error is nearly proportional to the tolerance itself.
        ImplicitMethod::Bdf => return 1.0,
        ImplicitMethod::TrBdf2 => 2.0,
        ImplicitMethod::Esdirk34 => 3.0,
    };
    let share = (rtol / PROPORTIONAL_BELOW).powf(1.0 / order);
    share.max(FINEST_RTOL / rtol).min(1.0)
}

crate::register_kind!(dyn IntegratorSpec, "monolithic", MonolithicSpec);
