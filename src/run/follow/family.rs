//! The potentials of a scene over one of its keys, on the sheet of the scene.
//!
//! The scene is read again with another value of the key and its effects are bound again; the mesh is read once. So a
//! branch can be followed along any number, of which no effect knows.

use std::path::PathBuf;
use std::sync::Arc;

use super::key::{Key, OPTION};
use crate::Vec3;
use crate::model::{Model, Potential, State};
use crate::run::{Error, Result, prepare};
use crate::scene::Scene;
use crate::sheet::Sheet;
use crate::solve::continuation::Family;
use crate::tally::Tally;

/// A scene over the values of a key.
pub(super) struct SceneFamily {
    pub(super) file: PathBuf,
    pub(super) set: Vec<String>,
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
    pub(super) fn model(&self, parameter: f64) -> Result<(Model, State)> {
        let over = self.key.set(parameter);
        let scene = Scene::varied_by(&self.file, &self.set, &over, OPTION)?;
        let (model, state) = prepare::mechanical_model(&scene, &self.sheet, &self.tally)?;
        Ok((model, State { time: self.time_at(parameter), ..state }))
    }

    /// The forces ∂U/∂x on the shape `x` at the value `parameter`, and the shape with the fixed directions of that.
    ///
    /// # Errors
    /// As for [`Self::model`].
    pub(super) fn gradient(&mut self, parameter: f64, x: &[Vec3]) -> Result<[Vec<Vec3>; 2]> {
        let mut potential = self.potential(parameter)?;
        let mut x = x.to_vec();
        potential.mechanics().set_prescribed(potential.time(), &mut x);
        let mut gradient = vec![Vec3::zeros(); x.len()];
        potential.energy_gradient(&x, &mut gradient);
        Ok([gradient, x])
    }

    /// The time at which ramps and growth are evaluated.
    fn time_at(&self, parameter: f64) -> f64 {
        if self.key.is_time { parameter } else { self.time }
    }
}

impl Family for SceneFamily {
    type Error = Error;

    fn potential(&mut self, parameter: f64) -> Result<Potential> {
        let (model, _) = self.model(parameter)?;
        let time = self.time_at(parameter);
        let factor = model.growth(time)?;
        let mut potential = Potential::new(model.mechanics());
        potential.set_conditions(factor.as_deref(), time);
        Ok(potential)
    }
}
