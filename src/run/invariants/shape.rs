//! Laws of one shape: a free sheet pulls on nothing, no crossings.
//!
//! ```text
//! max( |Σ f_i| / Σ |f_i|,  |Σ (x_i - x̄) × f_i| / Σ |x_i - x̄| |f_i| ) = 0
//! ```
//!
//! with the force f_i = -∂U/∂x_i of every effect on every vertex in the denominators, and their sum in the
//! numerators; x̄ is the mean position. The sum of sizes is not taken to be below what counts as rest at every
//! vertex, so that round-off in a sheet without forces counts as none. Pins and loads from outside count: on a sheet that
//! is held or pushed the sum is what they carry.

use super::{InspectedStep, Monitor, Reading};
use crate::Vec3;
use crate::effects::NO_CROSSINGS_ADVICE;
use crate::geometry::Crossings;
use crate::num::real;
use crate::run::Result;
use crate::sheet::Sheet;

/// The balance of forces and torques.
pub(super) struct FreeBalance;

impl Monitor for FreeBalance {
    fn law(&self) -> (String, &'static str) {
        let advice = "forces balance where no pin, load, foundation or pressure on an open sheet acts: leave the limit out \
                      there; an effect whose energy changes under rigid motion is wrong (rumple::kit::examine)";
        ("the balance of forces and torques of a free sheet (relative)".into(), advice)
    }

    fn columns(&self) -> Vec<String> {
        let names =
            "net force [force]|relative net force|net torque [force length]|relative net torque";
        names.split('|').map(str::to_owned).collect()
    }

    fn inspect(&mut self, step: &mut InspectedStep<'_>, _: &mut Vec<f64>) -> Result<Reading> {
        let (tolerance, model) = (step.workspace.force_tolerance(), step.workspace.model.clone());
        let x = &step.after.x;
        let centre = x.iter().sum::<Vec3>() / real(x.len().max(1));
        let mut at = step.workspace.at(step.after);
        let potential = at.potential()?;
        let (mut force, mut torque, mut sizes) = (Vec3::zeros(), Vec3::zeros(), [0.0; 2]);
        let mut largest: (f64, &str) = (0.0, "");
        for (k, name) in model.mechanics().names().enumerate() {
            let mut net = Vec3::zeros();
            for (mut f, x) in potential.force_of(k, x).into_iter().zip(x.iter()) {
                if model.mechanics().is_planar() {
                    f.z = 0.0;
                }
                let arm = x - centre;
                net += f;
                torque += arm.cross(&f);
                sizes[0] += f.norm();
                sizes[1] += arm.norm() * f.norm();
            }
            force += net;
            if net.norm() >= largest.0 {
                largest = (net.norm(), name);
            }
        }
        let rest = tolerance * potential.force_scale();
        let arms: f64 = x.iter().map(|x| (x - centre).norm()).sum();
        let share = force.norm() / sizes[0].max(rest * real(x.len()));
        let twist = torque.norm() / sizes[1].max(rest * arms);
        let what = if share >= twist { "net force" } else { "net torque" };
        let place = format!("{what}; of single effects {} pulls with {:.2e}", largest.1, largest.0);
        let value = if share.is_nan() { share } else { twist.max(share) };
        Ok(Reading { row: vec![force.norm(), share, torque.norm(), twist], value, place })
    }
}

/// A sheet does not pass through itself; with the tree of boxes.
pub(super) struct NoCrossings(Crossings);

impl NoCrossings {
    /// For the shapes of `sheet`.
    pub(super) fn new(sheet: &Sheet) -> Self {
        Self(Crossings::new(sheet))
    }
}

impl Monitor for NoCrossings {
    fn law(&self) -> (String, &'static str) {
        (
            "the rule that a sheet does not pass through itself (pairs of triangles that cross)"
                .into(),
            NO_CROSSINGS_ADVICE,
        )
    }

    fn columns(&self) -> Vec<String> {
        vec!["crossings [pairs of triangles]".into()]
    }

    fn inspect(&mut self, step: &mut InspectedStep<'_>, _: &mut Vec<f64>) -> Result<Reading> {
        let (sheet, x) = (step.workspace.model.sheet(), &step.after.x);
        let found = self.0.find(sheet, x);
        let value = real(found.pairs);
        let place = if found.pairs > 0 { found.place(sheet, x) } else { String::new() };
        Ok(Reading { row: vec![value], value, place })
    }
}
