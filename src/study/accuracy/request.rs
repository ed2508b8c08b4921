//! Options of a study, and their validation against the scene.

use std::path::Path;

use super::{Quantity, Study};
use crate::kinetics::PluginSearch;
use crate::model::Model;
use crate::num::Short;
use crate::num::checked::Positive;
use crate::run::{Error, Result, Simulation};
use crate::scene::Scene;
use crate::study::plan::{Axis, Plan};

/// Options of a study.
#[derive(Debug, Clone)]
pub struct Options {
    /// Integrators, names or tables; the usual ones of the policy if there are none.
    pub integrators: Vec<String>,
    /// Tolerances.
    pub tolerances: Vec<Positive>,
    /// Force tolerances; that of the scene if there are none.
    pub forces: Vec<Positive>,
    /// Integrators of the references; those of the policy if there are none.
    pub references: Vec<String>,
    /// A study with its sweep whose references are taken.
    pub taken: Option<(Study, Plan)>,
    /// Further seeds.
    pub seeds: u16,
    /// Wall time of a run, s; references have `PATIENCE` times as much.
    pub limit: u64,
    /// The target error.
    pub wanted: f64,
    /// Quantity of the target error.
    pub of: Option<Quantity>,
}

/// Usual number of repetitions of short runs, to time them.
pub const DEFAULT_REPEATS: u16 = 3;

impl Default for Options {
    fn default() -> Self {
        let tolerances = [1e-1, 1e-2, 1e-3, 1e-4].into_iter().filter_map(Positive::new).collect();
        Self {
            integrators: Vec::new(),
            tolerances,
            forces: Vec::new(),
            references: Vec::new(),
            taken: None,
            seeds: 2,
            limit: 300,
            wanted: 0.01,
            of: None,
        }
    }
}

/// The tightest tolerance that can be met: numbers of 64 bits have 16 digits, and an error is a difference.
pub(super) const TIGHTEST_TOLERANCE: f64 = 1e-13;

impl Options {
    /// The least force tolerance, that `of_scene` included.
    pub(super) fn tightest_force(&self, of_scene: f64) -> f64 {
        self.forces.iter().map(|f| f.get()).fold(of_scene, f64::min)
    }

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
        search: &PluginSearch,
    ) -> Result<()> {
        if let Some(t) = self.tolerances.iter().find(|t| t.get() < TIGHTEST_TOLERANCE) {
            return Err(Error::Refused(format!(
                "--tolerances {}: below {TIGHTEST_TOLERANCE:e}, which no run can meet in numbers of 16 digits",
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
