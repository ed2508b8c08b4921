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
//!
//! Their slopes follow from those of the others, d, by a difference over a short time ε,
//!
//! ```text
//! ∂F_a/∂y_a dy_a/dt = -(F_a(t + ε, y + ε dy_d/dt) - F_a(t, y))/ε
//! ```
//!
//! without which the first step of a multistep method is held to an error of the first order in its length.

use super::error_norm::Grouping;
use super::{OdeError, OdeProblem, Options, Result};
use crate::linear::Shifted;

/// Largest change, in units of the tolerance of a displacement or another unknown, that counts as none.
const STATIONARY_CHANGE: f64 = 0.1;
/// ε is so long that the solution changes by this share of its size, or of the span.
const SLOPE_SHARE: f64 = 1e-5;
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

/// dy/dt of all unknowns at consistent values; `None` where those without storage have no slope.
pub(super) fn consistent_slope(
    problem: &mut dyn OdeProblem,
    differential: &[bool],
    (time, y): (f64, &[f64]),
    (options, atol, span): (&Options, &[f64], f64),
    newton: Option<&mut Shifted>,
) -> Option<Vec<f64>> {
    let newton = newton?;
    let mut here = vec![0.0; y.len()];
    problem.rhs(time, y, &mut here).ok()?;
    let of = |i: usize, of_differential: bool| differential[i] == of_differential;
    let mut slope: Vec<f64> =
        (0..y.len()).map(|i| if of(i, true) { here[i] } else { 0.0 }).collect();
    let grouping = Grouping::new(options.displacements.as_ref());
    let norm = |x: &[f64]| grouping.squared_norm(x, y, (atol, options.rtol)).sqrt();
    let (size, speed) = (norm(y).max(1.0), norm(&slope));
    let short = SLOPE_SHARE * if speed * span > size { size / speed } else { span };
    let later: Vec<f64> = y.iter().zip(&slope).map(|(y, slope)| y + short * slope).collect();
    let mut change = vec![0.0; y.len()];
    problem.rhs(time + short, &later, &mut change).ok()?;
    for i in 0..y.len() {
        change[i] = if of(i, false) { (change[i] - here[i]) / short } else { 0.0 };
    }
    let row = |i: usize| if differential[i] { (1.0, 0.0) } else { (0.0, 1.0) };
    let jacobian = problem.jacobian(time, y).ok()?;
    newton.solve(jacobian, row, &mut change, &options.tally).ok()?;
    let finite = change.iter().all(|change| change.is_finite());
    for i in (0..y.len()).filter(|i| of(*i, false)) {
        slope[i] = change[i];
    }
    finite.then_some(slope)
}
