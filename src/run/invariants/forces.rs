//! A free sheet pulls on nothing: its forces and torques add up to zero.
//!
//! ```text
//! value = max( |Σ f_i| / Σ |f_i|,  |Σ (x_i - x̄) × f_i| / Σ |x_i - x̄| |f_i| )
//! ```
//!
//! with the force f_i = -∂U/∂x_i of every effect on every vertex in the denominators, and their sum in the
//! numerators; x̄ is the mean position. The sum of sizes is not taken to be below what counts as rest at every
//! vertex, so that round-off in a sheet without forces counts as none. Pins and loads from outside count: on a sheet that
//! is held or pushed the sum is what they carry.

use super::{Invariant, InvariantValue, Step};
use crate::Vec3;
use crate::model::{Evaluation, Model, State};
use crate::num::real;
use crate::run::Result;
use crate::scene::Scene;
use crate::solve::Workspace;

/// The law; it remembers nothing.
pub(super) struct FreeBalance;

/// Forces on a sheet.
struct Sums {
    force: Vec3,
    torque: Vec3,
    /// Of the sizes.
    forces: f64,
    torques: f64,
    /// Of single effects.
    net: Vec<Vec3>,
}

impl Sums {
    /// At the shape `x` under the conditions of `at`.
    fn of(at: &mut Evaluation<'_>, x: &[Vec3]) -> Result<Self> {
        let planar = at.model().mechanics().is_planar();
        let centre = x.iter().sum::<Vec3>() / real(x.len().max(1));
        let effects = at.model().mechanics().terms().len();
        let potential = at.potential()?;
        let mut sums = Self {
            force: Vec3::zeros(),
            torque: Vec3::zeros(),
            forces: 0.0,
            torques: 0.0,
            net: Vec::new(),
        };
        for k in 0..effects {
            let mut net = Vec3::zeros();
            for (mut f, x) in potential.force_of(k, x).into_iter().zip(x) {
                if planar {
                    f.z = 0.0;
                }
                let arm = x - centre;
                net += f;
                sums.torque += arm.cross(&f);
                sums.forces += f.norm();
                sums.torques += arm.norm() * f.norm();
            }
            sums.force += net;
            sums.net.push(net);
        }
        Ok(sums)
    }

    /// The effect with the largest net force.
    fn largest(&self, model: &Model) -> Option<String> {
        let sizes = model.mechanics().names().zip(&self.net);
        let largest = sizes.max_by(|a, b| a.1.norm_squared().total_cmp(&b.1.norm_squared()))?;
        Some(format!("{} pulls with {:.2e}", largest.0, largest.1.norm()))
    }
}

impl FreeBalance {
    /// For `scene`.
    ///
    /// # Errors
    /// A scene without forces, with the place in it.
    pub(super) fn of(scene: &Scene, model: &Model) -> Result<Self> {
        if model.mechanics().is_empty() {
            let message = "no effect of the scene has a force";
            return Err(scene.error_at("invariants.force", message, None).into());
        }
        Ok(Self)
    }
}

fn reading(workspace: &mut Workspace, state: &State) -> Result<InvariantValue> {
    let tolerance = workspace.force_tolerance();
    let model = workspace.model.clone();
    let mut at = workspace.at(state);
    let sums = Sums::of(&mut at, &state.x)?;
    let rest = tolerance * at.potential()?.force_scale();
    let centre = state.x.iter().sum::<Vec3>() / real(state.x.len().max(1));
    let arms: f64 = state.x.iter().map(|x| (x - centre).norm()).sum();
    let force = sums.force.norm() / sums.forces.max(rest * real(state.x.len()));
    let torque = sums.torque.norm() / sums.torques.max(rest * arms);
    let what = if force >= torque { "net force" } else { "net torque" };
    let place = format!("{what}; of single effects {}", sums.largest(&model).unwrap_or_default());
    let row = vec![sums.force.norm(), force, sums.torque.norm(), torque];
    let value = if force.is_nan() { force } else { torque.max(force) };
    Ok(InvariantValue { row, value, place, memory: Vec::new() })
}

impl Invariant for FreeBalance {
    fn name(&self) -> String {
        "the balance of forces and torques of a free sheet (relative)".into()
    }

    fn advice(&self) -> &'static str {
        "forces balance where no pin, load, foundation or pressure on an open sheet acts: leave the limit out there; \
         an effect whose energy changes under rigid motion is wrong (rumple::kit::examine)"
    }

    fn columns(&self) -> Vec<String> {
        [
            "net force [force]",
            "relative net force",
            "net torque [force length]",
            "relative net torque",
        ]
        .map(str::to_owned)
        .to_vec()
    }

    fn begin(&mut self, workspace: &mut Workspace, state: &State) -> Result<InvariantValue> {
        reading(workspace, state)
    }

    fn inspect(&mut self, step: &mut Step<'_>, _: &[f64]) -> Result<InvariantValue> {
        reading(step.workspace, step.after)
    }
}
