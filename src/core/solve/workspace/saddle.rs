//! The negative-curvature mode of an equilibrium that is a saddle.

use super::super::stability::Stability;
use super::super::{Result, SolveError};
use super::minimisation::Held;
use super::{Control, Workspace};
use crate::Vec3;
use crate::model::{Potential, State};

/// Vertices up to which a factor of the Hessian says whether a shape is stable.
const MAX_VERTICES: usize = 50_000;

impl Workspace {
    /// The direction that lowers the energy most at `state`, an equilibrium, if one does; its largest displacement is
    /// 1. None too where stability is unknown: on large sheets, and below round-off.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(in crate::solve) fn unstable_mode(
        &mut self,
        state: &State,
        held: Option<Held>,
    ) -> Result<Option<Vec<Vec3>>> {
        let Self { model, control, memory, relaxer: Some(relaxer), stability, .. } = self else {
            return Ok(None);
        };
        // Neither is a spread-out Hessian factorised.
        let spread = model.sheet().reduction().distribution().is_some();
        if model.is_chemistry_alone() || spread || state.x.len() > MAX_VERTICES {
            return Ok(None);
        }
        let mut at = model.at(state, memory);
        let potential = at.potential()?;
        if let Some(held) = held {
            held.act_on(potential);
        }
        let found = match relaxer.equilibrium.is_minimum(potential, &state.x) {
            Some(true) => Ok(None),
            _ => lowest_mode(stability, control, potential, &state.x),
        };
        potential.set_hold(None);
        match found {
            Err(SolveError::Interrupted) => Err(SolveError::Interrupted),
            found => Ok(found.unwrap_or_default()),
        }
    }
}

/// The mode of the lowest eigenvalue at `x`, if that is negative.
fn lowest_mode(
    stability: &mut Option<Stability>,
    control: &Control,
    potential: &mut Potential,
    x: &[Vec3],
) -> Result<Option<Vec<Vec3>>> {
    let judge = match stability.take() {
        Some(judge) => judge,
        None => Stability::new(potential.mechanics())?,
    };
    let judge = stability.insert(judge.with_control(control));
    if judge.inertia(potential, x)?.negative == 0 {
        return Ok(None);
    }
    Ok(judge.spectrum(potential, x, 1)?.modes.pop().map(|mode| mode.shape))
}
