//! One minimisation with a small viscosity, its error, and whether it is a part of a jump.

use super::super::equilibrium::Relaxation;
use super::super::incremental_potential::{Motion, Stepping};
use super::super::route::Route;
use super::super::{Result, Workspace};
use super::jumps::Loss;
use crate::model::{Positions, State};

/// Tolerances of a sub-step, relative to the largest displacement and in mean edges. They keep to a branch; the accuracy
/// on it is that of the equilibrium.
const TOLERANCE: (f64, f64) = (0.05, 0.1);
/// Largest error of a vertex in a sub-step, in mean edges, in jumps as well. Snaps are local: no mean over a large sheet sees
/// them, and one sub-step across a snap comes to any of the minima around.
const LARGEST_ERROR: f64 = 0.35;
/// Radius of the trust region of a minimisation about its start, in mean edges, along a branch and while a start is let go:
/// with 2 there coarse meshes came to minima that depended on the linear solver.
const TRUST_RADIUS: (f64, f64) = (2.0, 0.25);
/// Largest estimated distance to a minimum, in mean edges: forces alone leave soft bending modes far from it.
pub(super) const DISTANCE_TOLERANCE: f64 = 0.02;
/// Factor on the RMS tolerance of sub-steps in jumps, which are many.
const JUMP_TOLERANCE_FACTOR: f64 = 4.0;

/// Where a sub-step leads.
pub(super) struct SubStep {
    pub(super) x: Positions,
    pub(super) done: Relaxation,
    /// What it releases, if it is a part of a jump.
    pub(super) released: Option<f64>,
    /// Error estimate in units of the tolerance, the larger of RMS and maximum norm.
    pub(super) error: f64,
}

/// One minimisation with the `viscosity`, from the shape of `state` while the clock goes from `t` to `until`, to a force
/// tolerance times `force_factor`.
pub(super) fn sub_step(
    motion: &mut Motion,
    workspace: &mut Workspace,
    route: &Route<'_>,
    (t, until): (f64, f64),
    state: &State,
    (viscosity, force_factor): (f64, f64),
) -> Result<SubStep> {
    let (at, _) = route.at(t, state);
    let by = Stepping {
        drag: viscosity,
        second_order: false,
        tolerance: 0.0,
        relative: 0.0,
        trust: Some(radius(route)),
        force_factor,
        distance_tolerance: DISTANCE_TOLERANCE,
    };
    let moved = motion.advance(workspace, &at, (t, until), route, &by)?;
    let fine = State { x: moved.x.into(), ..at.clone() };
    let coarse = State { x: moved.coarse.into(), ..at.clone() };
    let by = viscosity / (until - t);
    let loss = Loss::of(workspace, route, ((t, until), by), (&at, &fine))?;
    let released = loss.and_then(|loss| loss.in_jump());
    let mean = workspace.model.shape_misfit(&at, (&coarse, &fine), TOLERANCE);
    let mean = if released.is_some() { mean / JUMP_TOLERANCE_FACTOR } else { mean };
    let edge = workspace.model.mechanics().reference().mean_edge();
    let largest = workspace.reduction().distance(&coarse.x, &fine.x) / (LARGEST_ERROR * edge);
    // What is not a number stays so.
    let error = if mean < largest { largest } else { mean };
    Ok(SubStep { x: fine.x, done: moved.done, released, error })
}

/// Radius of the trust region of minimisations along `route`.
pub(super) fn radius(route: &Route<'_>) -> f64 {
    if route.is_held() { TRUST_RADIUS.1 } else { TRUST_RADIUS.0 }
}
