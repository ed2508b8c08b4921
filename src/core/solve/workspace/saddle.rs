//! The negative-curvature mode of a shape at a saddle, and how it is left.
//!
//! Under drag, `γ dx/dt = -∂U/∂x`, a displacement along a mode `H v = λ M v` grows at the rate
//!
//! ```text
//! σ = -λ vᵀMv / vᵀγv
//! ```
//!
//! An L-stable step h with σh > 1 damps it instead: a shape whose perturbations have died down, below a critical strain say,
//! would be followed along its unstable branch for ever.

use std::sync::Arc;

use super::super::equilibrium::{Relaxation, is_flat};
use super::super::stability::{Mode, Stability};
use super::super::{Result, SolveError};
use super::{Control, Workspace};
use crate::Vec3;
use crate::geometry::lumped_areas;
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
        let Some(Mode { shape: mode, .. }) = self.unstable_mode(state, 0.0)? else {
            return Ok(false);
        };
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

    /// The rate σ at which the fastest perturbation of the shape of `state` grows under drag, if a step of this length would
    /// damp it; the shape is displaced along it by `by`, a length that does not count.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(in crate::solve) fn leave_damped_saddle(
        &mut self,
        state: &mut State,
        step: f64,
        by: f64,
    ) -> Result<Option<f64>> {
        if is_flat(&state.x, self.reduction()) {
            return Ok(None);
        }
        let model = Arc::clone(&self.model);
        let (drag, mass) = (model.drag(), lumped_areas(model.sheet()));
        let vertices = mass.len();
        let mean = |value: &(dyn Fn(usize) -> f64 + Sync)| self.reduction().sum(vertices, value);
        let least = mean(&|i| drag.tangential(i)) / mean(&|i| mass[i]) / step;
        let Some(Mode { eigenvalue, shape }) = self.unstable_mode(state, least)? else {
            return Ok(None);
        };
        let weights = drag.weights(model.sheet(), &state.x, 1.0);
        let inertia = self.reduction().sum(vertices, |i| mass[i] * shape[i].norm_squared());
        let resisted =
            self.reduction().sum(vertices, |i| shape[i].dot(&weights.apply(i, shape[i])));
        let rate = -eigenvalue * inertia / resisted;
        if !(rate * step > 1.0) {
            return Ok(None);
        }
        let mut x = state.x.to_vec();
        parallel::update(&mut x, |i, x| *x += by * shape[i]);
        state.x = x.into();
        Ok(Some(rate))
    }

    /// The mode that lowers the energy most at `state`, if its eigenvalue is below `-least`, force/length³. None too where
    /// stability is unknown: on large sheets, and below round-off.
    fn unstable_mode(&mut self, state: &State, least: f64) -> Result<Option<Mode>> {
        if self.model.is_chemistry_alone() || !self.judges_stability() {
            return Ok(None);
        }
        let Self { model, control, memory, stability, .. } = self;
        let mut at = model.at(state, memory);
        match lowest_mode(stability, control, (at.potential()?, &state.x), least) {
            Err(SolveError::Interrupted) => Err(SolveError::Interrupted),
            found => Ok(found.unwrap_or_default()),
        }
    }
}

/// The mode of the lowest eigenvalue at `x`, if that is below `-least`.
fn lowest_mode(
    stability: &mut Option<Stability>,
    control: &Control,
    (potential, x): (&mut Potential, &[Vec3]),
    least: f64,
) -> Result<Option<Mode>> {
    let judge = match stability.take() {
        Some(judge) => judge,
        None => Stability::new(potential.mechanics())?,
    };
    let judge = stability.insert(judge.with_control(control));
    if judge.inertia_below(potential, x, least)?.negative == 0 {
        return Ok(None);
    }
    Ok(judge.spectrum(potential, x, 1)?.modes.pop())
}
