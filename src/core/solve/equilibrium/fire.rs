//! Fast inertial relaxation engine (FIRE): damped motion with mass that never runs uphill for long.
//!
//! ```text
//! P = f · v,   f = -∂U/∂x                                 power
//! P > 0 for more than 20 steps:   Δt ← min(1.1 Δt, Δt_max),  α ← 0.99 α
//! P ≤ 0:   x ← x - ½ Δt v,  v ← 0,  Δt ← ½ Δt,  α ← 0.25
//! v ← v + Δt f,   v ← (1 - α) v + α |v| f/|f|,   x ← x + Δt v
//! ```
//!
//! with unit mass. Times are in units of `(force scale / mean edge)^-½`, the time in which a vertex
//! answers to one bond. Inertia brings the number of steps from the condition number (steepest
//! descent) to its root, at the price that the energy may rise for some steps and a low barrier may
//! be crossed: the minimum found need not be the one of the overdamped motion.
//!
//! References: Bitzek, Koskinen, Gähler, Moseler & Gumbsch, Phys. Rev. Lett. 97 (2006) 170201,
//! doi:10.1103/PhysRevLett.97.170201; the form above with its constants after Guénolé et al.,
//! Comput. Mater. Sci. 175 (2020) 109584, doi:10.1016/j.commatsci.2020.109584.

use serde::{Deserialize, Serialize};

use super::stop::{iterated, reached, stalled};
use super::{Equilibrium, ForceTolerance, Goal, Relaxation};
use crate::Vec3;
use crate::model::{Mechanics, Potential};
use crate::num::checked::{AtLeast, Fraction, Positive};
use crate::parallel;
use crate::solve::{EquilibriumSpec, SolveError};

/// Settings of [`Fire`]; parameters of `equilibrium.method = "fire"` in a scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FireSpec {
    /// Largest force on a vertex that counts as rest.
    pub tolerance: ForceTolerance,
    /// Iterations after which a relaxation has failed.
    pub max_iterations: AtLeast<1>,
    /// Largest move of a vertex in one step, in mean edge lengths.
    pub largest_move: Positive,
    /// No triangle's area may fall below this share in one step.
    pub area_share: Fraction,
}

impl Default for FireSpec {
    fn default() -> Self {
        Self {
            tolerance: ForceTolerance::Auto,
            max_iterations: const { AtLeast::constant(200_000) },
            largest_move: const { Positive::constant(0.1) },
            area_share: const { Fraction::constant(0.4) },
        }
    }
}

#[typetag::serialize(name = "fire")]
impl EquilibriumSpec for FireSpec {
    fn name(&self) -> String {
        "FIRE, fast inertial relaxation".into()
    }

    fn tolerance(&self) -> ForceTolerance {
        self.tolerance
    }

    fn max_iterations(&self) -> usize {
        self.max_iterations.get()
    }

    fn build(&self, _: &Mechanics) -> Result<Box<dyn Equilibrium>, SolveError> {
        Ok(Box::new(Fire::new(*self)))
    }
}

crate::register_kind!(dyn EquilibriumSpec, "fire", FireSpec);

/// First time step, in the unit above.
const INITIAL_STEP: f64 = 0.1;
/// Longest time step; explicit motion of a triangular lattice is unstable above about 0.9.
const MAX_STEP: f64 = 0.8;
/// Shortest time step before giving up.
const MIN_STEP: f64 = 1e-9;
/// Downhill steps before the time step may grow.
const GROWTH_DELAY: usize = 20;
/// Growth of the time step.
const STEP_GROWTH: f64 = 1.1;
/// Shrinking of the time step after an uphill step.
const STEP_REDUCTION: f64 = 0.5;
/// Steering towards the force at first.
const INITIAL_STEERING: f64 = 0.25;
/// Its decay while all goes downhill.
const STEER_DECAY: f64 = 0.99;

/// FIRE for one sheet.
#[derive(Debug)]
pub struct Fire {
    options: FireSpec,
}

impl Fire {
    /// Ready for any sheet: nothing is prepared.
    #[must_use]
    pub fn new(options: FireSpec) -> Self {
        Self { options }
    }
}

