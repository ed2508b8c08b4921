//! A scene that is set up, to be stepped and evaluated.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use super::invariants::Invariants;
use super::process::processor_time;
use super::ranks::RankPart;
use super::{Error, Fields, Result, laws};
use crate::Stepper;
use crate::effects::EffectParts;
use crate::model::{Evaluation, Model, Positions, State};
use crate::output::Frame;
use crate::output::provenance::MeshRecord;
use crate::run::StepInfo;
use crate::run::ledger_row::{ShapeSums, WALL_TIME_TITLE, columns, row};
use crate::sheet::{Sheet, Surface};
use crate::solve::equilibrium::Relaxation;
use crate::solve::{Control, SolveError, StepReport, diagnosis};
use crate::tally::Spent;

/// A scene that is set up: its model, its state, and how it advances.
///
/// ```no_run
/// # use std::path::Path;
/// use rumple::kinetics::PluginSearch;
/// use rumple::{Simulation, scene::Scene};
///
/// let scene = Scene::load(Path::new("dome.toml"), &[])?;
/// let mut simulation = Simulation::new(&scene, &PluginSearch::from_environment(&[]))?;
/// simulation.prepare()?;
/// while simulation.state().time < 1.0 {
///     simulation.step(1.0)?;
/// }
/// for (effect, energy) in simulation.energies()? {
///     println!("{effect}: {energy}");
/// }
/// # Ok::<(), rumple::Error>(())
/// ```
pub struct Simulation {
    /// Model, state and integrator.
    pub(crate) stepper: Stepper,
    /// The files of the plugins.
    pub(crate) plugins: Vec<PathBuf>,
    /// The law of the host program, by its name and its hash.
    pub(crate) host_law: Option<[String; 2]>,
    /// What is written in frames.
    pub(crate) fields: Fields,
    /// What a person should know: odd things about the mesh, the scene or the plugin.
    pub(crate) notes: Vec<String>,
    /// What laws do that they should not, and a run can live with.
    pub(crate) faults: Vec<String>,
    /// What each effect of the scene contributes to the model.
    pub(crate) effects: Vec<EffectParts>,
    /// When its set-up began.
    pub(crate) began: Instant,
    /// The laws of nature that are monitored, if the scene lists some.
    pub(crate) invariants: Option<Invariants>,
    /// What relaxing the start and stepping have cost.
    pub(crate) spent: Spent,
    /// What it has of the sheet, where that is spread over ranks.
    pub(crate) rank_part: Option<RankPart>,
}

impl Simulation {
    /// What of a surface of the whole sheet this rank has; all of it in one process.
    #[must_use]
    pub fn part_of(&self, mut surface: Surface) -> Surface {
        if let Some(RankPart { part, .. }) = &self.rank_part {
            part.restrict_surface(&mut surface);
        }
        surface
    }

    /// The record of its mesh, the whole one.
    pub(super) fn mesh(&self) -> MeshRecord {
        self.rank_part
            .as_ref()
            .map_or_else(|| mesh_record(self.sheet()), |rank_part| rank_part.mesh.clone())
    }

    /// The model.
    #[must_use]
    pub fn model(&self) -> &Arc<Model> {
        &self.stepper.workspace.model
    }

    /// The sheet.
    #[must_use]
    pub fn sheet(&self) -> &Arc<Sheet> {
        self.stepper.workspace.model.sheet()
    }

