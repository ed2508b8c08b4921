//! Explicit integration of shape and chemistry together, for comparison.
//!
//! ```text
//! euler (the paper's simultaneous update)   x += -Δt/drag ∂U/∂x,   c += Δt (D Δc + R),   q += Δt f,   Δt fixed
//! tsit45                                    Runge-Kutta of order 5 under error control
//! ```
//!
//! Both rows need storage. The step is bound by the fastest elastic wave under drag,
//! `Δt < 2 drag/λ_max(H)`, however slow the motion: this is what implicit methods are measured
//! against. The paper's other procedure, bounded descent between steps of the chemistry, is
//! `quasi-static` with `integrator = { kind = "staggered", method = "euler" }` and
//! `equilibrium = { method = "descent" }`.

use serde::{Deserialize, Serialize};

use super::monolithic::Monolithic;
use super::{
    Integrator, IntegratorSpec, Result, SolveError, StepReport, Workspace, counters,
    end_of_fixed_step, fixed_step, scaled,
};
use crate::model::{Coupled, MassWeights, State, Subsystem};
use crate::num::checked::Positive;
use crate::ode::OdeMethod;

/// Parameters of the explicit integrator in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExplicitSpec {
    /// The method.
    #[serde(default)]
    pub method: ExplicitMethod,
    /// Euler: the fixed step, 0.01 if not given. Tsit45: the first step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<Positive>,
    /// Relative tolerance (tsit45).
    #[serde(default = "super::monolithic::default_rtol")]
    pub rtol: Positive,
    /// Absolute tolerance, in units of the mean edge and of each species' typical magnitude
    /// (tsit45).
    #[serde(default = "super::monolithic::default_atol")]
    pub atol: Positive,
}

/// Explicit methods.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ExplicitMethod {
    /// The paper's: a fixed step, first order.
    #[default]
    Euler,
    /// Runge-Kutta of Tsitouras, order 5.
    Tsit45,
}

/// Fixed step of a scene that gives none.
const DEFAULT_STEP: f64 = 0.01;
/// How far a fixed step may leave a species' valid range and be brought back, relative to its size
/// and typical magnitude.
const RANGE_SLACK: f64 = 1e-2;

#[typetag::serialize(name = "explicit")]
impl IntegratorSpec for ExplicitSpec {
    fn name(&self) -> String {
        match self.method {
            ExplicitMethod::Euler => "explicit, Euler".into(),
            ExplicitMethod::Tsit45 => "explicit, Tsit45".into(),
        }
    }

    fn keeps_constraints(&self) -> bool {
        self.method == ExplicitMethod::Euler
    }

    fn keeps_step_limits(&self) -> bool {
        false
    }

    fn integrates_internal(&self) -> bool {
        self.method == ExplicitMethod::Euler
    }

    fn at_tolerance(&self, tolerance: Positive, until: Positive) -> Box<dyn IntegratorSpec> {
        let (rtol, atol) = scaled(tolerance, self.rtol, self.atol);
        let step = match self.method {
            ExplicitMethod::Euler => Some(fixed_step(tolerance, until)),
            ExplicitMethod::Tsit45 => self.step,
        };
        Box::new(Self { rtol, atol, step, ..self.clone() })
    }

    fn atol(&self) -> Option<f64> {
        (self.method == ExplicitMethod::Tsit45).then(|| self.atol.get())
    }

    fn rtol(&self) -> Option<f64> {
        (self.method != ExplicitMethod::Euler).then(|| self.rtol.get())
    }

    fn explicit_step(&self) -> Option<f64> {
        let euler = self.method == ExplicitMethod::Euler;
        euler.then(|| self.step.map_or(DEFAULT_STEP, Positive::get))
    }

    fn build(&self, policy: MassWeights) -> Result<Box<dyn Integrator>> {
        if policy.mechanics == 0.0 || policy.chemistry == 0.0 {
            let row = if policy.mechanics == 0.0 { "shape" } else { "chemistry" };
            return Err(SolveError::Pairing(format!(
                "an explicit integrator needs a rate for every unknown, but under this policy the \
                 {row} has none: choose policy = \"simultaneous\", or an integrator that solves \
                 for the {row}: staggered, monolithic"
            )));
        }
        let step = self.step.map(Positive::get);
        let tolerance = (self.rtol.get(), self.atol.get());
        Ok(match self.method {
            ExplicitMethod::Euler => {
                Box::new(Euler { step: step.unwrap_or(DEFAULT_STEP), coupled: None })
            }
            ExplicitMethod::Tsit45 => {
                Box::new(Monolithic::new(Subsystem::Whole, OdeMethod::Tsit45, tolerance, step))
            }
        })
    }
}

crate::register_kind!(dyn IntegratorSpec, "explicit", ExplicitSpec);

/// The paper's simultaneous update.
struct Euler {
    step: f64,
    coupled: Option<Coupled>,
}

impl Integrator for Euler {
    fn advance(
        &mut self,
        workspace: &mut Workspace,
        state: &mut State,
        until: f64,
    ) -> Result<StepReport> {
        workspace.control.check()?;
        let time = end_of_fixed_step(state.time, self.step, until);
        let step = time - state.time;
        let flow = workspace.at(state).internal_rates()?;
        let model = &workspace.model;
        let _scope = counters::part(model.tally(), counters::EXPLICIT);
        let coupled = self.coupled.get_or_insert_with(|| Coupled::new(model, Subsystem::Whole));
        coupled.start(state);
        let mut y = coupled.pack(state);
        let mut rate = vec![0.0; y.len()];
        coupled.residual(state.time, &y, &mut rate)?;
        for ((y, rate), mass) in y.iter_mut().zip(&rate).zip(coupled.mass()) {
            *y += step * rate / mass;
        }
        if !y.iter().all(|y| y.is_finite()) {
            return Err(SolveError::NotFinite);
        }
        let mut next = state.clone();
        for (q, rate) in next.internal.iter_mut().zip(&flow) {
            q.iter_mut().zip(rate).for_each(|(q, rate)| *q += step * rate);
        }
        coupled.layout().unpack(model.mechanics(), time, &y, &mut next);
        model.hold(time, &mut next.species);
        next.step += 1;
        model.keep_in_range(&mut next.species, time, (RANGE_SLACK, RANGE_SLACK))?;
        workspace.project(&mut next)?;
        let mut report = StepReport { length: step, ..StepReport::default() };
        report.relaxation.residual = workspace.reported_residual(&next)?;
        *state = next;
        Ok(report)
    }
}
