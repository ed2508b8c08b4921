//! Prescribed positions that lie far from where the sheet is: gone to in steps.
//!
//! A vertex that moves by an edge at once may turn its triangles inside out, and no way downhill turns them
//! back. So prescribed positions are gone to along straight lines, as far at once as no triangle loses more of its
//! area than a step of the method may take, and where that is not all the way the sheet is relaxed roughly, which
//! spreads the displacement, before the next increment.

use super::{Equilibrium, Goal, Relaxation};
use crate::Vec3;
use crate::model::Potential;
use crate::solve::SolveError;

/// No triangle's area may fall below this share at once.
pub(in crate::solve) const MIN_AREA_SHARE: f64 = 0.4;
/// Most parts, and smallest part of the whole way that is tried.
const PART_LIMITS: (usize, f64) = (400, 1e-4);
/// How well the sheet is relaxed in between, and by how many iterations at most.
const INTERMEDIATE_LIMITS: (f64, usize) = (1e-2, 30);

/// Takes the vertices of `x` that are elsewhere in `to` there; the last part is not relaxed.
///
/// # Errors
/// [`SolveError::Interrupted`], and energies that are not finite.
pub(in crate::solve) fn load_incrementally(
    method: &mut dyn Equilibrium,
    potential: &mut Potential,
    x: &mut [Vec3],
    to: &[Vec3],
    goal: &Goal<'_>,
) -> Result<Relaxation, SolveError> {
    let ways: Vec<(usize, Vec3, Vec3)> = (x.iter().zip(to).enumerate())
        .filter(|(_, (from, to))| from != to)
        .map(|(i, (from, to))| (i, *from, *to))
        .collect();
    let place = |x: &mut [Vec3], share: f64| {
        for (i, from, to) in &ways {
            x[*i] = if share >= 1.0 { *to } else { from + share * (to - from) };
        }
    };
    let mut done = Relaxation::default();
    let (mut gone, mut part) = (0.0, 1.0);
    let mut next = x.to_vec();
    for _ in 0..if ways.is_empty() { 0 } else { PART_LIMITS.0 } {
        loop {
            next.copy_from_slice(x);
            place(&mut next, gone + part);
            if part < PART_LIMITS.1 || potential.allows(x, &next, MIN_AREA_SHARE) {
                break;
            }
            part *= 0.5;
        }
        gone += part;
        if gone >= 1.0 || part < PART_LIMITS.1 {
            break;
        }
        x.copy_from_slice(&next);
        let rough = Goal {
            tolerance: goal.tolerance.max(INTERMEDIATE_LIMITS.0),
            max_iterations: goal.max_iterations.min(INTERMEDIATE_LIMITS.1),
            ..*goal
        };
        match method.relax(potential, x, &rough) {
            Ok(round) => done.add(&round),
            Err(SolveError::NotConverged { iterations, .. }) => done.iterations += iterations,
            // What matters is the relaxation at the end.
            Err(SolveError::Stalled { .. } | SolveError::Collapsed { .. }) => {}
            Err(error) => return Err(error),
        }
        part = (2.0 * part).min(1.0 - gone);
    }
    place(x, 1.0);
    Ok(done)
}