    /// Where it is.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.stepper.state
    }

    /// Where it is, to be changed: positions and species keep their numbers.
    pub fn state_mut(&mut self) -> &mut State {
        &mut self.stepper.state
    }

    /// The model at its state.
    pub fn evaluate(&mut self) -> Evaluation<'_> {
        self.stepper.evaluate()
    }

    /// What a person should know: odd things about the mesh, the scene or the plugin.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Evaluates the laws at its state a few times and compares: hidden state is an error, derivatives that are not those of
    /// the rates are returned, and listed with the faults of the run.
    ///
    /// # Errors
    /// If a law fails, or gives two results for the same inputs.
    pub fn try_laws(&mut self) -> Result<&[String]> {
        self.faults = laws::validate(&mut self.evaluate())?;
        Ok(&self.faults)
    }

    /// Faults of laws and effects seen so far: derivatives that are not those of the rates, results that are no numbers.
    #[must_use]
    pub fn faults(&self) -> &[String] {
        &self.faults
    }

    /// The files of the plugins.
    #[must_use]
    pub fn plugins(&self) -> &[PathBuf] {
        &self.plugins
    }

    /// Largest force on a vertex that counts as rest, in units of the force scale.
    #[must_use]
    pub fn force_tolerance(&self) -> f64 {
        self.stepper.workspace.force_tolerance()
    }

    /// Who may interrupt long work and receives reports of its progress.
    pub fn set_control(&mut self, control: Control) {
        self.stepper.workspace.control = control.over(self.sheet().reduction());
    }

    /// Makes the start satisfy the rows without storage, and the shape rest: before the first step.
    ///
    /// # Errors
    /// If a relaxation or a law fails, or the start breaks a limit of the scene.
    pub fn prepare(&mut self) -> Result<Relaxation> {
        let done = self.spend(|s| s.stepper.prepare()).0?;
        if let Some(laws) = &mut self.invariants {
            laws.begin(&mut self.stepper.workspace, &self.stepper.state)?;
        }
        Ok(done)
    }

    /// The same from the equilibrium near `x`, where other parameters led.
    ///
    /// # Errors
    /// As for [`Simulation::prepare`].
    pub fn prepare_near(&mut self, x: Positions) -> Result<Relaxation> {
        self.spend(|s| s.stepper.rest_near(x)).0?;
        self.prepare()
    }

    /// Brings the shape into equilibrium with its species.
    ///
    /// # Errors
    /// If a law or the relaxation fails.
    pub fn relax(&mut self) -> Result<Relaxation> {
        Ok(self.stepper.relax()?)
    }

    /// Continues from a state that was changed between steps: brings the shape to rest where it has no storage, and clears
    /// the history of an integrator by diffsol. Invariants count from here.
    ///
    /// # Errors
    /// If a law or the relaxation fails, or the state breaks an invariant of the scene.
    pub fn reinitialise(&mut self) -> Result<Relaxation> {
        self.stepper.integrator.renew();
        let model = self.model();
        let rests = model.moves() && model.mass_weights().mechanics == 0.0;
        let done = match rests {
            true => self.spend(|s| s.stepper.relax()).0?,
            false => Relaxation::default(),
        };
        if let Some(laws) = &mut self.invariants {
            laws.begin(&mut self.stepper.workspace, &self.stepper.state)?;
        }
        Ok(done)
    }

    /// Clears the history of an integrator by diffsol, which cannot be stored, after every so many steps, or where
    /// it is `due`. [`run`](super::run::run) calls it after the start and every step.
    pub fn renew(&mut self, due: bool) {
        let (step, integrator) = (self.stepper.state.step, &mut self.stepper.integrator);
        let after = integrator.renewed_after();
        if after.is_some_and(|after| due || step.is_multiple_of(after)) {
            integrator.renew();
        }
    }

    /// One step that does not pass the time `until`, nor one at which a law, a ramp or growth jumps or bends.
    ///
    /// # Errors
    /// `until` is not after the time of the state. Whatever no smaller step cures: the state and what solvers
    /// remember are as before then, bit for bit, but for what a library remembers: such an integrator restarts
    /// from the state. [`SolveError::BlowUp`] leaves the state whose edges exceed every bound.
    pub fn step(&mut self, until: f64) -> Result<StepReport> {
        let step = |simulation: &mut Self| {
            let Self { stepper, invariants, .. } = simulation;
            stepper.step_by(until, |stepper, until| match invariants {
                None => {
                    let Stepper { integrator, workspace, state, .. } = stepper;
                    integrator.advance(workspace, state, until).map_err(Error::from)
                }
                Some(laws) => laws.step(stepper, until),
            })
        };
        let report = self.spend(step).0?;
        match diagnosis::blows_up(self.model(), self.state()) {
            true => Err(SolveError::BlowUp { time: self.state().time }.into()),
            false => Ok(report),
        }
    }

    /// What relaxing the start and all steps have cost, failed ones included: without making the scene ready,
    /// and without observers of states in between.
    #[must_use]
    pub fn spent(&self) -> Spent {
        self.spent
    }

    /// Does `what`, and adds what it cost to what is spent.
    pub(crate) fn spend<R>(&mut self, what: impl FnOnce(&mut Self) -> R) -> (R, Spent) {
        let (began, cpu_began) = (Instant::now(), processor_time());
        let work = self.model().tally().work();
        let done = what(self);
        let work = self.model().tally().work() - work;
        let cpu_seconds =
            processor_time().zip(cpu_began).map_or(f64::NAN, |(now, then)| now - then);
        let more = Spent { work, cpu_seconds, wall_seconds: began.elapsed().as_secs_f64() };
        self.spent += more;
        (done, more)
    }

    /// The frame of its state, with the fields that its scene asks for.
    ///
    /// # Errors
    /// If a law fails.
    pub fn frame(&mut self) -> Result<Frame<'_>> {
        self.fields.frame(&mut self.stepper.evaluate())
    }

    /// Energy of every effect that has one, by name.
    ///
    /// # Errors
    /// If a law fails.
    pub fn energies(&mut self) -> Result<Vec<(String, f64)>> {
        Ok(self.stepper.energies()?)
    }

    /// Titles and numbers that the ledger has of its state, which the step of `report` has led to, but for the wall time
    /// and what a watch on stability adds.
    ///
    /// # Errors
    /// If a law fails.
    pub fn ledger_row(&mut self, report: &StepReport) -> Result<Vec<(String, f64)>> {
        let Simulation { stepper: Stepper { workspace, state, .. }, invariants, .. } = self;
        let kept = invariants.as_ref().map(Invariants::row).unwrap_or_default();
        let titles = invariants.as_ref().map(Invariants::columns).unwrap_or_default();
        let columns = columns(&workspace.model, false, &titles);
        let info = StepInfo {
            report,
            frame: false,
            new: true,
            negative: None,
            invariants: &kept,
            wall: f64::NAN,
        };
        let row = row(&mut workspace.at(state), &info, &mut ShapeSums::default())?;
        Ok(columns.into_iter().zip(row).filter(|(title, _)| title != WALL_TIME_TITLE).collect())
    }
}

/// The record of the mesh of a whole sheet, which counts no images.
pub(super) fn mesh_record(sheet: &Sheet) -> MeshRecord {
    let [vertices, triangles] = sheet.counts_of_whole();
    let all = MeshRecord::new(sheet.rest().iter().copied(), sheet.triangles().iter().copied());
    MeshRecord { vertices, triangles, ..all }
}
