//! Steepest descent: the overdamped motion, followed by explicit Euler steps.
//!
//! ```text
//! dx/dτ = -∂U/∂x,     x_{n+1} = x_n - Δτ_n ∂U/∂x (x_n),     τ = t / drag
//! ```
//!
//! The path is the physical one for a sheet with the same drag on every vertex, so the minimum at
//! its end is the reference for all other methods. The paper moves vertices by this rule with a
//! fixed Δτ = Δt/γ; how many such steps it makes per chemical step is not stated. Here Δτ adapts:
//! a step counts only if
//!
//! ```text
//! U(x_{n+1}) ≤ U(x_n) - ½ Δτ |∂U/∂x (x_n)|²
//! ```
//!
//! which for a quadratic energy forbids every step that overshoots along the gradient
//! (Δτ > 1/curvature), so that stiff directions do not zigzag. Then Δτ grows by a tenth, otherwise
//! it is halved.
//!
//! It is slow: stretching limits Δτ to about 1/(5 Y), while the longest bending wave decays at the
//! rate `B k⁴ A_i`. The number of steps grows like Y/(B k⁴ A_i), 10⁹ for a disc of 100 edges in
//! radius and h = 0.5. It is here to be compared with.

use serde::{Deserialize, Serialize};

use super::stop::{iterated, reached, same_energy, stalled};
use super::{Equilibrium, ForceTolerance, Goal, Relaxation};
use crate::Vec3;
use crate::model::{Mechanics, Potential};
use crate::num::checked::{AtLeast, Fraction, Positive};
use crate::parallel;
use crate::record::{Malformed, Record};
use crate::solve::{EquilibriumSpec, SolveError};

/// Settings of [`Descent`]; parameters of `equilibrium.method = "descent"` in a scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DescentSpec {
    /// Largest force on a vertex that counts as rest.
    pub tolerance: ForceTolerance,
    /// Iterations after which a relaxation has failed.
    pub max_iterations: AtLeast<1>,
    /// A relaxation stops after this many steps, at rest or not, and that is not a failure: the bounded
    /// relaxation of the paper. Without it the shape comes to rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<AtLeast<1>>,
    /// Largest move of a vertex in one step, in mean edge lengths.
    pub largest_move: Positive,
    /// No triangle's area may fall below this share in one step.
    pub area_share: Fraction,
}

impl Default for DescentSpec {
    fn default() -> Self {
        Self {
            tolerance: ForceTolerance::Auto,
            max_iterations: const { AtLeast::constant(1_000_000) },
            steps: None,
            largest_move: const { Positive::constant(0.1) },
            area_share: const { Fraction::constant(0.4) },
        }
    }
}

#[typetag::serialize(name = "descent")]
impl EquilibriumSpec for DescentSpec {
    fn name(&self) -> String {
        match self.steps {
            None => "steepest descent (overdamped motion)".into(),
            Some(steps) => format!("steepest descent, at most {} steps", steps.get()),
        }
    }

    fn tolerance(&self) -> ForceTolerance {
        self.tolerance
    }

    fn max_iterations(&self) -> usize {
        self.max_iterations.get()
    }

    fn build(&self, _: &Mechanics) -> Result<Box<dyn Equilibrium>, SolveError> {
        Ok(Box::new(Descent::new(*self)))
    }
}

crate::register_kind!(dyn EquilibriumSpec, "descent", DescentSpec);

/// First step, in units of 1/stiffness of a bond.
const INITIAL_STEP: f64 = 0.05;
/// Growth of the step after a good one; a bad one halves it.
const STEP_GROWTH: f64 = 1.1;
/// Share of the linear decrease that a step must keep; ½ forbids overshooting.
const SUFFICIENT_DECREASE: f64 = 0.5;
/// Shortest step tried, as a share of the first.
const MIN_STEP_SHARE: f64 = 1e-10;

/// Steepest descent for one sheet.
#[derive(Debug)]
pub struct Descent {
    options: DescentSpec,
    /// The step that the last relaxation ended with, in units of 1/stiffness.
    step: f64,
}

impl Descent {
    /// Ready for any sheet: nothing is prepared.
    #[must_use]
    pub fn new(options: DescentSpec) -> Self {
        Self { options, step: INITIAL_STEP }
    }
}

impl Equilibrium for Descent {
    fn reaches_rest(&self) -> bool {
        self.options.steps.is_none()
    }

    fn relax(
        &mut self,
        potential: &mut Potential,
        x: &mut [Vec3],
        goal: &Goal<'_>,
    ) -> Result<Relaxation, SolveError> {
        let n = x.len();
        let mut gradient = vec![Vec3::zeros(); n];
        let (mut trial, mut trial_gradient) = (gradient.clone(), gradient.clone());
        let edge = potential.metric().mean_edge();
        let reduction = potential.reduction().clone();
        let longest = self.options.largest_move.get() * edge;
        let softness = edge / potential.force_scale();
        let energy = potential.energy_gradient(x, &mut gradient);
        let residual = potential.residual(&gradient);
        let mut done = Relaxation { energy, residual, ..Relaxation::default() };
        let enough = self.options.steps.map_or(usize::MAX, AtLeast::get);
        while done.iterations < enough && !reached(potential, &done, goal, x)? {
            let square = reduction.dot(&gradient, &gradient);
            let limit = longest / reduction.largest(&gradient);
            let step = (self.step * softness).min(limit);
            parallel::fill(&mut trial, |i| x[i] - step * gradient[i]);
            let mut accepted = None;
            if potential.allows(x, &trial, self.options.area_share.get()) {
                let energy = potential.energy_gradient(&trial, &mut trial_gradient);
                let descends = energy <= done.energy - SUFFICIENT_DECREASE * step * square;
                let level = same_energy(potential, done.energy, energy)
                    && reduction.dot(&gradient, &trial_gradient) >= 0.0;
                accepted = (energy.is_finite() && (descends || level)).then_some(energy);
            }
            let Some(energy) = accepted else {
                self.step = 0.5 * step / softness;
                if !(self.step >= MIN_STEP_SHARE) {
                    self.step = INITIAL_STEP;
                    return Err(stalled(&done, goal));
                }
                continue;
            };
            x.copy_from_slice(&trial);
            std::mem::swap(&mut gradient, &mut trial_gradient);
            done.energy = energy;
            done.residual = potential.residual(&gradient);
            iterated(&mut done, potential);
            self.step = STEP_GROWTH * self.step.max(step / softness);
        }
        Ok(done)
    }
    fn memory(&self) -> Record {
        Record::encode(&self.step)
    }

    fn restore(&mut self, memory: &Record, _: &Mechanics) -> Result<(), Malformed> {
        self.step = memory.read()?;
        Ok(())
    }
}
