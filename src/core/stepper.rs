//! A problem that is set up: its model, its state, and how it advances.

use std::sync::Arc;

use crate::geometry::VertexArea;
use crate::model::{Evaluation, Model, State};
use crate::solve::equilibrium::Relaxation;
use crate::solve::{Integrator, Result, SolveError, StepReport, Workspace};

/// A problem that is set up, to be stepped and evaluated; made by [`Problem::stepper`](crate::problem::Problem::stepper).
pub struct Stepper {
    /// The model with the memory of its solvers.
    pub workspace: Workspace,
    /// Time, positions and species.
    pub state: State,
    /// How it advances in time.
    pub integrator: Box<dyn Integrator>,
    /// The areas of vertices: one rule for forces and signals.
    pub area: VertexArea,
}

impl Stepper {
    /// The model.
    #[must_use]
    pub fn model(&self) -> &Arc<Model> {
        &self.workspace.model
    }

    /// The model at the state.
    pub fn evaluate(&mut self) -> Evaluation<'_> {
        self.workspace.at(&self.state)
    }

    /// Makes the start satisfy the equations without a time derivative, and brings the shape to rest: before the first step.
    ///
    /// # Errors
    /// If a relaxation or a law fails.
    pub fn prepare(&mut self) -> Result<Relaxation> {
        self.integrator.prepare(&mut self.workspace, &mut self.state)
    }

    /// Brings the shape into equilibrium with its species.
    ///
    /// # Errors
    /// If a law or the relaxation fails.
    pub fn relax(&mut self) -> Result<Relaxation> {
        self.workspace.relax(&mut self.state)
    }

    /// One step that does not pass the time `until`. Kinks and jumps in time of laws, ramps and growth are no ends of steps:
    /// a pulse between two of them is not seen.
    ///
    /// # Errors
    /// [`SolveError::NoStep`] if `until` is not after the time of the state. Whatever no smaller step cures: the state and
    /// what solvers remember are then as before, bit for bit.
    pub fn step(&mut self, until: f64) -> Result<StepReport> {
        if !(until > self.state.time) {
            return Err(SolveError::NoStep { time: self.state.time, until });
        }
        self.workspace.mark();
        let Self { integrator, workspace, state, .. } = self;
        let report = integrator.advance(workspace, state, until);
        let report = report.inspect_err(|_| workspace.roll_back())?;
        self.model().tally().count(|work| work.steps += 1);
        Ok(report)
    }

    /// Energy of every effect that has one, by name.
    ///
    /// # Errors
    /// If a law fails.
    pub fn energies(&mut self) -> Result<Vec<(String, f64)>> {
        let energies = self.evaluate().energies()?;
        let names = self.model().mechanics().names().map(str::to_owned);
        Ok(names.zip(energies).collect())
    }
}
