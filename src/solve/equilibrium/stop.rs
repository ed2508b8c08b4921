//! When an iteration ends, and the sums it needs: the same for all methods.

use super::{Goal, Relaxation};
use crate::Vec3;
use crate::parallel;
use crate::solve::SolveError;

/// Whether the goal is reached; otherwise one more iteration may be made.
///
/// # Errors
/// Numbers that are not finite, too many iterations, an interruption.
pub(super) fn reached(done: &Relaxation, goal: &Goal<'_>) -> Result<bool, SolveError> {
    if done.residual <= goal.tolerance {
        return Ok(true);
    }
    if !(done.energy.is_finite() && done.residual.is_finite()) {
        return Err(SolveError::NotFinite);
    }
    if done.iterations >= goal.max_iterations {
        return Err(SolveError::NotConverged {
            iterations: done.iterations,
            residual: done.residual,
            tolerance: goal.tolerance,
        });
    }
    if (goal.interrupted)() {
        return Err(SolveError::Interrupted);
    }
    Ok(false)
}

/// The error of a method whose steps became too short.
pub(super) fn stalled(done: &Relaxation, goal: &Goal<'_>) -> SolveError {
    SolveError::Stalled {
        iterations: done.iterations,
        residual: done.residual,
        tolerance: goal.tolerance,
    }
}

/// `Σ_i a_i · b_i`.
pub(super) fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    parallel::sum(a.len(), |i| a[i].dot(&b[i]))
}

/// `max_i |a_i|`.
pub(super) fn largest(a: &[Vec3]) -> f64 {
    parallel::max(a.len(), |i| a[i].norm_squared()).sqrt()
}
