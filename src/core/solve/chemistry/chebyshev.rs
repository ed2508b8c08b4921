//! Runge-Kutta-Chebyshev: a stabilised explicit integrator of second order for diffusion.
//!
//! With s stages the method is stable for `ρ Δt ≤ 2/3 (s² - 1)(1 - 2ε/15)`, ρ the spectral radius,
//! so s grows with the square root of the stiffness and no linear system is solved.
//!
//! ```text
//! w_0 = 1 + ε/s²,  w_1 = T_s'(w_0)/T_s''(w_0),  b_j = T_j''(w_0)/T_j'(w_0)²,  b_0 = b_1 = b_2
//! Y_0 = y,  Y_1 = Y_0 + μ̃_1 Δt F_0
//! Y_j = (1-μ_j-ν_j) Y_0 + μ_j Y_{j-1} + ν_j Y_{j-2} + μ̃_j Δt F_{j-1} + γ̃_j Δt F_0
//! ```
//!
//! Error estimate `0.8 (y_n - y_{n+1}) + 0.4 Δt (F_n + F_{n+1})`, in the root mean square norm
//! with weights `atol_i + rtol |y_i|`.
//!
//! Source: Sommeijer, Shampine & Verwer, "RKC: an explicit solver for parabolic PDEs",
//! J. Comput. Appl. Math. 88 (1998) 315, doi:10.1016/S0377-0427(97)00219-7.

use crate::model::ModelError;
use crate::num::{real, whole};
use crate::parallel;
use crate::reduction::Reduction;
use crate::solve::{Result, SolveError};
use crate::tally::Work;

/// Damping of the stability polynomial; keeps a strip around the negative axis stable.
const DAMPING: f64 = 2.0 / 13.0;
/// Most stages; rounding errors grow with their square.
const MAX_STAGES: f64 = 250.0;
/// Steps are proposed a little shorter than the estimate allows.
const SAFETY: f64 = 0.8;
/// Steps after which an interval counts as hopeless.
const MAX_STEPS: usize = 100_000;
/// Steps of an interval from which on rejections are inspected, and the share of them at which rates are taken
/// to jump without end: one for so many accepted. A law that switches sides all the time needs some ten
/// thousand steps in `models/hard/cases.toml`, with as many rejections, and continues.
const REJECTION_CHECK_STEPS: u64 = 30_000;
const CHATTER_RATIO: u64 = 2;
/// A step below this share of the interval gives up.
const MIN_STEP_SHARE: f64 = 1e-12;
/// The spectral bound is raised by this factor against its change within a step.
const SPECTRAL_MARGIN: f64 = 1.1;

/// Tolerances of one integration.
#[derive(Debug, Clone, Copy)]
pub struct Tolerance<'a> {
    /// Relative tolerance.
    pub relative: f64,
    /// Absolute tolerance of every component.
    pub absolute: &'a [f64],
}

/// The integrator with its work arrays.
#[derive(Debug, Default)]
pub struct Chebyshev {
    /// What the error norm is summed over, and unknowns of a point.
    over: (Reduction, usize),
    work: Work,
    f0: Vec<f64>,
    f: Vec<f64>,
    y0: Vec<f64>,
    y1: Vec<f64>,
    y2: Vec<f64>,
}

impl Chebyshev {
    /// Sums errors by `reduction`, with so many unknowns `per_point`, one point after the other.
    pub(crate) fn set_error_norm(&mut self, reduction: &Reduction, per_point: usize) {
        self.over = (reduction.clone(), per_point);
    }

    /// Work done so far: substeps and calls of `rate`.
    #[must_use]
    pub fn work(&self) -> Work {
        self.work
    }

