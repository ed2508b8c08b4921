//! Rest at fixed conditions: the stable equilibrium near a shape, or the one that the gradient flow reaches from it.
//!
//! ```text
//! W dx/dτ = -∂U/∂x           W: the drag of the scene, which sets the direction of the motion
//! ```
//!
//! A minimisation that stays within a trust region is the equilibrium. Where it leaves that, the shape jumps: it follows
//! the gradient flow by viscous sub-steps under error control, which grow as the motion dies down, until a minimisation
//! stays near. An equilibrium with a direction of negative stiffness is none that a sheet rests in: it is left along
//! that direction.

use super::super::equilibrium::{Relaxation, is_flat};
use super::super::incremental_potential::Motion;
use super::super::route::Route;
use super::super::workspace::Minimisation;
use super::super::{Result, SolveError, Workspace, diagnosis};
use super::stall::Stall;
use super::sub_step::{DISTANCE_TOLERANCE, radius, sub_step};
use super::{ITERATION_BUDGET, factor, viscosity};
use crate::Vec3;
use crate::model::State;
use crate::parallel;

/// Most that the error estimate makes of a sub-step.
const GROWTH: f64 = 4.0;
/// Most sub-steps of a flow, rejected ones included.
const TRIES: usize = 300;
/// Shortest and longest sub-step of a flow, in units of the step that went before: the motion has died down then.
const SHORTEST: f64 = 1e-9;
const LONGEST: f64 = 1e6;
/// A minimisation is tried again where a sub-step moves no vertex further than this, in mean edges.
const STILL: f64 = 0.3;
/// A flow that moves no further in a sub-step, in mean edges, although no minimum is near, is at a saddle.
const STUCK: f64 = 0.01;
/// How far an unstable mode is followed before the flow takes over, in mean edges.
const SEED: f64 = 0.1;
/// A mode along which the shape rests again within this distance, in mean edges, is neutral: a dimple that can be
/// anywhere on a sphere is held by its mesh alone.
const NEUTRAL: f64 = 2.0 * SEED;
/// Most saddles that are left one after the other.
const SADDLES: usize = 5;

/// Brings the shape of `state` to rest under the conditions at the end of `route`.
///
/// # Errors
/// If the flow comes to no rest.
pub(super) fn rest(
    workspace: &mut Workspace,
    route: &Route<'_>,
    state: &mut State,
) -> Result<Relaxation> {
    match minimum(workspace, route, state) {
        Err(error) if error.is_without_rest() => flow(workspace, route, state, route.length()),
        done => done,
    }
}

/// Leaves an equilibrium that is not stable, which is what `done` has led to. A perfectly flat sheet stays flat: no motion
/// leads out of its plane, and the scene says how symmetry is broken.
///
/// # Errors
/// If the flow comes to no rest.
pub(super) fn stabilise(
    workspace: &mut Workspace,
    route: &Route<'_>,
    state: &mut State,
    done: &mut Relaxation,
) -> Result<()> {
    let (_, end) = route.clock();
    let (jumps, released) = (done.jumps, done.released);
    let edge = workspace.model.mechanics().reference().mean_edge();
    let reduction = workspace.reduction().clone();
    let before = energy(workspace, route, end, state)?;
    let mut left = 0;
    for _ in 0..SADDLES {
        let saddle = state.x.clone();
        if !leave(workspace, route, state)? {
            break;
        }
        let left_for = rest(workspace, route, state)?;
        if reduction.distance(&saddle, &state.x) < NEUTRAL * edge {
            done.iterations += left_for.iterations;
            state.x = saddle;
            break;
        }
        done.add(&left_for);
        workspace.pass(&saddle, &state.x, true)?;
        left = 1;
    }
    (done.jumps, done.released) = (jumps + left, released);
    if left > 0 {
        done.released += before - energy(workspace, route, end, state)?;
    }
    Ok(())
}

/// The minimum near the shape of `state`.
///
/// # Errors
/// If there is none within the trust region.
pub(super) fn minimum(
    workspace: &mut Workspace,
    route: &Route<'_>,
    state: &mut State,
) -> Result<Relaxation> {
    let (mut next, held) = route.at(route.clock().1, state);
    let distance_tolerance = DISTANCE_TOLERANCE;
    let minimisation = Minimisation {
        trust: Some(radius(route)),
        distance_tolerance,
        held,
        ..Minimisation::default()
    };
    let done = workspace.minimise(&mut next, minimisation)?;
    state.x = next.x;
    Ok(done)
}

