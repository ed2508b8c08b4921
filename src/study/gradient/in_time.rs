//! J of a run at some times, with its adjoint: a replay of the run whose steps have exact derivatives (`solve/replay`).
//!
//! The first evaluation runs the scene too: the value of J there checks the replay. Later ones keep the steps of the replay
//! while their errors stay near the tolerance, so that J is smooth.

use std::sync::Arc;

use super::differences::{Fixed, FixedPoint};
use super::objective::{Evaluated, Found, Objective};
use crate::model::{Model, Start, State};
use crate::num::real;
use crate::run::{Error, Result, Simulation};
use crate::scene::Scene;
use crate::solve::continuation::Unknowns;
use crate::solve::replay::{Adjoint, Replay, Span, Trajectory};
use crate::solve::sensitivity::{SteadyPoint, changes_with_rigid_motions};

/// Tolerances of the replay where the scene has fixed steps.
const TOLERANCE: f64 = 1e-4;
/// Steps are chosen anew where the estimate of an error exceeds this number of tolerances.
const MAX_ERROR: f64 = 4.0;
/// Difference from the run, in relative tolerances of the larger of J and its change, that these do not explain.
const EXPLAINED: f64 = 3.0;
/// Error of the derivatives of rates and forces by the unknowns that is round-off.
const DERIVATIVE_ERROR: f64 = 1e-6;

/// A run in time, replayed.
pub struct Course {
    replay: Replay,
    model: Arc<Model>,
    states: Vec<State>,
    /// The first shape, where the run begins with an equilibrium that counts.
    first: Option<Box<SteadyPoint>>,
    /// J of the run itself, with the difference that tolerances explain; of the first evaluation only.
    of_run: Option<(f64, f64)>,
    derivative_error: f64,
}

impl Course {
    /// The state at the last time.
    pub(super) fn last(&self) -> &State {
        // There is at least one time.
        &self.states[self.states.len() - 1]
    }

    /// Number of steps of the replay.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.replay.trajectory().schedule().len()
    }

    /// J of the run itself; of the first evaluation only.
    #[must_use]
    pub fn of_run(&self) -> Option<f64> {
        self.of_run.map(|(value, _)| value)
    }

    /// What makes the gradient doubtful where the replay has J = `value`.
    #[must_use]
    pub fn doubts(&self, value: f64) -> Vec<String> {
        let mut all = Vec::new();
        if let Some((run, explained)) = self.of_run
            && (run - value).abs() > explained
        {
            all.push(format!(
                "the run has J = {run:.9e}, which differs from that of its replay by more than {explained:.1e}, which the tolerance \
                 explains: a snap, or a tolerance that is too loose"
            ));
        }
        if self.derivative_error > DERIVATIVE_ERROR {
            all.push(format!(
                "derivatives of forces and rates by shape and species are known to {:.1e} only: the gradient is no better",
                self.derivative_error
            ));
        }
        all
    }

    /// The adjoint of the sum of J over the times.
    ///
    /// # Errors
    /// Laws that fail; a derivative that is singular.
    pub(super) fn adjoint(&mut self, objective: &Objective) -> Result<FixedCourse<'_>> {
        let Self { replay, model, states, first, .. } = self;
        let slope = |state: &State| objective.slope(model, state);
        let slopes = states.iter().map(slope).collect::<Result<Vec<_>>>()?;
        let adjoint = replay.adjoint(&slopes)?;
        let first = match (replay.trajectory().first_shape(&adjoint), first) {
            (Some(slope), Some(point)) => {
                let adjoint = point.adjoint(&slope)?;
                Some(FixedPoint { point: point.point(), adjoint })
            }
            _ => None,
        };
        // Where the shape has no storage, nothing but the unknowns that are held says where the sheet lies.
        let floats = model.moves() && model.storage().mechanics == 0.0;
        let moves = |(state, slope): (&State, &Unknowns)| {
            changes_with_rigid_motions(model, &state.x, &slope.x)
        };
        let moves = floats && states.iter().zip(&slopes).any(moves);
        Ok(FixedCourse { trajectory: replay.trajectory(), adjoint, first, moves })
    }
}

/// A course at fixed unknowns, with its adjoint.
pub(super) struct FixedCourse<'a> {
    trajectory: &'a Trajectory,
    adjoint: Adjoint,
    first: Option<FixedPoint<'a>>,
    /// Whether J changes with rigid motions that nothing hinders.
    pub(super) moves: bool,
}

