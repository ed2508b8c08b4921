//! The quasi-static shape: the limit of vanishing drag, by incremental potentials with a small viscosity.
//!
//! ```text
//! 0 = -∂U/∂x (x; q(t))                       q: species, growth, loads, prescribed positions
//! ```
//!
//! is the limit of `drag dx/dt = -∂U/∂x` for vanishing drag (a balanced-viscosity solution): as long as
//! there is a stable equilibrium the shape stays on its branch, and at an instability it follows the gradient
//! flow of U at fixed q to another one. A single minimisation under the conditions of the end of a step knows
//! nothing of that path: its metric would decide which minimum it finds. So a step from t_n to t_n+1 is made of
//!
//! ```text
//! sub-steps   x_k+1 = argmin U(x; q(t_k+1)) + η/(2 Δt_k) (x - x_k)·W (x - x_k)
//! rest        x_n+1 = argmin U(x; q(t_n+1))  near the last of them        (`rest`)
//! ```
//!
//! W is the drag of the scene, which sets the direction of motion in jumps and nothing else, and η a factor that makes
//! it small: over the whole step the weight is 10⁻⁷ of the stretching stiffness on average. Waves that are stiffer than
//! that stay in equilibrium; a soft or unstable mode moves by a bounded distance in a sub-step. Half the distance
//! between x_k+1 and where the last velocity led estimates the error, of the sheet and of every vertex, which controls Δt_k;
//! a minimisation that leaves the trust region about that prediction is rejected early. Where the error does not fall with
//! Δt_k (`stall`), the shape jumps. What lag the viscosity leaves at the end vanishes in the last minimisation, so smooth
//! paths are followed exactly.
//!
//! References: Agostiniani & Rossi, Singular vanishing-viscosity limits of gradient flows: the finite-dimensional
//! case, J. Differential Equations 263 (2017); Scilla & Solombrino, arXiv:1712.06182 (minimising movements
//! converge to this limit only if the proximal weight per step does not vanish against the energy); Ortiz &
//! Stainier, Comput. Methods Appl. Mech. Engrg. 171 (1999), doi:10.1016/S0045-7825(98)00219-9 (incremental
//! potentials).

mod first_equilibrium;
mod jumps;
mod rest;
mod stall;
mod sub_step;

pub(super) use first_equilibrium::first_equilibrium;

use serde::{Deserialize, Serialize};

use super::equilibrium::Relaxation;
use super::incremental_potential::Motion;
use super::route::Route;
use super::{Result, Workspace, end_of_step};
use crate::Vec3;
use crate::model::State;
use crate::record::Malformed;
use jumps::{Jumps, Loss};
use stall::Stall;
use sub_step::sub_step;

/// Weight of the viscosity over a whole step, in units of the stretching stiffness, averaged over vertices. With a hundred
/// times as much a growing cylinder buckled by its drag alone, and softer buckles lagged behind.
const VISCOSITY: f64 = 1e-7;
/// Factor on the force tolerance at the end of a sub-step.
const FORCE_FACTOR: f64 = 100.0;
/// Sub-steps are proposed shorter than the error estimate allows, and change by factors between these.
const SAFETY: f64 = 0.9;
const STEP_FACTORS: (f64, f64) = (0.1, 2.0);
/// A sub-step that has failed is repeated at this share of its length.
const STEP_REDUCTION: f64 = 0.1;
/// Shortest sub-step, as a share of the step; where it fails, the step has failed.
const SHORTEST_SUB_STEP: f64 = 1e-6;
/// Most iterations of a step, in units of those after which a single relaxation has failed.
const ITERATION_BUDGET: u64 = 3;

/// A shape that follows its equilibrium, with what it keeps from step to step.
#[derive(Debug, Default, Clone)]
pub(super) struct EquilibriumPath {
    motion: Motion,
    /// The next sub-step.
    step: Option<f64>,
    /// [`Self::longest`].
    longest: Option<f64>,
}

/// What later steps depend on.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Memory {
    step: Option<f64>,
    motion: Option<(f64, Vec<Vec3>)>,
}

impl EquilibriumPath {
    /// What later steps depend on.
    pub(super) fn memory(&self) -> Memory {
        Memory { step: self.step, motion: self.motion.memory() }
    }

    /// Takes over the memory of one for as many `vertices`.
    ///
    /// # Errors
    /// [`Malformed`] for anything else.
    pub(super) fn restore(&mut self, memory: Memory, vertices: usize) -> Result<(), Malformed> {
        self.step = memory.step;
        self.motion.restore(memory.motion, vertices)
    }

