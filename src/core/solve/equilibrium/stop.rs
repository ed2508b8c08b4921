//! When an iteration ends: the same for all methods.

use super::{Goal, Relaxation};
use crate::Vec3;
use crate::model::Potential;
use crate::sheet::quality::triangle_quality;
use crate::solve::SolveError;
use crate::solve::diagnosis::{self, COLLAPSED};

/// Forces below this share of the tolerance are as good as none, whatever they leave of soft modes.
pub(super) const FORCE_FLOOR: f64 = 1e-4;

/// Whether the goal is reached; otherwise one more iteration may be made.
///
/// # Errors
/// Numbers that are not finite, too many iterations, an interruption.
pub(super) fn reached(
    potential: &Potential,
    done: &Relaxation,
    goal: &Goal<'_>,
    x: &[Vec3],
) -> Result<bool, SolveError> {
    if !(done.energy.is_finite() && done.residual.is_finite()) {
        return Err(SolveError::NotFinite);
    }
    if (goal.lost)(x) || goal.trust.is_some_and(|trust| !trust.contains(x, potential.reduction())) {
        return Err(SolveError::Departed);
    }
    if done.residual <= goal.tolerance {
        return Ok(true);
    }
    if done.iterations >= goal.max_iterations {
        return Err(SolveError::NotConverged {
            iterations: done.iterations,
            residual: done.residual,
            tolerance: goal.tolerance,
        });
    }
    (goal.report)(done);
    if (goal.interrupted)() {
        return Err(SolveError::Interrupted);
    }
    Ok(false)
}

/// One more iteration.
pub(super) fn iterated(done: &mut Relaxation, potential: &Potential) {
    done.iterations += 1;
    potential.mechanics().tally().count(|work| work.iterations += 1);
}

/// The error of a method whose steps became too short.
pub(super) fn stalled(done: &Relaxation, goal: &Goal<'_>) -> SolveError {
    SolveError::Stalled {
        iterations: done.iterations,
        residual: done.residual,
        tolerance: goal.tolerance,
    }
}

/// `error` of an iteration that `earlier` ones went before.
pub(super) fn after(earlier: usize, mut error: SolveError) -> SolveError {
    if let SolveError::NotConverged { iterations, .. } | SolveError::Stalled { iterations, .. } =
        &mut error
    {
        *iterations += earlier;
    }
    error
}

/// The error that names collapsed triangle `t`.
pub(super) fn collapsed_at(
    potential: &Potential,
    t: usize,
    iterations: usize,
    residual: f64,
) -> SolveError {
    let (sheet, metric) = (potential.sheet(), potential.metric());
    SolveError::Collapsed {
        triangle: t,
        vertices: sheet.triangles()[t],
        optimal: sheet.triangle_edges()[t].map(|e| metric.length()[e as usize]),
        iterations,
        residual,
    }
}

/// `error` with what explains it at `x`, where a relaxation to `tolerance` came to no end: a
/// [`diagnosis`](crate::solve::diagnosis), or else the flattest triangle, if that has collapsed.
/// Of an energy that is not a finite number, the first effect whose is not.
pub fn explained(
    error: SolveError,
    potential: &mut Potential,
    x: &[Vec3],
    tolerance: f64,
) -> SolveError {
    if matches!(error, SolveError::NotFinite) {
        return match potential.not_finite(x) {
            Some(effect) => SolveError::EffectNotFinite { effect, time: potential.time() },
            None => error,
        };
    }
    let (SolveError::NotConverged { iterations, residual, .. }
    | SolveError::Stalled { iterations, residual, .. }
    | SolveError::Collapsed { iterations, residual, .. }) = error
    else {
        return error;
    };
    if let Some(diagnosis) = diagnosis::relaxation(potential, x, (residual, tolerance)) {
        let diagnosis = Box::new(diagnosis);
        return SolveError::NotAtRest { iterations, residual, tolerance, diagnosis };
    }
    if matches!(error, SolveError::Collapsed { .. }) {
        let Some(diagnosis) = diagnosis::collapse(potential, x).map(Box::new) else { return error };
        return SolveError::NotAtRest { iterations, residual, tolerance, diagnosis };
    }
    let quality = |t: &[u32; 3]| triangle_quality(t.map(|v| x[v as usize]));
    let all = potential.sheet().triangles().iter().map(quality).enumerate();
    match all.min_by(|a, b| a.1.total_cmp(&b.1)) {
        Some((t, worst)) if worst < COLLAPSED => collapsed_at(potential, t, iterations, residual),
        _ => error,
    }
}

/// Energy differences below this share of the energy are round-off.
const ROUND_OFF: f64 = 1e-12;

/// Whether two energies are the same up to round-off. Where both are nearly nothing it is that of
/// the energy of one edge at unit strain: turning angles add up to nothing only in exact arithmetic.
pub(super) fn same_energy(potential: &Potential, before: f64, after: f64) -> bool {
    let edge = potential.force_scale() * potential.metric().mean_edge();
    (after - before).abs() <= ROUND_OFF * (before.abs() + edge)
}
