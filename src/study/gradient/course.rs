//! The replay of a run, with its adjoint, and what makes it doubtful.

use std::sync::Arc;

use super::fixed::{Fixed, FixedPoint};
use crate::model::{Model, State};
use crate::run::{Observer, Result, Simulation, StopRules};
use crate::scene::Scene;
use crate::solve::continuation::Unknowns;
use crate::solve::replay::{Adjoint, Replay, Trajectory};
use crate::solve::sensitivity::{SteadyPoint, changes_with_rigid_motions};

/// Error of the derivatives of rates and forces by the unknowns that is round-off.
const DERIVATIVE_ERROR: f64 = 1e-6;

/// A run in time, replayed.
pub struct Course {
    pub(super) replay: Replay,
    pub(super) model: Arc<Model>,
    pub(super) states: Vec<State>,
    /// The first shape, where the run begins with an equilibrium that counts.
    pub(super) first: Option<Box<SteadyPoint>>,
    /// J of the run itself, with the difference that tolerances explain; of the first evaluation only.
    pub(super) of_run: Option<(f64, f64)>,
    pub(super) derivative_error: f64,
}

impl Course {
    /// The state at the last time.
    pub(super) fn last(&self) -> &State {
        // There is at least one time.
        &self.states[self.states.len() - 1]
    }

    /// The times at which J is measured.
    pub fn times(&self) -> impl Iterator<Item = f64> {
        self.states.iter().map(|state| state.time)
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
                "derivatives of forces and rates by shape and species are known to {:.1e} only: so is the gradient",
                self.derivative_error
            ));
        }
        all
    }

    /// The adjoint of the sum of J over the times, with the derivatives by the unknowns that `slope` gives.
    ///
    /// # Errors
    /// Laws that fail; a derivative that is singular.
    pub(super) fn adjoint(
        &mut self,
        slope: impl Fn(&Model, &State) -> Result<Unknowns>,
    ) -> Result<FixedCourse<'_>> {
        let Self { replay, model, states, first, .. } = self;
        let slopes = states.iter().map(|state| slope(model, state));
        let slopes = slopes.collect::<Result<Vec<_>>>()?;
        let adjoint = replay.adjoint(&slopes)?;
        let first = match (replay.trajectory().first_shape(&adjoint), first) {
            (Some(slope), Some(point)) => {
                let adjoint = point.adjoint(&slope)?;
                Some(FixedPoint { point: point.point(), adjoint })
            }
            _ => None,
        };
        // Where the shape has no storage, nothing but the unknowns that are held says where the sheet lies.
        let floats = model.moves() && model.mass_weights().mechanics == 0.0;
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

/// Steps until a stop rule of `scene`, whose set-up `simulation` is, ends the run; writes nothing.
///
/// # Errors
/// As for [`Simulation::step`].
pub(super) fn run_to_end(simulation: &mut Simulation, scene: &Scene) -> Result<()> {
    let mut rules = StopRules::new(scene);
    while rules.stop(&mut simulation.evaluate())?.is_none() {
        simulation.step(scene.time.span.until.get())?;
        simulation.renew(false);
    }
    Ok(())
}