    /// The longest sub-step that the error estimates of the last step would allow. Signals of a shape whose path bends
    /// on this scale are not linear over a longer step.
    pub(super) fn longest(&self) -> f64 {
        self.longest.unwrap_or(f64::INFINITY)
    }

    /// Lets the shape of `from`, an equilibrium, follow while conditions change to those of `next`, whose
    /// shape is replaced. Between two states of the same time only species change, by a small correction.
    ///
    /// # Errors
    /// If no equilibrium is found.
    pub(super) fn advance(
        &mut self,
        workspace: &mut Workspace,
        from: &State,
        next: &mut State,
    ) -> Result<Relaxation> {
        if !workspace.reaches_rest() {
            workspace.check_way(from, next)?;
            return workspace.relax_once(next);
        }
        let (mut shape, to) = (from.clone(), next.clone());
        let done = if next.time > from.time {
            workspace.begin_path();
            self.longest = None;
            self.follow(workspace, &Route::in_time(from, &to), &mut shape)?
        } else {
            correct(workspace, &Route::from_zero_to_one(from, &to), &mut shape)?
        };
        next.x = shape.x;
        Ok(done)
    }

    /// Follows the equilibrium of `state` along all of `route`, to a stable one at its end.
    fn follow(
        &mut self,
        workspace: &mut Workspace,
        route: &Route<'_>,
        state: &mut State,
    ) -> Result<Relaxation> {
        let (start, end) = route.clock();
        let viscosity = viscosity(workspace, route, state)?;
        let step = self.step.unwrap_or(end - start);
        let most = workspace.iterations() + ITERATION_BUDGET * workspace.most_iterations();
        let mut course = Course { viscosity, most, t: start, step, ..Course::default() };
        let drag = viscosity / (end - start);
        self.take_sub_steps(workspace, route, state, &mut course)?;
        self.step = Some(course.step);
        let last = state.clone();
        let jumps = std::mem::take(&mut course.jumps);
        let rest = come_to_rest(workspace, route, drag, state, jumps)?;
        course.done.add(&rest);
        rest::stabilise(workspace, route, state, &mut course.done)?;
        workspace.pass(&last.x, &state.x, route.is_held())?;
        Ok(course.done)
    }

    /// Takes sub-steps to the end of `route`.
    fn take_sub_steps(
        &mut self,
        workspace: &mut Workspace,
        route: &Route<'_>,
        state: &mut State,
        course: &mut Course,
    ) -> Result<()> {
        let (start, end) = route.clock();
        let shortest = SHORTEST_SUB_STEP * (end - start);
        while course.t < end {
            let until = end_of_step(course.t, course.step, end);
            let length = until - course.t;
            if workspace.iterations() > course.most {
                return Err(rest::reason(workspace, route, state));
            }
            let clock = (course.t, until);
            let by = (course.viscosity, FORCE_FACTOR);
            match sub_step(&mut self.motion, workspace, route, clock, state, by) {
                Ok(next) if next.error <= 1.0 => {
                    course.done.add(&next.done);
                    let jumps_on = next.released.is_some();
                    workspace.pass(&state.x, &next.x, jumps_on || route.is_held())?;
                    state.x = next.x;
                    match next.released {
                        Some(released) => course.jumps.go_on(released),
                        None => course.jumps.end(),
                    }
                    course.t = until;
                    course.stall.pass(until);
                    let factor = factor(next.error, STEP_FACTORS.1);
                    // One that is cut short by the end says nothing against longer ones.
                    let least = if factor >= 1.0 { course.step } else { 0.0 };
                    course.step = (length * factor).max(least);
                    self.longest = Some(self.longest.unwrap_or(0.0).max(length * factor));
                }
                Ok(next) if length > shortest => {
                    course.done.add(&next.done);
                    self.reject(workspace, route, state, (course, until, next.error))?;
                }
                Err(error) if error.wants_shorter() && length > shortest => {
                    self.reject(workspace, route, state, (course, until, f64::INFINITY))?;
                }
                Err(error) if !error.is_without_rest() => return Err(error),
                _ => return Err(rest::reason(workspace, route, state)),
            }
        }
        Ok(())
    }

