//! A simulation that is on its way: stepped to its output times until a rule stops it.

use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rumple::kinetics::Location;
use rumple::run::run::Ending;
use rumple::run::schedule::OutputSchedule;
use rumple::run::{Checkpoint, Observer, StopRules, inspect};
use rumple::sheet::{Array, Surface};
use rumple::solve::StepReport;
use rumple::solve::equilibrium::Relaxation;

use crate::engine::{Error, Pending};
use crate::law::Law;
use crate::plugins::Plugins;
use crate::scene::Scene;
use crate::step::Step;

/// A simulation with the schedule of its outputs and its stop rules.
pub(crate) struct Course {
    pub(crate) engine: rumple::Simulation,
    pub(crate) schedule: OutputSchedule,
    pub(crate) rules: StopRules,
    pub(crate) until: f64,
    /// Whether the start satisfies its equations and the shape is at rest.
    pub(crate) prepared: bool,
    /// Report of the last step.
    pub(crate) latest: StepReport,
    /// Whether the state was changed since the last step.
    pub(crate) changed: bool,
}

impl Course {
    pub(crate) fn prepare(&mut self) -> rumple::Result<Relaxation> {
        let done = match (self.prepared, self.changed) {
            (false, _) => self.engine.prepare()?,
            (true, true) => self.engine.reinitialise()?,
            (true, false) => Relaxation::default(),
        };
        if !self.prepared {
            self.engine.try_laws()?;
            self.engine.renew(false);
            self.schedule.pass(self.engine.state().time);
        }
        (self.prepared, self.changed) = (true, false);
        Ok(done)
    }

    pub(crate) fn ending(&mut self) -> rumple::Result<Option<Ending>> {
        self.rules.stop(&mut self.engine.evaluate())
    }

    /// One step, unless the run is at its end or at `until`.
    pub(crate) fn step(&mut self, until: f64) -> rumple::Result<Option<StepReport>> {
        self.prepare()?;
        if self.engine.state().time >= until || self.ending()?.is_some() {
            return Ok(None);
        }
        let report = self.engine.step(self.schedule.target().min(until))?;
        let time = self.engine.state().time;
        self.engine.renew(false);
        self.schedule.pass(time);
        self.latest = report.clone();
        Ok(Some(report))
    }

    pub(crate) fn location(&self) -> Location {
        self.engine.model().chemistry().map_or(Location::Vertex, |c| c.location())
    }

    /// The state as a surface, which [`Course::take`] takes back.
    pub(crate) fn surface(&self) -> Surface {
        let state = self.engine.state();
        let chemistry = self.engine.model().chemistry();
        let species = chemistry.map(|c| c.descriptor().species.as_slice()).unwrap_or_default();
        let array = |(species, values): (&rumple::kinetics::Species, &Vec<f64>)| Array {
            name: species.name.clone(),
            components: 1,
            values: values.clone(),
        };
        let arrays = species.iter().zip(&state.species).map(array).collect();
        let mut surface = Surface { points: state.x.to_vec(), ..Surface::default() };
        match self.location() {
            Location::Vertex => surface.point_arrays = arrays,
            _ => surface.cell_arrays = arrays,
        }
        surface
    }

    /// Takes over positions and species, checked.
    pub(crate) fn take(&mut self, surface: &Surface) -> rumple::Result<()> {
        inspect::take_state(&mut self.engine, surface)?;
        self.changed = true;
        Ok(())
    }

    /// All fields of a frame of the state: on vertices and on triangles.
    pub(crate) fn fields(&mut self) -> rumple::Result<[Vec<OwnedField>; 2]> {
        let counts = self.engine.sheet().counts_of_whole();
        let frame = self.engine.frame()?;
        let owned = |fields: Vec<rumple::output::Field<'_>>, count: usize| {
            let own = |f: rumple::output::Field<'_>| {
                let mut data = f.data.into_owned();
                data.truncate(count * f.components);
                (f.name, f.components, data)
            };
            fields.into_iter().map(own).collect()
        };
        Ok([owned(frame.point, counts[0]), owned(frame.cell, counts[1])])
    }
}

/// Name, components and values.
pub(crate) type OwnedField = (String, usize, Vec<f64>);

