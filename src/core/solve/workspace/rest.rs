//! Rest at fixed conditions: the equilibrium near a shape, and the stable one that the overdamped motion leads to.
//!
//! ```text
//! 0       = -∂U/∂x           near a shape: a minimisation within a trust region
//! W dx/dτ = -∂U/∂x           from anywhere: steps of `incremental_potential` under error control, which grow as the motion
//!                            dies down; W is the drag of the scene, which sets the direction of the motion
//! ```
//!
//! The motion ends where an equilibrium is near that is stable. In pseudo-time τ nothing but the shape changes.

use super::super::diagnosis;
use super::super::equilibrium::Relaxation;
use super::super::incremental_potential::{Motion, Stepping};
use super::super::route::Route;
use super::super::{Result, SolveError};
use super::{Minimisation, Workspace};
use crate::Vec3;
use crate::model::State;
use crate::sheet::is_turned;

/// Radius of the trust region of a minimisation that is to stay on its branch, in mean edges: with 2 there, coarse meshes
/// came to minima that depended on the linear solver.
pub(in crate::solve) const NEARBY: f64 = 0.25;
/// Largest estimated distance to a minimum, in mean edges: forces alone leave soft bending modes far from it.
const DISTANCE_TOLERANCE: f64 = 0.02;
/// Tolerances of a step in pseudo-time, relative to the largest displacement and in mean edges.
const TOLERANCE: (f64, f64) = (0.05, 0.1);
/// Displacement that the first step is expected to make, in mean edges.
const FIRST_DISPLACEMENT: f64 = 0.1;
/// Steps are proposed shorter than their error allows, and change by factors between these.
const SAFETY: f64 = 0.9;
const STEP_FACTORS: (f64, f64) = (0.1, 4.0);
/// Most iterations, in units of those after which a single relaxation has failed.
const ITERATION_BUDGET: u64 = 10;
/// Most saddles that are left one after the other.
const MAX_SADDLES: usize = 5;

impl Workspace {
    /// Brings the shape of `state` to the equilibrium near it; none, and the shape as it is, where there is none within the
    /// trust region.
    ///
    /// # Errors
    /// If the model has no value there.
    pub(in crate::solve) fn rest_nearby(
        &mut self,
        state: &mut State,
    ) -> Result<Option<Relaxation>> {
        let mut next = state.clone();
        let minimisation = Minimisation {
            trust: Some(NEARBY),
            distance_tolerance: DISTANCE_TOLERANCE,
            ..Minimisation::default()
        };
        match self.minimise(&mut next, minimisation) {
            Ok(done) => {
                state.x = next.x;
                Ok(Some(done))
            }
            Err(error) if error.is_without_rest() => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Lets the shape of `state` follow the overdamped motion under its conditions to a stable equilibrium.
    ///
    /// # Errors
    /// If the motion leads to none.
    pub fn settle_shape(&mut self, state: &mut State) -> Result<Relaxation> {
        if !self.model.moves() || !self.reaches_rest() {
            return self.relax(state);
        }
        let begin = state.x.clone();
        let mechanics = self.model.mechanics().clone();
        mechanics.set_prescribed(state.time, &mut state.x);
        let mut done = Relaxation::default();
        let mut saddles = 0;
        loop {
            self.flow(state, &mut done)?;
            if self.model.conditions_follow_shape() {
                done.add(&self.relax(state)?);
            }
            if saddles == MAX_SADDLES || !self.leave_saddle(state, &mut done)? {
                break;
            }
            saddles += 1;
        }
        self.align(state, &begin)?;
        Ok(done)
    }

    /// The motion to an equilibrium, stable or not.
    fn flow(&mut self, state: &mut State, done: &mut Relaxation) -> Result<()> {
        if let Some(near) = self.rest_nearby(state)? {
            done.add(&near);
            return Ok(());
        }
        // A load that nothing holds would move the sheet for ever.
        if let Some(error) = self.diagnosed(state, diagnosis::net_force)? {
            return Err(error);
        }
        let edge = self.model.mechanics().reference().mean_edge();
        let most = self.iterations() + ITERATION_BUDGET * self.most_iterations();
        let (mut motion, mut clock, mut step) = (Motion::default(), 0.0, self.first_step(state)?);
        while self.iterations() <= most && step > 0.0 {
            let next = self.step_in_pseudo_time(&mut motion, state, (clock, clock + step));
            let (x, error) = match next {
                Ok((x, more, error)) => {
                    done.add(&more);
                    (x, error)
                }
                Err(error) if error.is_without_rest() => (Vec::new(), f64::INFINITY),
                Err(error) => return Err(error),
            };
            let factor = SAFETY / error.sqrt();
            if !(error <= 1.0) {
                step *= if factor.is_nan() { STEP_FACTORS.0 } else { factor.max(STEP_FACTORS.0) };
                continue;
            }
            if is_turned(self.model.sheet(), &state.x, &x) {
                return Err(SolveError::InsideOut);
            }
            let moved = self.reduction().distance(&state.x, &x);
            state.x = x.into();
            clock += step;
            step *= factor.clamp(STEP_FACTORS.0, STEP_FACTORS.1);
            if moved < NEARBY * edge
                && let Some(near) = self.rest_nearby(state)?
            {
                done.add(&near);
                return Ok(());
            }
        }
        Err(self.reason_without_rest(state))
    }

    /// One step, what it took and its error in units of the tolerance.
    fn step_in_pseudo_time(
        &mut self,
        motion: &mut Motion,
        state: &State,
        clock: (f64, f64),
    ) -> Result<(Vec<Vec3>, Relaxation, f64)> {
        let tolerance = self.model.shape_unit(state, TOLERANCE);
        let by = Stepping { drag: 1.0, second_order: true, tolerance, relative: TOLERANCE.0 };
        let at = state.clone();
        let moved = motion.advance(self, state, clock, &Route::frozen(&at, clock), &by)?;
        let [coarse, fine] = [moved.coarse, moved.x].map(|x| State { x: x.into(), ..at.clone() });
        let error = self.model.shape_misfit(state, (&coarse, &fine), TOLERANCE);
        Ok((fine.x.into(), moved.done, error))
    }

    /// The pseudo-time in which the largest force moves a vertex by a small part of an edge.
    fn first_step(&mut self, state: &State) -> Result<f64> {
        let model = self.model.clone();
        let gradient = self.at(state).gradient()?;
        let speed = |i: usize| gradient[i].norm() / model.drag().at(i);
        let fastest = self.reduction().max(gradient.len(), speed);
        Ok(FIRST_DISPLACEMENT * model.mechanics().reference().mean_edge() / fastest)
    }

    /// Why no equilibrium is found near the shape of `state`.
    pub(in crate::solve) fn reason_without_rest(&mut self, state: &State) -> SolveError {
        let cause = self.diagnosed(state, |potential, x, tolerance| {
            let mut gradient = vec![Vec3::zeros(); x.len()];
            potential.energy_gradient(x, &mut gradient);
            let residual = potential.residual(&gradient);
            diagnosis::relaxation(potential, x, (residual, tolerance))
                .or_else(|| diagnosis::collapse(potential, x))
                .or_else(|| diagnosis::stretched(potential, x))
        });
        self.set_stuck(state.clone());
        cause.ok().flatten().unwrap_or(SolveError::WithoutRest { time: state.time })
    }
}
