//! Stages of a step, solved to round-off, and transposed systems with their derivatives.

use crate::linear::{ShiftedJacobian, Sparse, SparseLu};
use crate::model::Coupled;
use crate::num::real;
use crate::solve::{Control, Result, SolveError};

/// The diagonal of the method, and what follows from it.
pub(super) const GAMMA: f64 = 0.435_866_521_508_459;
const TAU: f64 = 0.5 * (1.0 + GAMMA);
const B1: f64 = -0.25 * (6.0 * GAMMA * GAMMA - 16.0 * GAMMA + 1.0);
const B2: f64 = 0.25 * (6.0 * GAMMA * GAMMA - 20.0 * GAMMA + 5.0);
/// Stages of a step.
pub(super) const STAGES: usize = 3;
/// Times of stages, in steps.
const ABSCISSA: [f64; STAGES] = [GAMMA, TAU, 1.0];
/// a_ij/γ below the diagonal.
const LOWER: [[f64; 2]; STAGES] =
    [[0.0, 0.0], [(TAU - GAMMA) / GAMMA, 0.0], [B1 / GAMMA, B2 / GAMMA]];
/// Weight of the second stage in the embedded solution; that of the third is 0.
const EMBEDDED: f64 = (0.5 - GAMMA) / (TAU - GAMMA);
/// Difference from the embedded solution by the slopes of stages, over γ.
const ERROR: [f64; STAGES] = [(B1 - 1.0 + EMBEDDED) / GAMMA, (B2 - EMBEDDED) / GAMMA, 1.0];

/// Changes of a solution below this share of it are round-off;
const ROUND_OFF: f64 = 1e-13;
/// and where they do not fall any further, below this.
const ACCEPTED: f64 = 1e-8;
/// A factor whose corrections fall less than by this is replaced.
const SLOW: f64 = 0.2;
const MAX_ITERATIONS: usize = 40;

/// A step, or a time between breakpoints in which steps are made.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Window {
    /// Where it begins: just after a breakpoint.
    pub start: f64,
    /// Where it ends: just before a breakpoint.
    pub end: f64,
    /// The time of the state at its end.
    pub shown_time: f64,
}

/// Unknowns at the stages of a step.
pub(super) type Stages = [Vec<f64>; STAGES];

/// Solves for the stages of steps.
pub(super) struct StageSolver {
    pub(super) coupled: Coupled,
    /// The diagonal of M.
    pub(super) mass: Vec<f64>,
    /// Mean edges and typical magnitudes.
    units: Vec<f64>,
    control: Control,
    /// With the γh that it is for.
    factor: Option<(SparseLu, f64)>,
}

impl StageSolver {
    /// Reports the step that is worked on.
    pub(super) fn report(&self, what: &str, step: Window) {
        self.control.report(|| format!("{what}, time {:.3e}", step.shown_time));
    }

    pub(super) fn new(coupled: Coupled, control: &Control) -> Self {
        let (mass, units) = (coupled.mass().collect(), coupled.tolerances(1.0));
        Self { coupled, mass, units, control: control.clone(), factor: None }
    }

    /// The largest values of displacements and of every species.
    fn largest(&self, v: &[f64]) -> Vec<f64> {
        let layout = self.coupled.layout();
        let mut all = vec![0.0f64; 1 + layout.species()];
        v.iter().enumerate().for_each(|(k, v)| {
            let of = &mut all[self.field(k)];
            // NaN stays.
            *of = if v.abs() <= *of { *of } else { v.abs() };
        });
        all
    }

    /// 0 of displacements, and one more than its number of a species.
    fn field(&self, unknown: usize) -> usize {
        let layout = self.coupled.layout();
        unknown.checked_sub(layout.mechanical()).map_or(0, |k| 1 + k % layout.species())
    }

    /// Largest change relative to the size of its field, which counts as no smaller than `least` units.
    fn share(&self, change: &[f64], of: &[f64], least: f64) -> f64 {
        let (change, mut size) = (self.largest(change), self.largest(of));
        self.units.iter().enumerate().for_each(|(k, unit)| {
            let field = self.field(k);
            size[field] = size[field].max(least * unit);
        });
        let share = |(change, size): (f64, f64)| if change == 0.0 { 0.0 } else { change / size };
        let shares = change.into_iter().zip(size).map(share);
        shares.fold(0.0, |most: f64, share| if share <= most { most } else { share })
    }

