//! A problem that is set up: its model, its state, and how it advances.

mod breakpoints;

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::geometry::VertexArea;
use crate::model::{Evaluation, Model, Positions, Start, State};
use crate::record::{Malformed, Record};
use crate::sheet::is_turned;
use crate::solve::equilibrium::Relaxation;
use crate::solve::{Integrator, Progress, Result, SolveError, StepReport, Workspace, chemistry};

pub use breakpoints::Breakpoints;

/// A problem that is set up, to be stepped and evaluated; made by [`Problem::stepper`](crate::problem::Problem::stepper).
pub struct Stepper {
    /// The model with the memory of its solvers.
    pub workspace: Workspace,
    /// Time, positions, species and internal variables.
    pub state: State,
    /// How it advances in time.
    pub integrator: Box<dyn Integrator>,
    /// What the shape of the first state is.
    pub start: Start,
    /// The areas of vertices: one rule for forces and signals.
    pub area: VertexArea,
    /// Times at which steps end.
    pub breakpoints: Breakpoints,
    /// Whether steps lead anywhere.
    pub(crate) progress: Progress,
}

/// What a [`Stepper`] remembers besides its state: with both, one that is newly made of the same problem makes the same
/// steps, bit for bit.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SolverState {
    workspace: Record,
    integrator: Record,
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

    /// Finds the times at which laws that read the time jump or bend, and their course between these, with the species of the state; says what is not
    /// certain about them. Later calls do nothing.
    pub fn find_breakpoints(&mut self) -> Option<String> {
        let Self { workspace, state, breakpoints, .. } = self;
        breakpoints.sample(&mut workspace.at(state))
    }

    /// That the state, which anybody may set, is one of this problem.
    fn check(&self) -> Result<()> {
        let model = self.model();
        let (sheet, State { x, species, internal, .. }) = (model.sheet(), &self.state);
        let expect = |what: &str, found: usize, expected: usize| match found == expected {
            true => Ok(()),
            false => Err(SolveError::Shape { what: what.to_owned(), found, expected }),
        };
        expect("positions", x.len(), sheet.vertex_count())?;
        expect("internal variables", internal.len(), model.internal().len())?;
        for (term, values) in model.internal().iter().zip(internal) {
            expect(&format!("values of {}", term.name()), values.len(), term.count(sheet))?;
        }
        let Some(chemistry) = model.chemistry() else { return expect("species", species.len(), 0) };
        let names = &chemistry.descriptor().species;
        expect("species", species.len(), names.len())?;
        let (points, mut all) = (chemistry.points(sheet), names.iter().zip(species));
        all.try_for_each(|(c, values)| {
            expect(&format!("values of {}", c.name), values.len(), points)
        })
    }

    /// Makes the start satisfy the equations without a time derivative, and brings the shape to rest: before the first step.
    ///
    /// # Errors
    /// If a relaxation or a law fails; [`SolveError::Start`] if an effect refuses the shape.
    pub fn prepare(&mut self) -> Result<Relaxation> {
        self.check()?;
        let separated = self.check_start()?;
        self.hold();
        self.find_breakpoints();
        let Self { workspace, state, integrator, .. } = self;
        let mut done = match self.start {
            Start::Equilibrium => workspace.settle_shape(state)?,
            Start::Given => workspace.take_shape(state)?,
        };
        integrator.prepare(workspace, state)?;
        done.residual = workspace.reported_residual(state)?;
        Ok(Relaxation { separated, ..done })
    }

    /// Takes over the shape `x`, and the equilibrium near it if there is one: to be prepared from where other parameters led.
    ///
    /// # Errors
    /// [`SolveError::Start`] if an effect refuses the shape; laws that fail.
    pub fn rest_near(&mut self, x: Positions) -> Result<()> {
        self.state.x = x;
        self.check()?;
        self.check_start()?;
        self.hold();
        self.workspace.rest_nearby(&mut self.state, None)?;
        Ok(())
    }

    /// Brings the shape into equilibrium with its species.
    ///
    /// # Errors
    /// If a law or the relaxation fails; [`SolveError::Start`] if an effect refuses the shape, and [`SolveError::InsideOut`], as in a
    /// step; the shape is then the one before.
    pub fn relax(&mut self) -> Result<Relaxation> {
        self.check()?;
        let separated = self.check_start()?;
        self.hold();
        let before = self.state.x.clone();
        let done = self.workspace.relax(&mut self.state)?;
        if is_turned(self.workspace.model.sheet(), &before, &self.state.x) {
            self.state.x = before;
            return Err(SolveError::InsideOut);
        }
        Ok(Relaxation { separated, ..done })
    }

    /// Brings the shape and the chemistry towards a rest of both, at the time of the state.
    ///
    /// # Errors
    /// As for [`Stepper::relax`], and where the chemistry comes to no rest.
    pub fn relax_to_steady_state(&mut self) -> Result<Relaxation> {
        self.check()?;
        self.check_start()?;
        self.hold();
        chemistry::relax_to_steady_state(&mut self.workspace, &mut self.state)
    }

    /// Sets the values that effects hold at the time of the state.
    fn hold(&mut self) {
        self.workspace.model.hold(self.state.time, &mut self.state.species);
    }

    /// That no effect refuses the shape, after what it was asked to move apart: so many pairs, by so much at most.
    fn check_start(&mut self) -> Result<(usize, f64)> {
        if !self.model().mechanics().limits_steps() {
            return Ok((0, 0.0));
        }
        let mut state = self.state.clone();
        let made = self.workspace.at(&state).potential()?.separate(&state.x);
        let done = made.as_ref().map_or((0, 0.0), |made| (made.pairs, made.moved));
        if let Some(made) = made {
            state.x = made.x.into();
        }
        if let Some((effect, why)) = self.workspace.at(&state).potential()?.refusal(&state.x) {
            return Err(SolveError::Start { effect, why });
        }
        self.state.x = state.x;
        Ok(done)
    }

    /// One step that does not pass the time `until`, nor one at which a law, a ramp or growth jumps or bends.
    ///
    /// # Errors
    /// [`SolveError::Shape`] for a state of another sheet or other species; [`SolveError::NoStep`] if `until` is not after
    /// the time of the state. Whatever no smaller step cures: the state and what solvers remember are then as before, bit
    /// for bit.
    pub fn step(&mut self, until: f64) -> Result<StepReport> {
        self.step_by(until, |stepper, until| {
            stepper.integrator.advance(&mut stepper.workspace, &mut stepper.state, until)
        })
    }

    /// The same; `advance` makes the step itself, with what is checked of it: [`Integrator::advance`] once or more.
    ///
    /// # Errors
    /// As for [`Stepper::step`], and those of `advance`.
    pub fn step_by<E: From<SolveError>>(
        &mut self,
        until: f64,
        advance: impl FnOnce(&mut Self, f64) -> Result<StepReport, E>,
    ) -> Result<StepReport, E> {
        let time = self.state.time;
        if !(until > time) {
            return Err(SolveError::NoStep { time, until }.into());
        }
        self.check()?;
        self.progress.check(&mut self.workspace, &self.state)?;
        let work = self.model().tally().work();
        let (causes, not_finite) =
            (self.workspace.rejections().causes(), self.model().not_finite());
        self.workspace.begin_step();
        let window = self.breakpoints.window(time, until);
        let model = Arc::clone(self.model());
        let window = self.breakpoints.limit(window, model.sheet().reduction());
        self.state.time = window.start;
        // Past a jump.
        self.hold();
        let report = advance(self, window.end).inspect_err(|_| {
            self.state.time = time;
            self.hold();
            self.workspace.roll_back();
        })?;
        if self.state.time == window.end {
            self.state.time = window.shown_time;
        }
        self.hold();
        self.model().tally().count(|work| work.steps += 1);
        let work = self.model().tally().work() - work;
        self.progress.count(self.state.time - time, until - time, work.substeps);
        Ok(StepReport {
            work,
            rejected: self.workspace.rejections().causes().since(causes),
            not_finite: self.model().not_finite() - not_finite,
            ..report
        })
    }

    /// What later steps depend on besides the state: all of it where [`Integrator::is_storable`].
    #[must_use]
    pub fn memory(&self) -> SolverState {
        SolverState { workspace: self.workspace.memory(), integrator: self.integrator.memory() }
    }

    /// Takes over the memory of one of the same problem.
    ///
    /// # Errors
    /// [`Malformed`] if it is of another problem.
    pub fn restore(&mut self, memory: &SolverState) -> Result<(), Malformed> {
        self.workspace.restore(&memory.workspace)?;
        self.integrator.restore(&memory.integrator, self.state.x.len())
    }

    /// Energy of every effect that has one, by name.
    ///
    /// # Errors
    /// If a law fails.
    pub fn energies(&mut self) -> Result<Vec<(String, f64)>> {
        self.check()?;
        let energies = self.evaluate().energies()?;
        let names = self.model().mechanics().names().map(str::to_owned);
        Ok(names.zip(energies).collect())
    }
}
