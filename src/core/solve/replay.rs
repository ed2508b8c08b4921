//! Replay of a run by a one-step method, and the exact adjoint of its steps: sensitivities in time.
//!
//! ```text
//! M dy/dt = F(t, y; p)                        the coupled system (`model/coupled`), M = 0 in rows without storage
//!
//! stage i of a step h from y_n:               m = M/(γh), d = 1 in rows with storage and 0 in others
//! r_i = m (Y_i - y_n) - F(Y_i) - d Σ_{j<i} (a_ij/γ) F(Y_j) = 0,     y_{n+1} = Y_3
//!
//! (m - J_i)ᵀ μ_i = J_iᵀ d Σ_{j>i} (a_ji/γ) μ_j - δ_i3 λ_{n+1},      λ_n = -Σ_i m μ_i (+ ∂J/∂y_n)
//! dJ/dp = ∂J/∂p + λ_0·∂y_0/∂p + Σ_n Σ_i μ_i·∂r_i/∂p
//! ```
//!
//! The method is the L-stable, stiffly accurate SDIRK of three stages and order 3 (Alexander, SIAM J. Numer. Anal. 14
//! (1977) 1006, doi:10.1137/0714068), of order 3 on index-1 systems too: one method for every policy. Its lengths are chosen once, by an embedded
//! solution of order 2, and held fixed: J is then a smooth function of p. The steps of the run themselves are not
//! differentiated: within one the staggered integrator takes any number of substeps of the chemistry and iterations of minimisations, whose
//! numbers depend on p, and the replay costs the same for every integrator.
//!
//! Stages are solved to round-off by Newton's method. A factor is kept while it converges quickly, for transposed systems too,
//! whose solutions are refined with the derivatives of their own stage. Memory: all stages with their adjoints.
//!
//! Not covered: constraints, internal variables, effects that couple vertices far apart or limit steps, drag that differs by
//! direction.

mod stages;
mod trajectory;

use std::sync::Arc;

pub use stages::Window;
use stages::{GAMMA, STAGES, StageSolver, Stages, add};
pub use trajectory::{Adjoint, Schedule, Trajectory};

use super::continuation::{Unknowns, flatten};
use super::sensitivity::{check, not_differentiable};
use super::{Control, Result};
use crate::model::{Coupled, Model, State, Subsystem};

/// First step, in windows; largest change of a step; shortest step, in windows.
const FIRST_STEP: f64 = 1e-3;
const STEP_CHANGE: (f64, f64) = (0.2, 4.0);
const SHORTEST_STEP: f64 = 1e-10;
/// Share by which a held value changes between the two sides of a breakpoint, at most.
const JUMP: f64 = 1e-9;

/// A replay, with what solves for its adjoint.
pub struct Replay {
    solver: StageSolver,
    model: Arc<Model>,
    tolerance: (f64, f64),
    trajectory: Trajectory,
}

impl Replay {
    fn begin(
        model: &Arc<Model>,
        start: &State,
        tolerance: (f64, f64),
        control: &Control,
    ) -> Result<Self> {
        check_covered(model)?;
        let mut coupled = Coupled::new(model, Subsystem::Whole);
        coupled.start(start);
        let first = coupled.pack(start);
        let solver = StageSolver::new(coupled, control);
        let (layout, schedule) = (Arc::clone(solver.coupled.layout()), Schedule::default());
        let start = start.clone();
        let trajectory = Trajectory { layout, start, first, stages: Vec::new(), schedule };
        Ok(Self { solver, model: Arc::clone(model), tolerance, trajectory })
    }

    /// From `start` through all `times`, ascending, with steps of the accuracy `tolerance`, relative and absolute in units of mean edges and typical
    /// magnitudes; `window` gives the span from a time to another one, or to the first breakpoint between them.
    ///
    /// # Errors
    /// [`crate::solve::SolveError::NotDifferentiable`] for what is not covered, and where no step leads on; laws that fail.
    pub fn adaptive(
        (model, start): (&Arc<Model>, &State),
        times: &[f64],
        mut window: impl FnMut(f64, f64) -> Window,
        tolerance: (f64, f64),
        control: &Control,
    ) -> Result<Self> {
        let mut made = Self::begin(model, start, tolerance, control)?;
        let (mut time, mut step) = (start.time, f64::INFINITY);
        for &until in times {
            while time < until {
                let span = window(time, until);
                made.check_held(span)?;
                step = made.cross(span, step)?;
                time = span.shown_time;
            }
            made.trajectory.schedule.marks.push(made.trajectory.stages.len());
        }
        Ok(made)
    }

    /// With the steps of another one.
    ///
    /// # Errors
    /// As for [`Self::adaptive`].
    pub fn fixed(
        (model, start): (&Arc<Model>, &State),
        schedule: &Schedule,
        tolerance: (f64, f64),
        control: &Control,
    ) -> Result<Self> {
        let mut made = Self::begin(model, start, tolerance, control)?;
        for span in &schedule.steps {
            let before = made.trajectory.last().to_vec();
            made.solver.report("replay", *span);
            let (stages, error) = made.solver.step(*span, &before, tolerance)?;
            made.trajectory.take(*span, stages, error)?;
        }
        made.trajectory.schedule.marks.clone_from(&schedule.marks);
        Ok(made)
    }