    fn factorise(&mut self, unit: f64) -> Result<()> {
        let Self { coupled, mass, factor, .. } = self;
        coupled.tally().count(|work| work.factorisations += 1);
        let jacobian = coupled.last_jacobian();
        let (mut lu, _) = match factor.take() {
            Some(factor) => factor,
            None => (SparseLu::new(jacobian)?, unit),
        };
        lu.factorise(ShiftedJacobian::new(jacobian, &|k| (mass[k] / unit, 1.0)))?;
        *factor = Some((lu, unit));
        Ok(())
    }

    fn solve(&mut self, right: &mut [f64], transposed: bool) -> Result<()> {
        let Some((lu, _)) = &mut self.factor else { return Err(SolveError::NotFinite) };
        match transposed {
            true => lu.solve_transposed(right)?,
            false => lu.solve(right)?,
        }
        Ok(())
    }

    /// Y of `m (Y - before) = F(Y) + known`, from the guess `y`; gives F there.
    fn stage(
        &mut self,
        (time, unit): (f64, f64),
        (before, known): (&[f64], &[f64]),
        y: &mut [f64],
    ) -> Result<Vec<f64>> {
        let mut slope = vec![0.0; y.len()];
        let mut last = f64::INFINITY;
        for _ in 0..MAX_ITERATIONS {
            self.control.check()?;
            if self.factor.as_ref().is_none_or(|(_, made_for)| *made_for != unit) {
                self.coupled.jacobian(time, y)?;
                self.factorise(unit)?;
            }
            self.coupled.residual(time, y, &mut slope)?;
            let mut change: Vec<f64> = (0..y.len())
                .map(|k| slope[k] + known[k] - self.mass[k] / unit * (y[k] - before[k]))
                .collect();
            self.solve(&mut change, false)?;
            add(y, 1.0, &change);
            let size = self.share(&change, y, 1.0);
            if size <= ROUND_OFF || (size <= ACCEPTED && size > 0.5 * last) {
                self.coupled.residual(time, y, &mut slope)?;
                return Ok(slope);
            }
            if !size.is_finite() || size > 2.0 * last {
                break;
            }
            if size > SLOW * last {
                self.factor = self.factor.take().map(|(lu, _)| (lu, f64::NAN));
            }
            last = size;
        }
        Err(SolveError::NotFinite)
    }

    /// The stages of a step from `before`, with the estimate of its error in tolerances.
    pub(super) fn step(
        &mut self,
        span: Window,
        before: &[f64],
        tolerance: (f64, f64),
    ) -> Result<(Stages, f64)> {
        let n = before.len();
        let unit = GAMMA * (span.end - span.start);
        let with_storage: Vec<f64> = self.mass.iter().map(|m| f64::from(*m != 0.0)).collect();
        let mut stages: Stages = Default::default();
        let mut slopes: Vec<Vec<f64>> = Vec::new();
        for i in 0..STAGES {
            let mut known = vec![0.0; n];
            slopes.iter().enumerate().for_each(|(j, slope)| add(&mut known, LOWER[i][j], slope));
            known.iter_mut().zip(&with_storage).for_each(|(known, d)| *known *= d);
            let mut y = i.checked_sub(1).map_or(before, |last| &stages[last]).to_vec();
            slopes.push(self.stage((stage_time(span, i), unit), (before, &known), &mut y)?);
            stages[i] = y;
        }
        let mut error = vec![0.0; n];
        slopes.iter().zip(ERROR).for_each(|(slope, weight)| add(&mut error, weight, slope));
        error.iter_mut().zip(&with_storage).for_each(|(error, d)| *error *= d);
        self.solve(&mut error, false)?;
        let estimate = self.in_tolerances(&error, &stages[STAGES - 1], tolerance);
        Ok((stages, estimate))
    }

    /// Root mean square of an error of `y` in tolerances, the largest of all fields.
    fn in_tolerances(&self, error: &[f64], y: &[f64], (rtol, atol): (f64, f64)) -> f64 {
        let size = self.largest(y);
        let (mut sum, mut count) = (vec![0.0; size.len()], vec![0usize; size.len()]);
        for (k, error) in error.iter().enumerate() {
            let field = self.field(k);
            sum[field] += (error / (atol * self.units[k] + rtol * size[field])).powi(2);
            count[field] += 1;
        }
        let mean = |(sum, count): (f64, usize)| (sum / real(count.max(1))).sqrt();
        sum.into_iter().zip(count).map(mean).fold(0.0, |m, e| if e <= m { m } else { e })
    }