impl Fixed for FixedCourse<'_> {
    fn terms(&self, model: &Arc<Model>, start: &State) -> Result<(Unknowns, Vec<State>)> {
        let terms = self.trajectory.lagrangian(&self.adjoint, model, start)?;
        let terms = match &self.first {
            Some(first) => terms.plus(1.0, &first.terms(model, start)?.0),
            None => terms,
        };
        Ok((terms, self.trajectory.states(model)))
    }
}

impl Objective {
    /// J of the run of `scene`, which `simulation` is set up for, at `times`; at its end without any.
    ///
    /// # Errors
    /// Times outside the scene; what a replay does not cover; a run that fails.
    pub(super) fn evaluate_in_time(
        &mut self,
        values: &[Vec<f64>],
        (scene, mut simulation): (&Scene, Simulation),
        times: &[f64],
    ) -> Result<Evaluated> {
        check_times(times, scene.time.span.until.get())?;
        simulation.prepare()?;
        let integrator = &scene.time.integrator;
        let rtol = integrator.rtol().unwrap_or(TOLERANCE);
        let tolerance = (rtol, integrator.atol().unwrap_or(rtol));
        let model = Arc::clone(simulation.model());
        let mut start = simulation.state().clone();
        let settles = model.moves() && simulation.stepper.start == Start::Equilibrium;
        let first = match settles && model.storage().mechanics > 0.0 {
            true => {
                let rest = (false, simulation.force_tolerance());
                Some(Box::new(SteadyPoint::new(Arc::clone(&model), &start, rest, &self.control)?))
            }
            false => None,
        };
        if let Some(point) = &first {
            start.x = point.point().state.x.clone();
        }
        let mut breakpoints = simulation.stepper.breakpoints.clone();
        let run = match &self.schedule {
            Some(_) => None,
            None => Some(self.run(scene, &mut simulation, times)?),
        };
        let ends = match (&run, &self.schedule) {
            (Some((_, ends)), _) | (None, Some((_, ends))) => ends.clone(),
            (None, None) => Vec::new(),
        };
        let known = self.schedule.as_ref().and_then(|(schedule, _)| {
            let with = (&model, &start);
            let replay = Replay::fixed(with, schedule, tolerance, &self.control).ok()?;
            (replay.trajectory().schedule().error <= MAX_ERROR).then_some(replay)
        });
        let mut replay = match known {
            Some(replay) => replay,
            None => {
                let window = |time: f64, until: f64| {
                    let reduction = model.sheet().reduction();
                    let window = breakpoints.limit(breakpoints.window(time, until), reduction);
                    Span { start: window.start, end: window.end, shown: window.shown_time }
                };
                Replay::adaptive((&model, &start), &ends, window, tolerance, &self.control)?
            }
        };
        let states = replay.trajectory().states(&model);
        let value = states.iter().map(|state| self.measured(&model, state)).sum::<Result<f64>>()?;
        let of_run = match run {
            None => None,
            Some((of_run, _)) => {
                let change = value - real(states.len()) * self.measured(&model, &start)?;
                Some((of_run, EXPLAINED * rtol * value.abs().max(change.abs())))
            }
        };
        self.schedule = Some((replay.trajectory().schedule().clone(), ends));
        let derivative_error = replay.derivative_error()?;
        let course = Course { replay, model, states, first, of_run, derivative_error };
        let found = Found::InTime(Box::new(course));
        Ok(Evaluated { value, at: values.to_vec(), found, moves: false })
    }

    /// Runs the scene through `times`, or to its end; the sum of J, with the times.
    fn run(
        &self,
        scene: &Scene,
        simulation: &mut Simulation,
        times: &[f64],
    ) -> Result<(f64, Vec<f64>)> {
        let mut value = 0.0;
        for &time in times {
            while simulation.state().time < time {
                simulation.step(time)?;
                simulation.renew(false);
            }
            value += self.measured(simulation.model(), simulation.state())?;
        }
        if !times.is_empty() {
            return Ok((value, times.to_vec()));
        }
        simulation.run_to_end(scene)?;
        let (model, state) = (simulation.model(), simulation.state());
        Ok((self.measured(model, state)?, vec![state.time]))
    }
}

/// Refuses times that the scene does not have.
fn check_times(times: &[f64], until: f64) -> Result<()> {
    let ascending = times.windows(2).all(|pair| pair[0] < pair[1]);
    let inside = times.iter().all(|time| (0.0..=until).contains(time));
    match ascending && inside {
        true => Ok(()),
        false => Err(Error::Refused(format!(
            "--at-times: expected ascending times from 0 to time.until = {until}"
        ))),
    }
}
