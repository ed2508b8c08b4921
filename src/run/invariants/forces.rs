//! A free sheet pulls on nothing: its forces and torques add up to zero.
//!
//! ```text
//! value = max( |Σ f_i| / Σ |f_i|,  |Σ (x_i - x̄) × f_i| / Σ |x_i - x̄| |f_i| )
//! ```
//!
//! with the force f_i = -∂U/∂x_i of every effect on every vertex in the denominators, and their sum in the
//! numerators; x̄ is the mean position. The sum of sizes is not taken to be below what counts as rest at every
//! vertex, so that round-off in a sheet without forces counts as none.

use super::{Invariant, InvariantValue, Step};
use crate::Vec3;
use crate::model::{Evaluation, State};
use crate::num::real;
use crate::run::Result;
use crate::scene::Scene;
use crate::solve::Workspace;

/// Bound of round-off at the start.
const ROUND_OFF: f64 = 1e-8;

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
    fn largest(&self, model: &crate::model::Model) -> Option<String> {
        let sizes = model.mechanics().names().zip(&self.net);
        let largest = sizes.max_by(|a, b| a.1.norm_squared().total_cmp(&b.1.norm_squared()))?;
        Some(format!("{} pulls with {:.2e}", largest.0, largest.1.norm()))
    }
}

impl FreeBalance {
    /// For `scene`.
    ///
    /// # Errors
    /// A sheet that is held or pushed from outside, with the place in the scene.
    pub(super) fn of(scene: &Scene, workspace: &mut Workspace, state: &State) -> Result<Self> {
        let path = "invariants.force";
        let refuse =
            |message: &str, help: Option<&str>| Err(scene.error_at(path, message, help).into());
        let model = workspace.model.clone();
        let mechanics = model.mechanics();
        if mechanics.is_empty() {
            return refuse("no effect of the scene has a force", None);
        }
        let plane = if mechanics.is_planar() { 2 } else { 3 };
        if let Some(v) = mechanics.pins().iter().position(|p| p[..plane].contains(&true)) {
            let message =
                format!("this sheet is not free: pins hold vertex {v}, and push back on the sheet");
            return refuse(&message, Some("leave force out, or the pins"));
        }
        // Deformed, so that what holds the sheet in its place shows; at several times because of ramps.
        let edge = (mechanics.reference().area().iter().sum::<f64>()
            / real(model.sheet().triangle_count().max(1)))
        .sqrt();
        let mut x = state.x.clone();
        for (i, x) in x.iter_mut().enumerate() {
            let wave = |a: usize| (real(7 * i + 3 * a + 1) * 0.61).sin();
            *x += 0.05 * edge * Vec3::new(0.3 + wave(0), 0.2 + wave(1), 0.0);
            if !mechanics.is_planar() {
                x.z += 0.05 * edge * (0.4 + wave(2));
            }
        }
        let until = scene.time.span.until.get();
        for time in [0.0, 0.31 * until, 0.62 * until, until] {
            let moved = State { time, ..state.clone() };
            let sums = Sums::of(&mut workspace.at(&moved), &x)?;
            if sums.force.norm() > ROUND_OFF * sums.forces {
                let message = format!(
                    "this sheet is pushed from outside with a net force of {:.2e} at time {time} ({})",
                    sums.force.norm(),
                    sums.largest(&model).unwrap_or_default()
                );
                let help = "forces of a sheet balance where no load, foundation or pressure on an open sheet \
                            acts: leave force out, or let loads balance";
                return refuse(&message, Some(help));
            }
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
        "look for a load that begins with time or an effect that pushes from outside; a law of growth or an \
         effect whose energy changes under rigid motion is wrong (rumple::kit::examine)"
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