/// A shape in motion.
struct Motion<'a> {
    x: &'a mut [Vec3],
    gradient: Vec<Vec3>,
    velocity: Vec<Vec3>,
    trial: Vec<Vec3>,
    /// Δt and its unit.
    step: f64,
    unit: f64,
    /// α.
    steer: f64,
    /// Steps downhill since the last one uphill.
    downhill: usize,
    /// Longest move of a vertex, and least share of a triangle's area that a step leaves.
    limits: (f64, f64),
}

impl Motion<'_> {
    /// Goes half a step back, and begins again from rest; `first` has come from nowhere.
    fn turn_back(&mut self, potential: &mut Potential, first: bool) {
        let back = 0.5 * self.step * self.unit;
        parallel::fill(&mut self.trial, |i| self.x[i] - back * self.velocity[i]);
        if potential.allows(self.x, &self.trial, self.limits.1) {
            self.x.copy_from_slice(&self.trial);
        }
        if !first {
            self.step *= STEP_REDUCTION;
        }
        self.stop();
    }

    fn stop(&mut self) {
        (self.steer, self.downhill) = (INITIAL_STEERING, 0);
        self.velocity.fill(Vec3::zeros());
    }

    fn record_downhill(&mut self) {
        self.downhill += 1;
        if self.downhill > GROWTH_DELAY {
            self.step = (STEP_GROWTH * self.step).min(MAX_STEP);
            self.steer *= STEER_DECAY;
        }
    }

    /// The velocity after Δt, and where it leads, into `trial`; returns whether triangles allow that.
    fn accelerate(&mut self, potential: &mut Potential) -> bool {
        let reduction = potential.reduction();
        let Self { velocity, gradient, steer, .. } = self;
        let (steer, dt) = (*steer, self.step * self.unit);
        parallel::update(velocity, |i, v| *v -= dt * gradient[i]);
        let speed = reduction.dot(velocity, velocity).sqrt();
        let force = reduction.dot(gradient, gradient).sqrt();
        let turn = steer * speed / force;
        parallel::update(velocity, |i, v| *v = (1.0 - steer) * *v - turn * gradient[i]);
        let scale = (self.limits.0 / (dt * reduction.largest(velocity))).min(1.0);
        if scale < 1.0 {
            parallel::update(velocity, |_, v| *v *= scale);
        }
        parallel::fill(&mut self.trial, |i| self.x[i] + dt * velocity[i]);
        potential.allows(self.x, &self.trial, self.limits.1)
    }
}

impl Equilibrium for Fire {
    fn relax(
        &mut self,
        potential: &mut Potential,
        x: &mut [Vec3],
        goal: &Goal<'_>,
    ) -> Result<Relaxation, SolveError> {
        let mut gradient = vec![Vec3::zeros(); x.len()];
        let (velocity, trial) = (gradient.clone(), gradient.clone());
        let edge = potential.metric().mean_edge();
        let unit = (edge / potential.force_scale()).sqrt();
        let limits = (self.options.largest_move.get() * edge, self.options.area_share.get());
        let energy = potential.energy_gradient(x, &mut gradient);
        let residual = potential.residual(&gradient);
        let mut done = Relaxation { energy, residual, ..Relaxation::default() };
        let (step, steer, downhill) = (INITIAL_STEP, INITIAL_STEERING, 0);
        let mut at = Motion { x, gradient, velocity, trial, step, unit, steer, downhill, limits };
        while !reached(potential, &done, goal, at.x)? {
            if potential.reduction().dot(&at.gradient, &at.velocity) >= 0.0 {
                at.turn_back(potential, done.iterations == 0);
            } else {
                at.record_downhill();
            }
            // A move that would collapse a triangle is made shorter, from rest.
            while !at.accelerate(potential) {
                at.stop();
                at.step *= STEP_REDUCTION;
                if !(at.step >= MIN_STEP) {
                    return Err(stalled(&done, goal));
                }
            }
            at.x.copy_from_slice(&at.trial);
            done.energy = potential.energy_gradient(at.x, &mut at.gradient);
            done.residual = potential.residual(&at.gradient);
            iterated(&mut done, potential);
            if !(at.step >= MIN_STEP) {
                return Err(stalled(&done, goal));
            }
        }
        Ok(done)
    }
}