/// A scene that is set up, to be stepped and asked.
#[pyclass(module = "rumple")]
pub(crate) struct Simulation {
    // Never waited for: methods that lock it borrow the object exclusively.
    pub(crate) course: Mutex<Course>,
    pub(crate) pending: Pending,
    pub(crate) broken: bool,
    /// Scene, law and folders of plugins, for another one of the same.
    pub(crate) scene: Py<Scene>,
    pub(crate) law: Option<Py<Law>>,
    pub(crate) plugins: Option<Plugins>,
}

impl Simulation {
    /// Does `work` with the engine; see [`Pending::call`].
    pub(crate) fn with<R: Send>(
        &mut self,
        py: Python<'_>,
        work: impl FnOnce(&mut Course) -> rumple::Result<R> + Send,
    ) -> PyResult<R> {
        let Self { course, pending, broken, .. } = self;
        let course = course.get_mut().unwrap_or_else(PoisonError::into_inner);
        pending.call(py, broken, || work(course))
    }

    /// Sets up a scene with a law in Python and folders of plugins.
    pub(crate) fn set_up(
        py: Python<'_>,
        scene: Py<Scene>,
        law: Option<Py<Law>>,
        plugins: Option<Plugins>,
    ) -> PyResult<Self> {
        let pending = Pending::default();
        let host_law = scene.get().host_law(law.as_ref().map(Py::get), &pending.law);
        let search = Plugins::search(plugins.as_ref()).with_law(host_law);
        let (checked, control) = (Arc::clone(&scene.get().checked), pending.control());
        let made = pending.call(py, &mut false, move || {
            let mut engine = rumple::Simulation::new(&checked, &search)?;
            engine.set_control(control);
            let (schedule, rules) = (OutputSchedule::new(&checked), StopRules::new(&checked));
            let until = checked.time.span.until.get();
            let latest = StepReport::default();
            Ok(Course { engine, schedule, rules, until, prepared: false, latest, changed: false })
        })?;
        Ok(Self { course: Mutex::new(made), pending, broken: false, scene, law, plugins })
    }

    /// The checkpoint of its state.
    pub(crate) fn checkpointed(&mut self, py: Python<'_>) -> PyResult<Checkpoint> {
        let scene = Arc::clone(&self.scene.get().checked);
        self.with(py, |course| {
            course.prepare()?;
            Checkpoint::capture(&scene, &mut course.engine)
        })
    }

    /// A simulation of the same that continues from a checkpoint.
    pub(crate) fn continued(&self, py: Python<'_>, checkpoint: &Checkpoint) -> PyResult<Self> {
        let again = |law: &Py<Law>| law.clone_ref(py);
        let (scene, law) = (self.scene.clone_ref(py), self.law.as_ref().map(again));
        let mut made = Self::set_up(py, scene, law, self.plugins.clone())?;
        let scene = Arc::clone(&self.scene.get().checked);
        made.with(py, |course| {
            checkpoint.take_up(&scene, &mut course.engine)?;
            course.prepared = true;
            course.schedule.pass(checkpoint.time());
            Ok(())
        })?;
        Ok(made)
    }

    /// What can be read without work.
    pub(crate) fn course(&mut self) -> &mut Course {
        self.course.get_mut().unwrap_or_else(PoisonError::into_inner)
    }

    /// The time to which steps may go.
    pub(crate) fn goal(&mut self, until: Option<f64>) -> PyResult<f64> {
        let end = self.course().until;
        let Some(until) = until else { return Ok(end) };
        if until > end {
            let text =
                format!("the scene ends at time {end}, before {until}: give it another time.until");
            return Err(Error::new_err(text));
        }
        if until.is_nan() {
            return Err(PyValueError::new_err("until is NaN"));
        }
        let time = self.course().engine.state().time;
        if until < time {
            let text = format!("until is {until}, before the time {time} of the state");
            return Err(PyValueError::new_err(text));
        }
        Ok(until)
    }

    pub(crate) fn advance(&mut self, py: Python<'_>, until: f64) -> PyResult<Option<Step>> {
        if !self.course().prepared {
            self.prepare(py)?;
        }
        self.with(py, |course| {
            let report = course.step(until)?;
            Ok(report.map(|report| Step::of(course.engine.state(), &report)))
        })
    }
}