/// Follows the gradient flow from the shape of `state`, by sub-steps of the length `step` at first, to the minimum that it
/// leads to: a jump.
pub(super) fn flow(
    workspace: &mut Workspace,
    route: &Route<'_>,
    state: &mut State,
    step: f64,
) -> Result<Relaxation> {
    let (_, end) = route.clock();
    // A load that nothing holds would move the sheet for ever.
    if let Some(error) = workspace.diagnosed(&route.at(end, state).0, diagnosis::net_force)? {
        return Err(error);
    }
    let viscosity = viscosity(workspace, route, state)?;
    let edge = workspace.model.mechanics().reference().mean_edge();
    let reduction = workspace.reduction().clone();
    let (mut done, mut motion) = (Relaxation::default(), Motion::default());
    let most = workspace.iterations() + ITERATION_BUDGET * workspace.most_iterations();
    let (shortest, longest) = (SHORTEST * route.length(), LONGEST * route.length());
    // Pseudo-time at fixed conditions.
    let mut pace = Pace { t: end, step, ..Pace::default() };
    for _ in 0..TRIES {
        if workspace.iterations() > most || pace.step > longest {
            break;
        }
        let clock = (pace.t, pace.t + pace.step);
        let next = sub_step(&mut motion, workspace, route, clock, state, (viscosity, 1.0));
        let (error, next) = match next {
            Ok(next) => {
                done.add(&next.done);
                (next.error, Some(next))
            }
            Err(error) if error.is_without_rest() => (f64::INFINITY, None),
            Err(error) => return Err(error),
        };
        let Some(next) = next.filter(|next| next.error <= 1.0) else {
            if pace.step <= shortest {
                break;
            }
            pace.reject(error);
            continue;
        };
        workspace.pass(&state.x, &next.x, true)?;
        let moved = reduction.distance(&state.x, &next.x) / edge;
        state.x = next.x;
        if !pace.accept(moved, next.error) || moved > STILL {
            continue;
        }
        match minimum(workspace, route, state) {
            Ok(more) => {
                done.add(&more);
                done.jumps = 1;
                return Ok(done);
            }
            Err(error) if !error.is_without_rest() => return Err(error),
            Err(_) if moved < STUCK => _ = leave(workspace, route, state)?,
            Err(_) => {}
        }
    }
    Err(reason(workspace, route, state))
}

/// The sub-steps of a flow.
#[derive(Default)]
struct Pace {
    t: f64,
    step: f64,
    stall: Stall,
    /// Mean edges in a unit of pseudo-time, in the last sub-step.
    speed: f64,
}

impl Pace {
    /// Repeats a sub-step that is rejected for its `error` by a shorter one.
    fn reject(&mut self, error: f64) {
        self.stall.reject((self.t, self.t + self.step), error);
        self.step *= self.stall.shrink(self.step, error);
    }

    /// Continues after a sub-step that `moved` the shape, with an `error`. Whether the motion dies down, which it does only
    /// after it has grown.
    fn accept(&mut self, moved: f64, error: f64) -> bool {
        let speed = moved / self.step;
        let slows = std::mem::replace(&mut self.speed, speed) >= speed;
        self.t += self.step;
        // After a rejection a sub-step is not lengthened at once.
        self.step *= factor(error, if self.stall.is_open() { 1.0 } else { GROWTH });
        self.stall = Stall::default();
        slows
    }
}

/// Displaces the shape of `state` along its unstable mode, if it has one: from a saddle no force leads.
fn leave(workspace: &mut Workspace, route: &Route<'_>, state: &mut State) -> Result<bool> {
    if is_flat(&state.x, workspace.reduction()) {
        return Ok(false);
    }
    let edge = workspace.model.mechanics().reference().mean_edge();
    let (at, held) = route.at(route.clock().1, state);
    let Some(mode) = workspace.unstable_mode(&at, held)? else { return Ok(false) };
    let mut x = state.x.to_vec();
    parallel::update(&mut x, |i, x| *x += SEED * edge * mode[i]);
    state.x = x.into();
    Ok(true)
}

/// Why no equilibrium is found near the shape of `state` under the conditions at the end of `route`.
pub(super) fn reason(workspace: &mut Workspace, route: &Route<'_>, state: &State) -> SolveError {
    let (at, _) = route.at(route.clock().1, state);
    let cause = workspace.diagnosed(&at, |potential, x, tolerance| {
        let mut gradient = vec![Vec3::zeros(); x.len()];
        potential.energy_gradient(x, &mut gradient);
        let residual = potential.residual(&gradient);
        diagnosis::relaxation(potential, x, (residual, tolerance))
            .or_else(|| diagnosis::collapse(potential, x))
            .or_else(|| diagnosis::stretched(potential, x))
    });
    let time = at.time;
    workspace.set_stuck(at);
    cause.ok().flatten().unwrap_or(SolveError::WithoutRest { time })
}

/// The energy of the shape of `state` under the conditions when the clock of `route` shows `t`.
pub(super) fn energy(
    workspace: &mut Workspace,
    route: &Route<'_>,
    t: f64,
    state: &State,
) -> Result<f64> {
    let (state, held) = route.at(t, state);
    let mut at = workspace.at(&state);
    let potential = at.potential()?;
    if let Some(held) = held {
        held.act_on(potential);
    }
    let energy = potential.energy(&state.x);
    potential.set_hold(None);
    Ok(energy)
}
