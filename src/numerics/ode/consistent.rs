//! A start that satisfies the rows without storage.
//!
//! Where a row has no storage, its unknowns jump in the first step by what they are away from `F = 0`,
//! however short the step: an error test that sees a jump above the tolerance rejects every step. A
//! relaxation ends at a small force, which soft directions turn into a distance far above the
//! tolerance of an integration. Newton's method from there takes few iterations:
//!
//! ```text
//! ∂F_a/∂y_a δ = -F_a        a: rows and unknowns without storage
//! ```

use super::error_norm::Grouping;
use super::{OdeError, OdeProblem, Options, Result};
use crate::linear::Shifted;

/// Largest change, in units of the tolerance of a displacement or another unknown, that counts as none.
const STATIONARY_CHANGE: f64 = 0.1;
/// Iterations after which the start stays as it was.
const MAX_ITERATIONS: usize = 20;

/// Brings the unknowns of `y` that have no storage to where `F = 0`. Where Newton's method does not
/// lead there, `y` stays as it was: the integrator may still get away from it. `newton` is memory that
/// the next start of the same problem can use.
///
/// # Errors
/// If F or its derivatives cannot be evaluated at the start.
pub(super) fn make_consistent(
    problem: &mut dyn OdeProblem,
    differential: &[bool],
    (time, y): (f64, &mut [f64]),
    (options, atol): (&Options, &[f64]),
    newton: &mut Option<Shifted>,
) -> Result<()> {
    let mut tried = y.to_vec();
    let mut change = vec![0.0; y.len()];
    let mut last = f64::INFINITY;
    let grouping = Grouping::new(options.displacements.as_ref());
    for iteration in 0..MAX_ITERATIONS {
        // Beyond the start Newton's method may come to where nothing can be evaluated.
        let forgive = |error: OdeError| match error.is_recoverable() && iteration > 0 {
            true => Ok(()),
            false => Err(error),
        };
        if let Err(error) = problem.rhs(time, &tried, &mut change) {
            return forgive(error.into());
        }
        for (change, differential) in change.iter_mut().zip(differential) {
            if *differential {
                *change = 0.0;
            }
        }
        let jacobian = match problem.jacobian(time, &tried) {
            Ok(jacobian) => jacobian,
            Err(error) => return forgive(error.into()),
        };
        let newton = match newton {
            Some(newton) => newton,
            None => {
                let displacements = options.displacements.as_ref();
                newton.insert(Shifted::new(jacobian, options.linear, displacements)?)
            }
        };
        let row = |i: usize| if differential[i] { (1.0, 0.0) } else { (0.0, 1.0) };
        if newton.solve(jacobian, row, &mut change, &options.tally).is_err() {
            return Ok(());
        }
        tried.iter_mut().zip(&change).for_each(|(tried, change)| *tried += change);
        let sizes = grouping.ratios(&change, &tried, (atol, options.rtol));
        // NaN counts as well.
        let larger = |most: f64, size: f64| if size > most || size.is_nan() { size } else { most };
        let largest = sizes.fold(0.0, larger).sqrt();
        if !(largest < last) {
            return Ok(());
        }
        if largest < STATIONARY_CHANGE {
            y.copy_from_slice(&tried);
            return Ok(());
        }
        last = largest;
    }
    Ok(())
}
