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
use super::{Equilibrium, Goal, Relaxation};
use crate::Vec3;
use crate::model::{Mechanics, Potential};
use crate::num::checked::{AtLeast, Fraction, Positive};
use crate::parallel;
use crate::solve::{EquilibriumSpec, SolveError};

/// Settings of [`Fire`]; parameters of `equilibrium.method = "fire"` in a scene.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FireSpec {
    /// Largest force on a vertex that counts as rest, in units of the force at unit strain
    /// (Y times the edge length).
    pub tolerance: Positive,
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
            tolerance: const { Positive::constant(1e-6) },
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

    fn tolerance(&self) -> f64 {
        self.tolerance.get()
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
const FIRST: f64 = 0.1;
/// Longest time step; explicit motion of a triangular lattice is unstable above about 0.9.
const LONGEST: f64 = 0.8;
/// Shortest time step before giving up.
const SHORTEST: f64 = 1e-9;
/// Downhill steps before the time step may grow.
const DELAY: usize = 20;
/// Growth of the time step.
const GROWTH: f64 = 1.1;
/// Shrinking of the time step after an uphill step.
const SHRINK: f64 = 0.5;
/// Steering towards the force at first.
const STEER: f64 = 0.25;
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

impl Equilibrium for Fire {
    fn relax(
        &mut self,
        potential: &mut Potential,
        x: &mut [Vec3],
        goal: &Goal<'_>,
    ) -> Result<Relaxation, SolveError> {
        let n = x.len();
        let mut gradient = vec![Vec3::zeros(); n];
        let (mut velocity, mut trial) = (gradient.clone(), gradient.clone());
        let edge = potential.metric().mean_edge();
        let reduction = potential.reduction().clone();
        let unit = (edge / potential.force_scale()).sqrt();
        let longest_move = self.options.largest_move.get() * edge;
        let share = self.options.area_share.get();
        let energy = potential.energy_gradient(x, &mut gradient);
        let residual = potential.residual(&gradient);
        let mut done = Relaxation { energy, residual, ..Relaxation::default() };
        let (mut step, mut steer, mut downhill) = (FIRST, STEER, 0);
        while !reached(potential, &done, goal, x)? {
            let uphill = reduction.dot(&gradient, &velocity) >= 0.0;
            if uphill {
                let back = 0.5 * step * unit;
                parallel::fill(&mut trial, |i| x[i] - back * velocity[i]);
                if potential.allows(x, &trial, share) {
                    x.copy_from_slice(&trial);
                }
                // The very first step starts from rest: nothing to be blamed for.
                if done.iterations > 0 {
                    step *= SHRINK;
                }
                (steer, downhill) = (STEER, 0);
                velocity.fill(Vec3::zeros());
            } else {
                downhill += 1;
                if downhill > DELAY {
                    step = (GROWTH * step).min(LONGEST);
                    steer *= STEER_DECAY;
                }
            }
            // A move that would collapse a triangle is made shorter, from rest.
            loop {
                let dt = step * unit;
                parallel::update(&mut velocity, |i, v| *v -= dt * gradient[i]);
                let (speed, force) = (
                    reduction.dot(&velocity, &velocity).sqrt(),
                    reduction.dot(&gradient, &gradient).sqrt(),
                );
                let turn = steer * speed / force;
                parallel::update(&mut velocity, |i, v| {
                    *v = (1.0 - steer) * *v - turn * gradient[i];
                });
                let scale = (longest_move / (dt * reduction.largest(&velocity))).min(1.0);
                if scale < 1.0 {
                    parallel::update(&mut velocity, |_, v| *v *= scale);
                }
                parallel::fill(&mut trial, |i| x[i] + dt * velocity[i]);
                if potential.allows(x, &trial, share) {
                    break;
                }
                velocity.fill(Vec3::zeros());
                (steer, downhill) = (STEER, 0);
                step *= SHRINK;
                if !(step >= SHORTEST) {
                    return Err(stalled(&done, goal));
                }
            }
            x.copy_from_slice(&trial);
            done.energy = potential.energy_gradient(x, &mut gradient);
            done.residual = potential.residual(&gradient);
            iterated(&mut done, potential);
            if !(step >= SHORTEST) {
                return Err(stalled(&done, goal));
            }
        }
        Ok(done)
    }
}