    /// Repeats a sub-step to `until` that is rejected for its `error`, infinite where it has no result, by a shorter one,
    /// or jumps where the error does not fall with the length.
    fn reject(
        &mut self,
        workspace: &mut Workspace,
        route: &Route<'_>,
        state: &mut State,
        (course, until, error): (&mut Course, f64, f64),
    ) -> Result<()> {
        let length = until - course.t;
        let jumps = course.stall.reject((course.t, until), error);
        // A start is let go as slowly as it takes.
        if jumps && !route.is_held() && way_is_free(workspace, route, state, (course.t, until)) {
            return self.jump(workspace, route, state, (course, until));
        }
        course.step = length * course.stall.shrink(length, error);
        Ok(())
    }

    /// Lets the shape of `state` follow the gradient flow under the conditions when the clock shows `until`, to which no
    /// branch leads.
    fn jump(
        &mut self,
        workspace: &mut Workspace,
        route: &Route<'_>,
        state: &mut State,
        (course, until): (&mut Course, f64),
    ) -> Result<()> {
        let (clock, length) = ((course.t, until), until - course.t);
        let (before, spent) = (state.clone(), workspace.iterations());
        let done = rest::flow(workspace, &route.stopped_at(until), state, length)?;
        course.most += workspace.iterations() - spent;
        course.done.add(&Relaxation { jumps: 0, ..done });
        let by = course.viscosity / length;
        let loss = Loss::of(workspace, route, (clock, by), (&before, state))?;
        if let Some(released) = loss.and_then(|loss| loss.in_jump()) {
            course.jumps.go_on(released);
        }
        course.jumps.end();
        self.motion = Motion::default();
        (course.t, course.step) = (until, length);
        course.stall = Stall::default();
        Ok(())
    }
}

/// How far the sub-steps of a step have come.
#[derive(Default)]
struct Course {
    /// In units of the scene's drag.
    viscosity: f64,
    /// Count of iterations at which the step has failed.
    most: u64,
    /// What the clock of the route shows.
    t: f64,
    /// Length of the next sub-step.
    step: f64,
    jumps: Jumps,
    done: Relaxation,
    /// What was rejected since.
    stall: Stall,
}

/// Lets the shape of `state` follow a correction, which is mostly too small for sub-steps.
fn correct(workspace: &mut Workspace, route: &Route<'_>, state: &mut State) -> Result<Relaxation> {
    match rest::minimum(workspace, route, state) {
        Err(error) if error.is_without_rest() => {
            let mut path =
                EquilibriumPath { step: Some(STEP_REDUCTION), ..EquilibriumPath::default() };
            path.follow(workspace, route, state)
        }
        done => done,
    }
}

/// Brings the shape of `state` to rest at the end of `route`, after sub-steps with `jumps` whose viscosity was `drag` times
/// that of the scene.
fn come_to_rest(
    workspace: &mut Workspace,
    route: &Route<'_>,
    drag: f64,
    state: &mut State,
    mut jumps: Jumps,
) -> Result<Relaxation> {
    let (_, end) = route.clock();
    let last = state.clone();
    let mut done = rest::rest(workspace, route, state)?;
    let loss = Loss::of(workspace, route, ((end, end), drag), (&last, state))?;
    if let Some(loss) = loss.filter(|loss| done.jumps > 0 || loss.is_jump()) {
        jumps.go_on(loss.lost);
    } else if done.jumps > 0 {
        jumps.go_on(0.0);
    }
    (done.jumps, done.released) = (jumps.count, jumps.released);
    Ok(done)
}

/// Whether obstacles, while the clock goes from `t` to `until`, leave the shape of `state` where it is.
fn way_is_free(
    workspace: &mut Workspace,
    route: &Route<'_>,
    state: &State,
    (t, until): (f64, f64),
) -> bool {
    let ((at, _), (mut to, _)) = (route.at(t, state), route.at(until, state));
    workspace.model.mechanics().set_prescribed(to.time, &mut to.x);
    workspace.check_way(&at, &to).is_ok()
}

/// What an error estimate makes of a sub-step, up to `most`.
fn factor(error: f64, most: f64) -> f64 {
    let factor = SAFETY / error.sqrt();
    if factor.is_nan() { STEP_FACTORS.0 } else { factor.clamp(STEP_FACTORS.0, most) }
}

/// The viscosity of a step along all of `route`, in units of the scene's drag.
fn viscosity(workspace: &mut Workspace, route: &Route<'_>, state: &State) -> Result<f64> {
    let (start, end) = route.clock();
    let (at, _) = route.at(start, state);
    let drag = workspace.model.drag().mean(workspace.model.sheet());
    let mut at = workspace.at(&at);
    let potential = at.potential()?;
    let stiffness = potential.force_scale() / potential.metric().mean_edge();
    Ok(VISCOSITY * stiffness * (end - start) / drag)
}