    /// Its unknowns.
    #[must_use]
    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory
    }

    /// Refuses values that are held and jump where a window begins.
    fn check_held(&self, window: Window) -> Result<()> {
        let Some(last) = self.trajectory.schedule.steps.last() else { return Ok(()) };
        let state = self.trajectory.state(&self.model, last.end, self.trajectory.last());
        let held = |time: f64| {
            let mut species = state.species.clone();
            self.model.hold(time, &mut species);
            species.concat()
        };
        let (before, after) = (held(last.end), held(window.start));
        let jumps = |(b, a): (&f64, &f64)| (a - b).abs() > JUMP * a.abs().max(b.abs());
        match before.iter().zip(&after).any(jumps) {
            false => Ok(()),
            true => Err(not_differentiable(format!(
                "a value that is held jumps at t = {}, which gradients in time do not cover: a ramp of some steps is covered",
                last.shown_time
            ))),
        }
    }

    /// Crosses a window with steps under error control, the first of them at most as long as `step`; gives the next one.
    fn cross(&mut self, window: Window, step: f64) -> Result<f64> {
        let whole = window.end - window.start;
        let mut step = if step.is_finite() { step } else { FIRST_STEP * whole };
        let mut at = window.start;
        while at < window.end {
            let left = window.end - at;
            let parts = (left / step).ceil().max(1.0);
            let length = left / if parts > 2.0 { left / step } else { parts };
            let ends = parts <= 1.0;
            let (end, shown_time) =
                if ends { (window.end, window.shown_time) } else { (at + length, at + length) };
            let span = Window { start: at, end, shown_time };
            let before = self.trajectory.last().to_vec();
            self.solver.report("replay", span);
            let done = self.solver.step(span, &before, self.tolerance);
            match done.and_then(|done| self.admissible(span, done)) {
                Ok((stages, error)) if error <= 1.0 => {
                    self.trajectory.take(span, stages, error)?;
                    at = end;
                    step = length * growth(error);
                }
                Ok((_, error)) => step = length * growth(error).min(0.9),
                Err(error) if !error.is_recoverable() => return Err(error),
                Err(error) => {
                    step = STEP_CHANGE.0 * length;
                    if step < SHORTEST_STEP * whole {
                        return Err(not_differentiable(format!(
                            "no step leads on from t = {at}, where the shape may lose its stability (a snap): {error}"
                        )));
                    }
                }
            }
        }
        Ok(step)
    }

    /// Refuses a step whose end is not in the range of its species.
    fn admissible(&self, span: Window, done: (Stages, f64)) -> Result<(Stages, f64)> {
        let end = &done.0[STAGES - 1];
        let mut end = self.trajectory.state(&self.model, span.shown_time, end);
        self.model.keep_in_range(&mut end.species, span.shown_time, self.tolerance)?;
        Ok(done)
    }

    /// The adjoint, with ∂J/∂y at every time asked for.
    ///
    /// # Errors
    /// Laws that fail; a derivative that is singular.
    pub fn adjoint(&mut self, slopes: &[Unknowns]) -> Result<Adjoint> {
        let Self { solver, trajectory, .. } = self;
        let Trajectory { layout, first, stages: all, schedule, .. } = trajectory;
        let n = layout.unknowns();
        let mut lambda = vec![0.0; n];
        let (mut weights, mut mass) = (Vec::with_capacity(all.len()), vec![0.0; n]);
        let marked = |step: usize, lambda: &mut Vec<f64>| {
            let here = schedule.marks.iter().zip(slopes).filter(|(mark, _)| **mark == step);
            for (_, slope) in here {
                add(lambda, 1.0, &flatten(layout, slope));
            }
        };
        for step in (0..all.len()).rev() {
            marked(step + 1, &mut lambda);
            let before = match step.checked_sub(1) {
                None => &*first,
                Some(last) => &all[last][STAGES - 1],
            };
            let (span, stages) = (schedule.steps[step], &all[step]);
            solver.report("adjoint of the replay", span);
            let (mu, of_step) = solver.transposed_step(span, stages, &lambda)?;
            let unit = GAMMA * (span.end - span.start);
            lambda.fill(0.0);
            for (mu, y) in mu.iter().zip(stages) {
                for k in 0..n {
                    mass[k] += mu[k] * (y[k] - before[k]) / unit;
                    lambda[k] -= solver.mass[k] / unit * mu[k];
                }
            }
            weights.push(of_step);
        }
        weights.reverse();
        marked(0, &mut lambda);
        Ok(Adjoint { weights, mass, first: lambda })
    }

    /// Error of ∂F/∂y at the end along one direction, relative to it: what is left out of the derivatives of some schemes.
    ///
    /// # Errors
    /// Laws that fail.
    pub fn derivative_error(&mut self) -> Result<f64> {
        let (Some(span), y) =
            (self.trajectory.schedule.steps.last().copied(), self.trajectory.last().to_vec())
        else {
            return Ok(0.0);
        };
        self.solver.derivative_error(span.end, &y)
    }
}

/// Factor by which a step with this error estimate changes.
fn growth(error: f64) -> f64 {
    (0.9 * error.powf(-1.0 / 3.0)).clamp(STEP_CHANGE.0, STEP_CHANGE.1)
}

/// Refuses what has unknowns or couplings besides those of the coupled system.
fn check_covered(model: &Model) -> Result<()> {
    check(model)?;
    let mechanics = model.mechanics();
    let why = if mechanics.has_low_rank() || mechanics.couples_pairs() {
        "an effect of the scene (such as volume or contact) couples vertices far apart"
    } else if mechanics.limits_steps() {
        "an effect of the scene (such as contact) limits steps"
    } else if model.moves() && model.mass_weights().mechanics > 0.0 && !model.drag().is_isotropic()
    {
        "the drag of the scene differs by direction"
    } else {
        return Ok(());
    };
    Err(not_differentiable(format!("{why}, which gradients in time do not cover")))
}