    /// Integrates `dy/dt = rate(t, y)` from `from` to `until`, which is met exactly; `bound` is at
    /// least the spectral radius of ∂rate/∂y, 1/time. Eigenvalues must lie near the negative real
    /// axis; others are met by shorter steps.
    ///
    /// The whole interval is tried first: it is a step of the coupling already, chosen by an error
    /// estimate of its own. Nothing is remembered between calls but work arrays and counts, so a
    /// restarted run repeats the bits of an uninterrupted one.
    ///
    /// On error `y` holds the last accepted values.
    ///
    /// # Errors
    /// Errors of `rate` that no shorter step cures; the last of those that persisted down to the
    /// shortest step; [`SolveError::StepTooSmall`] for an error estimate that did;
    /// [`SolveError::SpectralBound`]; [`SolveError::TooManySteps`].
    pub fn integrate(
        &mut self,
        from: f64,
        until: f64,
        y: &mut [f64],
        tolerance: &Tolerance<'_>,
        bound: f64,
        mut rate: impl FnMut(f64, &[f64], &mut [f64]) -> Result<()>,
    ) -> Result<()> {
        self.resize(y.len());
        if until <= from {
            return Ok(());
        }
        let (bound, longest) =
            stability_limits(bound).ok_or(SolveError::SpectralBound { time: from })?;
        if (until - from) / longest > real(MAX_STEPS) {
            return Err(SolveError::TooManySteps { time: from, steps: MAX_STEPS });
        }
        let shortest = shortest_step(from, until);
        let (mut t, mut step) = (from, until - from);
        rate(t, y, &mut self.f0)?;
        self.work.right_hand_sides += 1;
        let before = self.work;
        let mut refused = None;
        for _ in 0..MAX_STEPS {
            let done = self.work - before;
            if chatters(&done) {
                return Err(inadmissible(t, refused)
                    .unwrap_or_else(|| self.unresolved(t, step, &done, tolerance)));
            }
            step = step.min(longest);
            let last = t + step >= until - shortest;
            let end = if last { until } else { t + step };
            let h = end - t;
            self.y0.copy_from_slice(y);
            let (error, cause) = match self.stages(t, h, h * bound, &mut rate) {
                Ok(()) => (self.error(h, tolerance), None),
                Err(e) if e.is_recoverable() => (f64::INFINITY, Some(e)),
                Err(e) => return Err(e),
            };
            if error <= 1.0 {
                y.copy_from_slice(&self.y2);
                std::mem::swap(&mut self.f0, &mut self.f);
                self.work.substeps += 1;
                t = end;
                if last {
                    return Ok(());
                }
                step = h * (SAFETY / error.cbrt()).clamp(0.5, 4.0);
            } else {
                self.work.rejected_substeps += 1;
                step = h * shortening(error);
                if step.is_nan() || step < shortest {
                    return Err(cause.unwrap_or(SolveError::StepTooSmall { time: t, step }));
                }
                refused = cause.or(refused);
            }
        }
        Err(SolveError::TooManySteps { time: t, steps: MAX_STEPS })
    }

    /// Gives all arrays `n` entries.
    fn resize(&mut self, n: usize) {
        for array in [&mut self.f0, &mut self.f, &mut self.y0, &mut self.y1, &mut self.y2] {
            array.resize(n, 0.0);
        }
    }

    /// All stages of one step from `y0` with `f0`: leaves the result in `y2`, its rate in `f`.
    fn stages(
        &mut self,
        t: f64,
        h: f64,
        stiffness: f64,
        rate: &mut impl FnMut(f64, &[f64], &mut [f64]) -> Result<()>,
    ) -> Result<()> {
        let stages =
            whole((1.5 * stiffness / (1.0 - 2.0 * DAMPING / 15.0) + 1.0).sqrt().ceil()).max(2);
        let s = real(stages);
        let w0 = 1.0 + DAMPING / (s * s);
        let root = (w0 * w0 - 1.0).sqrt();
        let arg = s * (w0 + root).ln();
        // w1 = T'/T'' in closed form.
        let w1 = arg.sinh() * (w0 * w0 - 1.0) / (arg.cosh() * s * root - w0 * arg.sinh());
        let (y0, f0) = (&self.y0, &self.f0);
        let mut b_before = 1.0 / (4.0 * w0 * w0);
        let mut b_last = b_before;
        let first = w1 * b_last;
        let (before, last) = (&mut self.y1, &mut self.y2);
        before.copy_from_slice(y0);
        parallel::fill(last, |i| y0[i] + first * h * f0[i]);
        // Chebyshev polynomials and derivatives at w0, and the stages' times.
        let (mut z0, mut z1, mut d0, mut d1, mut dd0, mut dd1) = (1.0, w0, 0.0, 1.0, 0.0, 0.0);
        let (mut time_before, mut time_last) = (0.0, first);
        for _ in 2..=stages {
            let z = 2.0 * w0 * z1 - z0;
            let d = 2.0 * w0 * d1 - d0 + 2.0 * z1;
            let dd = 2.0 * w0 * dd1 - dd0 + 4.0 * d1;
            let b = dd / (d * d);
            let a_last = 1.0 - z1 * b_last;
            let mu = 2.0 * w0 * b / b_last;
            let nu = -b / b_before;
            let mu_rate = mu * w1 / w0;
            let gamma = mu_rate * a_last;
            rate(t + h * time_last, last, &mut self.f)?;
            self.work.right_hand_sides += 1;
            let (f, recent) = (&self.f, &*last);
            parallel::update(before, |i, old| {
                *old = mu * recent[i]
                    + nu * *old
                    + (1.0 - mu - nu) * y0[i]
                    + h * mu_rate * (f[i] - a_last * f0[i]);
            });
            let time = mu * time_last + nu * time_before + mu_rate - gamma;
            std::mem::swap(before, last);
            (b_before, b_last) = (b_last, b);
            (time_before, time_last) = (time_last, time);
            (z0, z1, d0, d1, dd0, dd1) = (z1, z, d1, d, dd1, dd);
        }
        rate(t + h, last, &mut self.f)?;
        self.work.right_hand_sides += 1;
        Ok(())
    }

