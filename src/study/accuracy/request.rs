//! Validation of what is asked of a study against its scene, before any run is made.

use std::path::Path;

use super::{Options, Quantity};
use crate::kinetics::Search;
use crate::model::Model;
use crate::num::Short;
use crate::run::{Error, Result, Simulation};
use crate::scene::Scene;
use crate::study::plan::{Axis, Plan};

/// The tightest tolerance that can be met: numbers of 64 bits have 16 digits, and an error is a difference.
pub(super) const TIGHTEST: f64 = 1e-13;

impl Options {
    /// Refuses what the scene file `scene` with `set` and the first of every one of `others` cannot have: errors of
    /// what it has not, tolerances that nothing meets.
    ///
    /// # Errors
    /// The option, and what the scene lacks.
    pub fn check(
        &self,
        scene: &Path,
        set: &[String],
        others: &[Axis],
        search: &Search,
    ) -> Result<()> {
        if let Some(t) = self.tolerances.iter().find(|t| t.get() < TIGHTEST) {
            return Err(Error::Refused(format!(
                "--tolerances {}: below {TIGHTEST:e}, which no run can meet in numbers of 16 digits",
                Short(t.get())
            )));
        }
        let first: Vec<String> = others.iter().flat_map(|axis| axis.overrides(0)).collect();
        let scene = Scene::varied(scene, set, &first)?;
        // Its own integrator may not go with it: others may.
        let Ok(simulation) = Simulation::new(&scene, search) else { return Ok(()) };
        let model = simulation.model();
        if !self.forces.is_empty() && !model.moves() {
            let message = "--force-tolerances: nothing moves in this scene, so there are no forces";
            return Err(Error::Refused(message.into()));
        }
        self.of.map_or(Ok(()), |of| has(model, of))
    }
}

impl Quantity {
    /// Refuses it where the scene of `plan` has nothing that it could be measured of.
    ///
    /// # Errors
    /// What the scene lacks.
    pub fn check(self, plan: &Plan) -> Result<()> {
        let simulation = plan.scene(0).ok().and_then(|s| Simulation::new(&s, &plan.search()).ok());
        simulation.map_or(Ok(()), |simulation| has(simulation.model(), self))
    }
}

fn has(model: &Model, of: Quantity) -> Result<()> {
    let lacks = match of {
        Quantity::Shape | Quantity::Amplitude | Quantity::Buckling if !model.moves() => {
            "nothing moves in this scene"
        }
        Quantity::Species | Quantity::Spots | Quantity::Separation
            if model.chemistry().is_none() =>
        {
            "this scene has no species"
        }
        _ => return Ok(()),
    };
    Err(Error::Refused(format!("--of: {lacks}, so the {} has no error", of.name())))
}
