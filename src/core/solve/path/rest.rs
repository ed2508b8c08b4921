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
use super::sub_step::{DISTANCE_TOLERANCE, radius, sub_step};
use super::{factor, viscosity};
use crate::Vec3;
use crate::model::State;
use crate::parallel;

/// First sub-step of a flow, in units of the step that went before: a snap takes next to none of that.
const FIRST_SUB_STEP: f64 = 1e-6;
/// Most that the error estimate makes of a sub-step, at first and after a rejection: an implicit step that is longer than
/// the time in which an unstable mode grows jumps across it.
const STEP_GROWTH: (f64, f64) = (10.0, 1.25);
/// Displacement in a sub-step, in mean edges, from which a motion that dies down is a snap that is over; below it an unstable
/// mode may still grow.
const SNAP_DISPLACEMENT: f64 = 0.03;
/// A sub-step that is rejected is repeated at this share of its length.
const STEP_REDUCTION: f64 = 0.3;
/// The motion dies down where its speed falls to this share in a sub-step.
const SLOWED_SPEED: f64 = 0.7;
/// Radius of the trust region of the minimisation at the end of a flow, in mean edges.
const END_RADIUS: f64 = 0.5;
/// Factor on the force tolerance in a flow: with 1, soft unstable modes begin below it.
const FORCE_FACTOR: f64 = 0.1;
/// Most iterations of a flow, in units of those after which a single relaxation has failed.
const ITERATION_BUDGET: u64 = 10;
/// Most sub-steps of a flow, rejected ones included.
const MAX_SUB_STEPS: usize = 300;
/// Shortest sub-step of a flow, in units of the step before it, and longest, in units of the whole step: the motion has died
/// down then.
const SHORTEST_SUB_STEP: f64 = 1e-9;
const LONGEST_SUB_STEP: f64 = 1e6;
/// A minimisation is tried where the motion has died down in a sub-step at least as long as the step before, which moves no
/// vertex further than this, in mean edges.
const SLOW_DISPLACEMENT: f64 = 0.3;
/// A flow that moves no further in a sub-step as long as the step before it, in mean edges, although no minimum is near, is
/// at a saddle.
const SADDLE_DISPLACEMENT: f64 = 0.01;
/// How far an unstable mode is followed before the flow takes over, in mean edges.
const MODE_DISPLACEMENT: f64 = 0.1;
/// A mode along which the shape rests again within this distance, in mean edges, is neutral: a dimple that can be
/// anywhere on a sphere is held by its mesh alone.
const NEUTRAL_DISTANCE: f64 = 2.0 * MODE_DISPLACEMENT;
/// Most saddles that are left one after the other.
const MAX_SADDLES: usize = 5;

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
    for _ in 0..MAX_SADDLES {
        let saddle = state.x.clone();
        if !leave(workspace, route, state)? {
            break;
        }
        let left_for = rest(workspace, route, state)?;
        if reduction.distance(&saddle, &state.x) < NEUTRAL_DISTANCE * edge {
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
    minimum_within(workspace, route, state, (radius(route), 1.0))
}

/// The same within another radius, in mean edges, to a force tolerance times `force_factor`.
fn minimum_within(
    workspace: &mut Workspace,
    route: &Route<'_>,
    state: &mut State,
    (radius, force_factor): (f64, f64),
) -> Result<Relaxation> {
    let (mut next, held) = route.at(route.clock().1, state);
    let distance_tolerance = DISTANCE_TOLERANCE;
    let minimisation = Minimisation {
        trust: Some(radius),
        distance_tolerance,
        force_factor,
        held,
        ..Minimisation::default()
    };
    let done = workspace.minimise(&mut next, minimisation)?;
    state.x = next.x;
    Ok(done)
}

/// Follows the gradient flow from the shape of `state`, after a step of the length `step`, to the minimum that it leads to:
/// a jump.
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
    let (shortest, longest) = (SHORTEST_SUB_STEP * step, LONGEST_SUB_STEP * route.length());
    let near = radius(route).min(END_RADIUS);
    // Pseudo-time at fixed conditions.
    let mut pace = Pace { t: end, step: FIRST_SUB_STEP * step, ..Pace::default() };
    for _ in 0..MAX_SUB_STEPS {
        if workspace.iterations() > most || pace.step > longest {
            break;
        }
        let clock = (pace.t, pace.t + pace.step);
        let next = sub_step(&mut motion, workspace, route, clock, state, (viscosity, FORCE_FACTOR));
        let next = match next {
            Ok(next) => {
                done.add(&next.done);
                Some(next).filter(|next| next.error <= 1.0)
            }
            Err(error) if error.is_without_rest() => None,
            Err(error) => return Err(error),
        };
        let Some(next) = next else {
            if pace.step <= shortest {
                break;
            }
            pace.reject();
            continue;
        };
        workspace.pass(&state.x, &next.x, true)?;
        let moved = reduction.distance(&state.x, &next.x) / edge;
        state.x = next.x;
        if !pace.accept(moved, next.error) || moved > SLOW_DISPLACEMENT || pace.step < step {
            continue;
        }
        match minimum_within(workspace, route, state, (near, FORCE_FACTOR)) {
            Ok(more) => {
                done.add(&more);
                done.jumps = 1;
                return Ok(done);
            }
            Err(error) if !error.is_without_rest() => return Err(error),
            Err(_) if moved < SADDLE_DISPLACEMENT => _ = leave(workspace, route, state)?,
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
    /// Whether one was rejected since the last snap.
    cautious: bool,
    /// Mean edges in a unit of pseudo-time, in the last sub-step.
    speed: f64,
}

impl Pace {
    /// Repeats a sub-step that is rejected by a shorter one.
    fn reject(&mut self) {
        self.cautious = true;
        self.step *= STEP_REDUCTION;
    }

    /// Continues after a sub-step that `moved` the shape, with an `error`. Whether the motion dies down.
    fn accept(&mut self, moved: f64, error: f64) -> bool {
        let speed = moved / self.step;
        let slows = speed <= SLOWED_SPEED * std::mem::replace(&mut self.speed, speed);
        self.cautious &= !(slows && moved > SNAP_DISPLACEMENT);
        self.t += self.step;
        self.step *= factor(error, if self.cautious { STEP_GROWTH.1 } else { STEP_GROWTH.0 });
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
    parallel::update(&mut x, |i, x| *x += MODE_DISPLACEMENT * edge * mode[i]);
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