    /// What to say of steps of some `length` that get nowhere at time t: whose rate changed most in the last one.
    fn unresolved(
        &self,
        t: f64,
        length: f64,
        done: &Work,
        tolerance: &Tolerance<'_>,
    ) -> SolveError {
        let jump = |i: usize| (self.f[i] - self.f0[i]).abs() / tolerance.absolute[i];
        let most = (0..self.f.len()).max_by(|a, b| jump(*a).total_cmp(&jump(*b))).unwrap_or(0);
        SolveError::Unresolved {
            time: t,
            length,
            steps: [done.substeps, done.rejected_substeps],
            unknown: most,
            what: format!("unknown {most}"),
            rates: [self.f0[most], self.f[most]],
        }
    }

    /// Error estimate of the step in `y2` in units of the tolerance; not finite if any value is not.
    fn error(&self, h: f64, tolerance: &Tolerance<'_>) -> f64 {
        let (y0, y, f0, f) = (&self.y0, &self.y2, &self.f0, &self.f);
        let (reduction, per_point) = (&self.over.0, self.over.1.max(1));
        let points = y.len() / per_point;
        let mut own = [parallel::sum(per_point * reduction.owned(points), |i| {
            let estimate = 0.8 * (y0[i] - y[i]) + 0.4 * h * (f0[i] + f[i]);
            let unit = tolerance.absolute[i] + tolerance.relative * y0[i].abs().max(y[i].abs());
            (estimate / unit).powi(2)
        })];
        reduction.sum_over_ranks(&mut own);
        (own[0] / (real(per_point) * reduction.count(points)).max(1.0)).sqrt()
    }
}

/// The spectral radius that steps are made for where `bound` is one, with a margin, and the longest stable step.
fn stability_limits(bound: f64) -> Option<(f64, f64)> {
    let bound = SPECTRAL_MARGIN * bound;
    let longest = if bound > 0.0 { stable_interval(MAX_STAGES) / bound } else { f64::INFINITY };
    bound.is_finite().then_some((bound, longest))
}

/// Largest `ρ Δt` for which `stages` are stable.
fn stable_interval(stages: f64) -> f64 {
    2.0 / 3.0 * (stages * stages - 1.0) * (1.0 - 2.0 * DAMPING / 15.0)
}

/// The cause of rejected steps at `time`, where that is a coefficient that species have made inadmissible.
fn inadmissible(time: f64, cause: Option<SolveError>) -> Option<SolveError> {
    match cause {
        Some(SolveError::Model(cause @ ModelError::Coefficient { .. })) => {
            Some(SolveError::Inadmissible { time, cause })
        }
        _ => None,
    }
}

/// Whether so many steps are rejected that the rates are not resolved.
fn chatters(done: &Work) -> bool {
    done.substeps >= REJECTION_CHECK_STEPS
        && done.rejected_substeps >= done.substeps / CHATTER_RATIO
}

/// The shortest step, so that none is lost in the rounding of the time either.
fn shortest_step(from: f64, until: f64) -> f64 {
    let rounding = 4.0 * f64::EPSILON * from.abs().max(until.abs());
    (MIN_STEP_SHARE * (until - from)).max(rounding)
}

/// Factor of the length of a step after one rejected with this error.
fn shortening(error: f64) -> f64 {
    if error.is_finite() { (SAFETY / error.cbrt()).clamp(0.1, SAFETY) } else { 0.25 }
}
