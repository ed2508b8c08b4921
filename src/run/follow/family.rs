//! The models of a scene over one of its keys, on the sheet of the scene.
//!
//! The scene is read again with another value of the key, its laws and effects are bound again; the mesh is read once. So
//! a branch can be followed along any number, of which no effect and no law knows.

use std::path::PathBuf;
use std::sync::Arc;

use super::key::Key;
use super::refusals::OPTION_NAME;
use crate::kinetics::PluginSearch;
use crate::model::{Model, Potential, State};
use crate::run::{Result, setup};
use crate::scene::Scene;
use crate::sheet::Sheet;
use crate::solve::continuation::{Unknowns, imbalance};
use crate::tally::Tally;

/// A scene over the values of a key.
#[derive(Clone)]
pub(super) struct SceneFamily {
    pub(super) file: PathBuf,
    pub(super) set: Vec<String>,
    pub(super) search: PluginSearch,
    pub(super) key: Key,
    pub(super) sheet: Arc<Sheet>,
    pub(super) time: f64,
    /// Where the work on all its models is counted.
    pub(super) tally: Tally,
}

impl SceneFamily {
    /// The model at the value `parameter`, with a state at rest.
    ///
    /// # Errors
    /// A value that the scene cannot have, with its place.
    pub(super) fn member(&self, parameter: f64) -> Result<(Model, State)> {
        let over = self.key.set(parameter);
        let scene = Scene::varied(&self.file, &self.set, &over, OPTION_NAME)?;
        let with = (&self.search, &self.tally);
        let (model, state) = setup::model(&scene, &self.sheet, with)?;
        Ok((model, State { time: self.time_at(parameter), ..state }))
    }

    /// What is out of balance at `at` for the value `parameter`, and `at` with the fixed directions and values of that.
    ///
    /// # Errors
    /// As for [`Self::member`], and laws that fail.
    pub(super) fn imbalance(&self, parameter: f64, at: &Unknowns) -> Result<[Unknowns; 2]> {
        let (model, _) = self.member(parameter)?;
        let mut at = at.clone();
        let (found, _, _) = imbalance(&model, self.time_at(parameter), &mut at)?;
        Ok([found, at])
    }

    /// The time at which ramps and growth are evaluated.
    fn time_at(&self, parameter: f64) -> f64 {
        if self.key.is_time { parameter } else { self.time }
    }

    /// The potential at the value `parameter`.
    pub(super) fn potential(&self, parameter: f64) -> Result<Potential> {
        let (model, _) = self.member(parameter)?;
        let time = self.time_at(parameter);
        let factor = model.growth(time)?;
        let mut potential = Potential::new(model.mechanics());
        potential.set_conditions(factor.as_deref(), time);
        Ok(potential)
    }

    /// The model at the value `parameter`, with the time at which it is evaluated.
    pub(super) fn model(&self, parameter: f64) -> Result<(Arc<Model>, f64)> {
        let (model, state) = self.member(parameter)?;
        Ok((Arc::new(model), state.time))
    }
}
