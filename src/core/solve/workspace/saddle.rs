//! The negative-curvature mode of an equilibrium that is a saddle, and how it is left.

use super::super::equilibrium::{Relaxation, is_flat};
use super::super::stability::Stability;
use super::super::{Result, SolveError};
use super::{Control, Workspace};
use crate::Vec3;
use crate::model::{Potential, State};
use crate::parallel;

/// Vertices up to which a factor of the Hessian says whether a shape is stable.
const MAX_VERTICES: usize = 50_000;
/// Displacement along an unstable mode, in mean edges.
const MODE_DISPLACEMENT: f64 = 0.1;
/// A mode along which the shape rests again within this distance, in mean edges, is neutral: a dimple that can be
/// anywhere on a sphere is held by its mesh alone.
const NEUTRAL_DISTANCE: f64 = 2.0 * MODE_DISPLACEMENT;

impl Workspace {
    /// Whether the stability of equilibria can be judged: not on sheets that are too large for a factor of the indefinite
    /// Hessian, or spread over ranks.
    #[must_use]
    pub fn judges_stability(&self) -> bool {
        let spread = self.model.sheet().reduction().ranks().is_some();
        !spread && self.model.sheet().vertex_count() <= MAX_VERTICES
    }

    /// Displaces `state`, an equilibrium, along its negative-curvature mode, if it has one: from a saddle no force leads.
    /// Where another equilibrium is near, the shape rests there. Whether it has left. A perfectly flat sheet stays flat: no
    /// motion leads out of its plane, and the scene says how symmetry is broken.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(in crate::solve) fn leave_saddle(
        &mut self,
        state: &mut State,
        done: &mut Relaxation,
    ) -> Result<bool> {
        if is_flat(&state.x, self.reduction()) {
            return Ok(false);
        }
        let Some(mode) = self.unstable_mode(state)? else { return Ok(false) };
        let edge = self.model.mechanics().reference().mean_edge();
        let saddle = state.x.clone();
        let mut x = saddle.to_vec();
        parallel::update(&mut x, |i, x| *x += MODE_DISPLACEMENT * edge * mode[i]);
        state.x = x.into();
        let Some(near) = self.rest_nearby(state, None)? else { return Ok(true) };
        if self.reduction().distance(&saddle, &state.x) < NEUTRAL_DISTANCE * edge {
            done.iterations += near.iterations;
            state.x = saddle;
            return Ok(false);
        }
        done.add(&near);
        Ok(true)
    }

    /// The direction that lowers the energy most at `state`, an equilibrium, if one does; its largest displacement is
    /// 1. None too where stability is unknown: on large sheets, and below round-off.
    fn unstable_mode(&mut self, state: &State) -> Result<Option<Vec<Vec3>>> {
        if self.model.is_chemistry_alone() || !self.judges_stability() {
            return Ok(None);
        }
        let Self { model, control, memory, stability, .. } = self;
        let mut at = model.at(state, memory);
        match lowest_mode(stability, control, at.potential()?, &state.x) {
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
