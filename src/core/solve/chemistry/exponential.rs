//! The exponential Rosenbrock method of orders 3 and 2: exact for whatever is linear.
//!
//! ```text
//! J = ∂F/∂c (t_n, c_n),   F_t = (F(t_n + h, c_n) - F(t_n, c_n)) / h
//! U       = c_n + h φ_1(hJ) F_n + h² φ_2(hJ) F_t
//! D       = F(t_n + h, U) - F_n - J (U - c_n) - h F_t
//! c_{n+1} = U + 2h φ_3(hJ) D,                         error estimate c_{n+1} - U
//! ```
//!
//! Source: Hochbruck, Ostermann & Schweitzer, "Exponential Rosenbrock-type methods", SIAM J. Numer.
//! Anal. 47 (2009) 786, doi:10.1137/080717717 (exprb32).

use super::PROGRESS_LABEL;
use super::chebyshev::Tolerance;
use super::krylov::polynomial_forcing;
use crate::linear::Sparse;
use crate::model::Coupled;
use crate::num::real;
use crate::solve::{Control, Result, SolveError, under_way};

/// Steps are proposed a little shorter than the estimate allows.
const SAFETY: f64 = 0.8;
/// A step below this share of the interval gives up.
const MIN_STEP_SHARE: f64 = 1e-10;
/// Steps after which an interval counts as hopeless.
const MAX_STEPS: usize = 100_000;
/// Error of the φ functions, relative to the tolerance of a step.
const PHI_TOLERANCE: f64 = 0.05;

/// Brings the unknowns `y` of `coupled` along the way; on error they hold the last accepted values.
pub(super) fn integrate(
    coupled: &mut Coupled,
    control: &Control,
    tolerance: &Tolerance<'_>,
    (from, until): (f64, f64),
    y: &mut Vec<f64>,
) -> Result<()> {
    let shortest = (MIN_STEP_SHARE * (until - from)).max(4.0 * f64::EPSILON * until.abs());
    let (mut t, mut step) = (from, until - from);
    let n = y.len();
    let mut start = vec![0.0; n];
    for _ in 0..MAX_STEPS {
        control.report(|| under_way(PROGRESS_LABEL, (from, t, until)));
        control.check()?;
        coupled.residual(t, y, &mut start)?;
        let jacobian = coupled.jacobian(t, y)?.clone();
        loop {
            let last = t + step >= until - shortest;
            let end = if last { until } else { t + step };
            let h = end - t;
            control.check()?;
            let (error, cause) = match step_of(coupled, tolerance, &jacobian, (t, h), y, &start) {
                Ok(Some((next, error))) if error <= 1.0 => {
                    *y = next;
                    t = end;
                    coupled.tally().count(|work| work.substeps += 1);
                    if last {
                        return Ok(());
                    }
                    step = h * (SAFETY / error.cbrt()).clamp(0.5, 4.0);
                    break;
                }
                Ok(Some((_, error))) => (error, None),
                Ok(None) => (f64::INFINITY, None),
                Err(e) if e.is_recoverable() => (f64::INFINITY, Some(e)),
                Err(e) => return Err(e),
            };
            coupled.tally().count(|work| work.rejected_substeps += 1);
            let finite = error.is_finite();
            step = h * if finite { (SAFETY / error.cbrt()).clamp(0.1, SAFETY) } else { 0.25 };
            if step < shortest {
                let too_small = SolveError::StepTooSmall { time: t, step };
                return Err(cause.unwrap_or(too_small));
            }
        }
    }
    Err(SolveError::TooManySteps { time: t, steps: MAX_STEPS })
}

/// One step and its error in units of the tolerance; `None` if it is too long for the φ functions.
fn step_of(
    coupled: &mut Coupled,
    tolerance: &Tolerance<'_>,
    jacobian: &Sparse,
    (t, h): (f64, f64),
    y: &[f64],
    start: &[f64],
) -> Result<Option<(Vec<f64>, f64)>> {
    let n = y.len();
    let unit: Vec<f64> =
        y.iter().zip(tolerance.absolute).map(|(y, a)| a + tolerance.relative * y.abs()).collect();
    // In units of the tolerance, so that the Euclidean norm is the one that counts.
    let tally = coupled.tally().clone();
    let apply = |v: &[f64], out: &mut [f64]| {
        tally.count(|work| work.krylov_iterations += 1);
        let v: Vec<f64> = v.iter().zip(&unit).map(|(v, unit)| v * unit).collect();
        jacobian.multiply(&v, out);
        out.iter_mut().zip(&unit).for_each(|(out, unit)| *out /= unit);
    };
    let scaled = |v: &[f64]| -> Vec<f64> { v.iter().zip(&unit).map(|(v, u)| v / u).collect() };
    let zero = vec![0.0; n];
    let mut later = vec![0.0; n];
    coupled.residual(t + h, y, &mut later)?;
    let drift: Vec<f64> = later.iter().zip(start).map(|(b, a)| (b - a) / h).collect();
    let forcing = [&scaled(start)[..], &scaled(&drift), &zero];
    let Some(first) = polynomial_forcing(apply, forcing, h, PHI_TOLERANCE) else { return Ok(None) };
    let change: Vec<f64> = first.iter().zip(&unit).map(|(v, unit)| v * unit).collect();
    let mut next: Vec<f64> = y.iter().zip(&change).map(|(y, change)| y + change).collect();
    // What is not linear, at the end of the step.
    let mut rest = vec![0.0; n];
    coupled.residual(t + h, &next, &mut rest)?;
    let mut linear = vec![0.0; n];
    jacobian.multiply(&change, &mut linear);
    for i in 0..n {
        rest[i] = 2.0 / (h * h) * (rest[i] - start[i] - linear[i] - h * drift[i]);
    }
    let forcing = [&zero[..], &zero, &scaled(&rest)];
    let Some(second) = polynomial_forcing(apply, forcing, h, PHI_TOLERANCE) else {
        return Ok(None);
    };
    for ((next, second), unit) in next.iter_mut().zip(&second).zip(&unit) {
        *next += second * unit;
    }
    let sum: f64 = second.iter().map(|e| e * e).sum();
    Ok(Some((next, (sum / real(n.max(1))).sqrt())))
}
