//! Equilibrium under constraints: any method, by an augmented Lagrangian.
//!
//! ```text
//! L(x) = U(x) - Σ λ g(x) + ½ Σ μ g(x)²
//! x ← argmin L (the method's own way),   λ ← λ - μ g(x),   until |g| ≤ 1e-9
//! ```
//!
//! λ starts from what balances the forces at the shape given. A round takes the error of g down by
//! some hundred times (see `model/constraint.rs`), and what little is left is taken away by a last step
//! along ∂g, if the shape is then still at rest within the tolerance. Without constraints this is the
//! method alone.

use super::{Equilibrium, Goal, Relaxation};
use crate::Vec3;
use crate::model::Potential;
use crate::solve::SolveError;
use crate::solve::equilibrium::CONSTRAINT_TOLERANCE;

/// Rounds after which the constraints count as impossible.
const MAX_ROUNDS: usize = 60;

/// Relaxes `x` in place by `method`, constraints included; on an error `x` is the last good shape.
///
/// # Errors
/// Those of the method; [`SolveError::Constraint`] if no shape is found that meets the constraints.
pub fn relax(
    method: &mut dyn Equilibrium,
    potential: &mut Potential,
    x: &mut [Vec3],
    goal: &Goal<'_>,
) -> Result<Relaxation, SolveError> {
    if !potential.is_constrained() {
        return method.relax(potential, x, goal);
    }
    let mut done = Relaxation::default();
    let mut gradient = vec![Vec3::zeros(); x.len()];
    potential.balance(x, true);
    let mut largest = None;
    for _ in 0..MAX_ROUNDS {
        let left = goal.max_iterations.saturating_sub(done.iterations);
        let round = method
            .relax(potential, x, &Goal { max_iterations: left, ..*goal })
            .map_err(|error| super::stop::after(done.iterations, error))?;
        done.add(&round);
        let before = potential.multipliers().to_vec();
        potential.update_multipliers(x);
        let after = potential.multipliers().to_vec();
        let mut near = x.to_vec();
        if potential.project(&mut near) <= CONSTRAINT_TOLERANCE {
            potential.balance(&near, false);
            done.energy = potential.energy_gradient(&near, &mut gradient);
            let residual = potential.residual(&gradient);
            if residual <= goal.tolerance {
                done.residual = residual;
                x.copy_from_slice(&near);
                return Ok(done);
            }
            largest = Some(residual);
        }
        if before == after {
            break;
        }
        potential.set_multipliers(after);
    }
    let values = potential.constraint_values(x);
    let names = potential.mechanics().constraint_names();
    let worst = names.zip(&values).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let (constraint, value) = worst.map_or_else(Default::default, |(n, g)| (n.to_owned(), *g));
    Err(SolveError::Constraint { constraint, value, residual: largest })
}