    /// μ of all stages, and what F is weighed by there.
    pub(super) fn transposed_step(
        &mut self,
        span: Window,
        stages: &Stages,
        lambda: &[f64],
    ) -> Result<(Stages, Stages)> {
        let (n, unit) = (lambda.len(), GAMMA * (span.end - span.start));
        let (mut mu, mut weights): (Stages, Stages) = Default::default();
        for i in (0..STAGES).rev() {
            self.control.check()?;
            let mut through = vec![0.0; n];
            (i + 1..STAGES).for_each(|j| add(&mut through, LOWER[j][i], &mu[j]));
            through.iter_mut().zip(&self.mass).for_each(|(w, m)| *w *= f64::from(*m != 0.0));
            self.coupled.jacobian(stage_time(span, i), &stages[i])?;
            let mut right = self.coupled.last_jacobian().multiply_transposed(&through);
            if i == STAGES - 1 {
                add(&mut right, -1.0, lambda);
            }
            mu[i] = self.transposed(unit, &right)?;
            weights[i] = through;
            add(&mut weights[i], 1.0, &mu[i]);
        }
        Ok((mu, weights))
    }

    /// Solves `(m - J)ᵀ μ = right` with the Jacobian evaluated last.
    fn transposed(&mut self, unit: f64, right: &[f64]) -> Result<Vec<f64>> {
        let (mut mu, mut left) = (vec![0.0; right.len()], right.to_vec());
        let (mut last, mut own) = (f64::INFINITY, false);
        for _ in 0..MAX_ITERATIONS {
            if self.factor.as_ref().is_none_or(|(_, made_for)| *made_for != unit) {
                self.factorise(unit)?;
                own = true;
            }
            self.solve(&mut left, true)?;
            add(&mut mu, 1.0, &left);
            let size = self.share(&left, &mu, 0.0);
            if size <= ROUND_OFF || (own && size > 0.5 * last) {
                break;
            }
            if size > SLOW * last && !own {
                self.factor = self.factor.take().map(|(lu, _)| (lu, f64::NAN));
                mu.fill(0.0);
                left.copy_from_slice(right);
                last = f64::INFINITY;
                continue;
            }
            last = size;
            left = residual(self.coupled.last_jacobian(), (&self.mass, unit), &mu, right);
        }
        Ok(mu)
    }

    /// Error of ∂F/∂y along one direction, relative to it.
    pub(super) fn derivative_error(&mut self, time: f64, y: &[f64]) -> Result<f64> {
        const STEP: f64 = 1e-5;
        let n = y.len();
        let direction: Vec<f64> =
            (0..n).map(|k| self.units[k] * (12.9898 * (1.0 + real(k))).sin()).collect();
        let (mut plus, mut minus, mut product) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for (sign, out) in [(STEP, &mut plus), (-STEP, &mut minus)] {
            let mut moved = y.to_vec();
            add(&mut moved, sign, &direction);
            self.coupled.residual(time, &moved, out)?;
        }
        self.coupled.jacobian(time, y)?.multiply(&direction, &mut product);
        let gap: Vec<f64> =
            (0..n).map(|k| 0.5 / STEP * (plus[k] - minus[k]) - product[k]).collect();
        Ok(self.share(&gap, &product, 0.0))
    }
}

/// `right - (m - J)ᵀ μ`.
fn residual(jacobian: &Sparse, (mass, unit): (&[f64], f64), mu: &[f64], right: &[f64]) -> Vec<f64> {
    let mut left = jacobian.multiply_transposed(mu);
    add(&mut left, 1.0, right);
    left.iter_mut().zip(mass).zip(mu).for_each(|((left, m), mu)| *left -= m / unit * mu);
    left
}

/// The time of a stage.
pub(super) fn stage_time(span: Window, stage: usize) -> f64 {
    span.start + ABSCISSA[stage] * (span.end - span.start)
}

/// Adds a multiple.
pub(super) fn add(sum: &mut [f64], factor: f64, other: &[f64]) {
    sum.iter_mut().zip(other).for_each(|(sum, value)| *sum += factor * value);
}
