//! J of a run at some times, with its adjoint: a replay of the run whose steps have exact derivatives (`solve/replay`).
//!
//! The first evaluation runs the scene too: the value of J there checks the replay. Later ones keep the steps of the replay
//! while their errors stay near the tolerance, so that J is smooth.

use std::sync::Arc;

use super::course::{Course, run_to_end};
use super::objective::{Evaluated, Found, Objective};
use crate::model::{Model, Start, State};
use crate::num::real;
use crate::run::{Error, Result, Simulation};
use crate::scene::Scene;
use crate::solve::SolveError;
use crate::solve::replay::{Replay, Schedule};
use crate::solve::sensitivity::SteadyPoint;

/// Tolerances of the replay where the scene has fixed steps.
const TOLERANCE: f64 = 1e-4;
/// Steps are chosen again where the estimate of an error exceeds this number of tolerances.
const MAX_ERROR: f64 = 4.0;
/// Difference from the run, in relative tolerances of the larger of J and its change, that these do not explain.
const EXPLAINED: f64 = 3.0;
/// Step of the difference that checks a gradient; its error that is said; and the share of J by which parameters change it at least.
const CHECK_STEP: f64 = 1e-5;
const CHECK_ERROR: f64 = 0.01;
const CHECKED: f64 = 1e-4;
/// Change of a parameter by which breakpoints are found to move, relative to its largest value, and their change, to the end.
const MOVED: (f64, f64) = (1e-3, 1e-9);

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
        let given = simulation.state().species.clone();
        simulation.prepare()?;
        let integrator = &scene.time.integrator;
        let rtol = integrator.rtol().unwrap_or(TOLERANCE);
        let tolerance = (rtol, integrator.atol().unwrap_or(rtol));
        let model = Arc::clone(simulation.model());
        let mut start = simulation.state().clone();
        let first = self.first_shape(&simulation, given)?;
        if let Some(point) = &first {
            start.x = point.point().state.x.clone();
        }
        let mut breakpoints = simulation.stepper.breakpoints.clone();
        let run = match &self.schedule {
            None if self.runs_scene => Some(states_of_run(scene, &mut simulation, times)?),
            _ => None,
        };
        let ends = match (&run, &self.schedule) {
            (Some(states), _) => states.iter().map(|state| state.time).collect(),
            (None, Some((_, ends))) => ends.clone(),
            (None, None) => times.to_vec(),
        };
        let known = self.schedule.as_ref().and_then(|(schedule, _)| {
            let with = (&model, &start);
            let replay = Replay::fixed(with, schedule, tolerance, &self.control).ok()?;
            (replay.trajectory().schedule().error <= MAX_ERROR).then_some(replay)
        });
        let mut replay = match known {
            Some(replay) => replay,
            None => {
                let window = breakpoints.windows(model.sheet().reduction());
                Replay::adaptive((&model, &start), &ends, window, tolerance, &self.control)?
            }
        };
        let states = replay.trajectory().states(&model);
        let sum = |states: &[State]| -> Result<f64> {
            states.iter().map(|state| self.measured(&model, state)).sum()
        };
        let value = sum(&states)?;
        let of_run = match run {
            None => None,
            Some(states) => {
                let change = value - real(states.len()) * self.measured(&model, &start)?;
                Some((sum(&states)?, EXPLAINED * rtol * value.abs().max(change.abs())))
            }
        };
        self.schedule = Some((replay.trajectory().schedule().clone(), ends));
        let derivative_error = replay.derivative_error()?;
        let course = Course { replay, model, states, first, of_run, derivative_error };
        let found = Found::InTime(Box::new(course));
        Ok(Evaluated { value, at: values.to_vec(), found, moves: false })
    }

    /// The equilibrium that the motion of the shape begins with, at the species `given`: a chemistry without storage becomes steady after
    /// that. None where the shape has no storage, or begins as given.
    fn first_shape(
        &self,
        simulation: &Simulation,
        given: Vec<Vec<f64>>,
    ) -> Result<Option<Box<SteadyPoint>>> {
        let model = simulation.model();
        let settles = model.moves() && simulation.stepper.start == Start::Equilibrium;
        if !settles || model.mass_weights().mechanics == 0.0 {
            return Ok(None);
        }
        let first = State { species: given, ..simulation.state().clone() };
        let rest = (false, simulation.force_tolerance());
        Ok(Some(Box::new(SteadyPoint::new(Arc::clone(model), &first, rest, &self.control)?)))
    }

    /// Refuses parameters that move a breakpoint: steps of the replay end there.
    pub(super) fn check_breakpoints(&self, values: &[Vec<f64>]) -> Result<()> {
        let (times, until) = self.breakpoints(values)?;
        if times.is_empty() {
            return Ok(());
        }
        for (k, parameter) in self.parameters.iter().enumerate() {
            let largest = values[k].iter().fold(0.0, |most: f64, v| most.max(v.abs()));
            let change = MOVED.0 * if largest > 0.0 { largest } else { 1.0 };
            let with = |change: f64| {
                let mut moved = values.to_vec();
                moved[k].iter_mut().for_each(|value| *value += change);
                self.breakpoints(&moved)
            };
            // At the end of its range a parameter moves to one side only.
            let (other, _) = with(change).or_else(|_| with(-change))?;
            let same = |(a, b): (&f64, &f64)| (a - b).abs() <= MOVED.1 * until;
            if other.len() != times.len() || !times.iter().zip(&other).all(same) {
                return Err(Error::Refused(format!(
                    "{}: it moves a time at which laws, ramps or growth jump or bend, which gradients in time do not cover",
                    parameter.key
                )));
            }
        }
        Ok(())
    }

    /// Times inside the span at which laws, ramps or growth jump or bend, and its end.
    fn breakpoints(&self, values: &[Vec<f64>]) -> Result<(Vec<f64>, f64)> {
        let scene = self.scene(values)?;
        let mut simulation = Simulation::on_sheet(&scene, &self.search, &self.sheet)?;
        let mut breakpoints = simulation.stepper.breakpoints.clone();
        breakpoints.sample(&mut simulation.evaluate());
        Ok((breakpoints.times().to_vec(), scene.time.span.until.get()))
    }

    /// Compares the gradient with the difference of two replays along all parameters at once; what makes it doubtful.
    ///
    /// # Errors
    /// An interrupt.
    pub fn check_by_replay(
        &mut self,
        evaluated: &Evaluated,
        gradient: &[Vec<f64>],
    ) -> Result<Option<String>> {
        if evaluated.course().is_none() {
            return Ok(None);
        }
        let (mut moved, mut expected) = (evaluated.at.clone(), 0.0);
        for (value, slope) in moved.iter_mut().flatten().zip(gradient.iter().flatten()) {
            let size = if *value == 0.0 { 1.0 } else { value.abs() };
            expected += slope.abs() * size;
            *value += CHECK_STEP * size.copysign(*slope);
        }
        // Of less, round-off is seen.
        if expected < CHECKED * evaluated.value.abs() {
            return Ok(None);
        }
        let found = self.states(&moved).and_then(|(model, states)| {
            states.iter().map(|state| self.measured(&model, state)).sum::<Result<f64>>()
        });
        let found = match found {
            Err(error @ Error::Solve(SolveError::Interrupted)) => return Err(error),
            Err(_) => return Ok(None),
            Ok(value) => (value - evaluated.value) / CHECK_STEP,
        };
        let differs = (found - expected).abs() > CHECK_ERROR * expected;
        Ok(differs.then(|| {
            format!(
                "the gradient is not that of the run: along all parameters at once it is {expected:.4e}, and a difference of replays {found:.4e}. \
                 Does the law jump, as step(c - c0) does?"
            )
        }))
    }

    /// The steps of the last replay, with the times of J.
    pub(crate) fn schedule(&self) -> Option<&(Schedule, Vec<f64>)> {
        self.schedule.as_ref()
    }

    /// Replays with these steps.
    pub(crate) fn keep_schedule(&mut self, schedule: (Schedule, Vec<f64>)) {
        self.schedule = Some(schedule);
    }

    /// The states of the run itself with the parameters `values`, at `times`, with its model.
    ///
    /// # Errors
    /// A run that fails.
    pub(crate) fn run(
        &self,
        values: &[Vec<f64>],
        times: &[f64],
    ) -> Result<(Arc<Model>, Vec<State>)> {
        let scene = self.scene(values)?;
        let mut simulation = Simulation::on_sheet(&scene, &self.search, &self.sheet)?;
        simulation.set_control(self.control.clone());
        simulation.prepare()?;
        let states = states_of_run(&scene, &mut simulation, times)?;
        Ok((Arc::clone(simulation.model()), states))
    }
}

/// Runs `scene`, which `simulation` is set up for, through `times`, or to its end without any; the states there.
fn states_of_run(scene: &Scene, simulation: &mut Simulation, times: &[f64]) -> Result<Vec<State>> {
    let mut states = Vec::with_capacity(times.len().max(1));
    for &time in times {
        while simulation.state().time < time {
            simulation.step(time)?;
            simulation.renew(false);
        }
        states.push(simulation.state().clone());
    }
    if times.is_empty() {
        run_to_end(simulation, scene)?;
        states.push(simulation.state().clone());
    }
    Ok(states)
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
