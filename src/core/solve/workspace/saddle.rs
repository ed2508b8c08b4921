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
use super::super::stability::{Inertia, Mode, Stability};
use super::super::{Result, SolveError};
use super::rest::{DISTANCE_TOLERANCE, NEARBY};
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

/// Times that the force tolerance is tightened for one shape.
const MAX_TIGHTENINGS: usize = 4;
/// Falls of the energy below this share of it leave a shape within a few per cent of its minimum.
const NOTICEABLE_FALL: f64 = 1e-3;

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
    /// motion leads out of its plane, and the scene says how symmetry is broken. A minimum is brought nearer where forces as small
    /// as count for rest leave it far.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(in crate::solve) fn leave_saddle(
        &mut self,
        state: &mut State,
        done: &mut Relaxation,
    ) -> Result<bool> {
        if self.model.is_chemistry_alone() || !self.judges_stability() {
            return Ok(false);
        }
        let mode = match self.approach_minimum(state, done)? {
            Inertia { negative: 1.., .. } if !is_flat(&state.x, self.reduction()) => {
                self.unstable_mode(state, 0.0)?
            }
            _ => None,
        };
        let Some(Mode { shape: mode, .. }) = mode else { return Ok(false) };
        let edge = self.model.mechanics().reference().mean_edge();
        let saddle = state.x.clone();
        self.displace(state, MODE_DISPLACEMENT * edge, mode)?;
        let Some(near) = self.rest_nearby(state, None)? else { return Ok(true) };
        if self.reduction().distance(&saddle, &state.x) < NEUTRAL_DISTANCE * edge {
            done.iterations += near.iterations;
            state.x = saddle;
            return Ok(false);
        }
        done.add(&near);
        Ok(true)
    }

    /// Tightens the force tolerance, unless the scene gives one, and lets the shape of `state` come to rest again, while Newton's step
    ///
    /// ```text
    /// δ = -H⁻¹ ∂U/∂x      farther than the trust region, with -½ ∂U/∂x·δ a noticeable share of U
    /// ```
    ///
    /// leads far: soft modes, of thin sheets and near buckling, have small forces far from their minimum.
    ///
    /// # Errors
    /// If the model has no value there.
    fn approach_minimum(&mut self, state: &mut State, done: &mut Relaxation) -> Result<Inertia> {
        let edge = self.model.mechanics().reference().mean_edge();
        for _ in 0..MAX_TIGHTENINGS {
            let Ok((inertia, distance)) = self.distance_to_minimum(state) else { break };
            let far = inertia.negative == 0 && distance > NEARBY * edge;
            if !far || !self.tighten(DISTANCE_TOLERANCE * edge / distance) {
                return Ok(inertia);
            }
            let mut next = state.clone();
            match self.flow(&mut next, None, done) {
                Ok(()) => state.x = next.x,
                Err(error) if error.is_recoverable() => return Ok(inertia),
                Err(error) => return Err(error),
            }
        }
        match self.distance_to_minimum(state) {
            Err(SolveError::Interrupted) => Err(SolveError::Interrupted),
            Ok((inertia, _)) => Ok(inertia),
            Err(_) => Ok(Inertia { negative: 0, rigid: 0, resolution: f64::INFINITY }),
        }
    }

    /// The inertia at `state`, and the largest displacement of Newton's step there; 0 where the energy barely falls along it.
    fn distance_to_minimum(&mut self, state: &State) -> Result<(Inertia, f64)> {
        let tolerance = self.force_tolerance();
        let Self { model, control, memory, stability, .. } = self;
        let mut at = model.at(state, memory);
        let (potential, x) = (at.potential()?, &state.x);
        let mut step = vec![Vec3::zeros(); x.len()];
        let energy = potential.energy_gradient(x, &mut step);
        let pins = potential.pins().clone();
        let free = |i: usize, v: &mut Vec3| (0..3).for_each(|a| v[a] *= f64::from(!pins[i][a]));
        parallel::update(&mut step, |i, v| {
            *v = -*v;
            free(i, v);
        });
        let force = step.clone();
        let judge = judge(stability, control, potential)?;
        let inertia = judge.inertia_below(potential, x, 0.0, Some(&mut step))?;
        parallel::update(&mut step, |i, v| free(i, v));
        let reduction = potential.reduction();
        let fall = 0.5 * reduction.dot(&force, &step);
        let negligible = tolerance * potential.force_scale() * potential.metric().mean_edge();
        let falls = fall > NOTICEABLE_FALL * (energy.abs() + negligible);
        Ok((inertia, if falls { reduction.largest(&step) } else { 0.0 }))
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
        self.displace(state, by, shape)?;
        Ok(Some(rate))
    }

    /// Displaces the shape of `state` by `by` along `mode`, as far as contact allows.
    fn displace(&mut self, state: &mut State, by: f64, mut mode: Vec<Vec3>) -> Result<()> {
        parallel::update(&mut mode, |_, v| *v *= by);
        let Self { model, memory, .. } = self;
        let share = model.at(state, memory).potential()?.largest_step(&state.x, &mode);
        let mut x = state.x.to_vec();
        parallel::update(&mut x, |i, x| *x += share * mode[i]);
        state.x = x.into();
        Ok(())
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
    let judge = judge(stability, control, potential)?;
    if judge.inertia_below(potential, x, least, None)?.negative == 0 {
        return Ok(None);
    }
    Ok(judge.spectrum(potential, x, 1)?.modes.pop())
}

/// What judges stability, made when it is first asked.
fn judge<'s>(
    stability: &'s mut Option<Stability>,
    control: &Control,
    potential: &Potential,
) -> Result<&'s mut Stability> {
    let judge = match stability.take() {
        Some(judge) => judge,
        None => Stability::new(potential.mechanics())?,
    };
    Ok(stability.insert(judge.with_control(control)))
}
