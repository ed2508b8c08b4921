//! Runs into result directories, as `rumple run` and `rumple resume` make them.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use numpy::PyArray2;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rumple::model::Evaluation;
use rumple::output::{Interrupt, ResultDirectory};
use rumple::run::run::{Ending, continued, recorded};
use rumple::run::{Observer, StepInfo, inspect, provenance, resume as resumption};
use rumple::sheet::read;
use rumple::view;
use rumple::view::picture::{self, DrawingOptions};

use crate::engine::{Pending, Slot};
use crate::law::Law;
use crate::plugins::Plugins;
use crate::scene::Scene;
use crate::{convert, engine, log, overrides};

/// A state of a run that writes results, for observers.
#[pyclass(module = "rumple", frozen, get_all)]
pub(crate) struct State {
    /// Time of the state.
    time: f64,
    /// Accepted steps.
    steps: u64,
    /// Positions of the vertices, n × 3.
    positions: Py<PyArray2<f64>>,
    /// Values of the species where they live, by name.
    species: Py<PyDict>,
    /// Energy of every effect that has one, by name.
    energies: Py<PyDict>,
}

impl State {
    /// Copies the state of `at`.
    fn of(py: Python<'_>, at: &Evaluation<'_>, energies: Vec<f64>) -> PyResult<Self> {
        let (model, state) = (at.model(), at.state());
        let species = PyDict::new(py);
        let names = model.chemistry().map(|c| c.descriptor().species.as_slice());
        for (about, values) in names.unwrap_or_default().iter().zip(&state.species) {
            let own = inspect::own(model.sheet(), values);
            species.set_item(&about.name, convert::column(py, own))?;
        }
        let by_name = PyDict::new(py);
        for (name, energy) in model.mechanics().names().zip(energies) {
            by_name.set_item(name, energy)?;
        }
        Ok(Self {
            time: state.time,
            steps: state.step,
            positions: convert::vectors(py, inspect::own(model.sheet(), &state.x))?.unbind(),
            species: species.unbind(),
            energies: by_name.unbind(),
        })
    }
}

#[pymethods]
impl State {
    fn __repr__(&self) -> String {
        format!("<rumple.State at time {}, step {}>", self.time, self.steps)
    }
}

/// Shows the state after every step to a function in Python, which may end the run.
struct Shown {
    observe: Py<PyAny>,
    /// The step that was seen last; none before the start.
    seen: Option<u64>,
    raised: Slot,
    interrupt: Interrupt,
}

impl Observer for Shown {
    fn observe(&mut self, _: &mut Evaluation<'_>, _: &StepInfo<'_>) -> rumple::Result<()> {
        Ok(())
    }

    fn stop(&mut self, at: &mut Evaluation<'_>) -> rumple::Result<Option<Ending>> {
        let step = at.state().step;
        let begun = self.seen.replace(step);
        // The initial state is not a step, and the state before a step that was interrupted is shown twice.
        if begun.is_none() || begun == Some(step) {
            return Ok(None);
        }
        let energies = at.energies()?;
        let ended = Python::attach(|py| {
            let state = Bound::new(py, State::of(py, at, energies)?)?;
            self.observe.call1(py, (state,))?.is_truthy(py)
        });
        match ended {
            Ok(true) => Ok(Some(Ending::Observed("an observer has ended the run"))),
            Ok(false) => Ok(None),
            Err(error) => {
                // The run ends as one that is interrupted, and can be continued.
                self.raised.keep(error);
                self.interrupt.request();
                Ok(None)
            }
        }
    }
}

/// What a run has besides its scene and its directory.
struct Attended {
    pending: Pending,
    interrupt: Interrupt,
    threads: usize,
    shown: Option<Shown>,
}

impl Attended {
    fn new(observe: Option<Py<PyAny>>, threads: usize) -> Self {
        let (pending, interrupt) = (Pending::default(), Interrupt::of_one_run());
        let shown = observe.map(|observe| Shown {
            observe,
            seen: None,
            raised: pending.signal.clone(),
            interrupt,
        });
        Self { pending, interrupt, threads, shown }
    }

    /// Does `work`, which is given the interrupt and the observers, and writes the viewer beside its results in the
    /// directory that it has come to, if the scene wants one.
    fn run(
        self,
        py: Python<'_>,
        work: impl FnOnce(Interrupt, &mut [&mut dyn Observer], &mut Reached) -> rumple::Result<()>
        + Send,
    ) -> PyResult<PathBuf> {
        let Self { pending, interrupt, threads, mut shown } = self;
        let mut reached = Reached::default();
        let done = pending.attend(py, (interrupt, threads), || {
            let mut others: Vec<&mut dyn Observer> = Vec::new();
            others.extend(shown.as_mut().map(|shown| -> &mut dyn Observer { shown }));
            let done = work(interrupt, &mut others, &mut reached);
            if reached.report {
                reached.missing = view::write_report(&reached.root).err().map(|e| e.to_string());
            }
            done
        });
        if let Some(why) = reached.missing {
            let text = format!("no {} is written: {why}", ResultDirectory::REPORT);
            warn(py, &text, 2)?;
        }
        reached.notes.iter().try_for_each(|note| warn(py, note, 2))?;
        done.map(|()| reached.root)
    }
}

/// The directory of a run that has begun, and what is to be said of it.
#[derive(Default)]
struct Reached {
    root: PathBuf,
    report: bool,
    missing: Option<String>,
    notes: Vec<String>,
}

/// Issues a warning for the line of Python that is `level` calls up; 1 is the one that called the engine.
pub(crate) fn warn(py: Python<'_>, text: &str, level: usize) -> PyResult<()> {
    let text = engine::in_python(text.to_owned());
    py.import("warnings")?.call_method1("warn", (text, py.get_type::<PyUserWarning>(), level))?;
    Ok(())
}

/// The path `path` in full, which the working directory does not change.
pub(crate) fn full(path: &Path) -> rumple::Result<PathBuf> {
    let refuse = |error| rumple::Error::Refused(format!("{}: {error}", path.display()));
    std::path::absolute(path).map_err(refuse)
}

/// Runs a scene and writes its results; the directory.
#[pyfunction]
#[pyo3(signature = (scene, out, state, start_time, force, observe, law, plugins, threads))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn run(
    py: Python<'_>,
    scene: &Scene,
    out: Option<PathBuf>,
    state: Option<PathBuf>,
    start_time: Option<f64>,
    force: bool,
    observe: Option<Py<PyAny>>,
    law: Option<&Law>,
    plugins: Option<Plugins>,
    threads: u16,
) -> PyResult<PathBuf> {
    let attended = Attended::new(observe, threads.into());
    let law = scene.host_law(law, &attended.pending.law);
    let scene = Arc::clone(&scene.checked);
    attended.run(py, move |interrupt, others, reached| {
        let stem = Path::new(scene.name());
        let default = || ResultDirectory::default_path(stem, SystemTime::now());
        let root = full(&out.unwrap_or_else(default))?;
        let search = Plugins::search(plugins.as_ref()).with_law(law);
        let mut simulation = rumple::Simulation::new(&scene, &search)?;
        let mut inputs = provenance::inputs(&scene, simulation.plugins());
        let state = state.map(|path| full(&path)).transpose()?;
        if let Some(path) = &state {
            inputs.add("the state", path);
            inspect::start_from(&mut simulation, &scene, read::surface(path)?, start_time)?;
        }
        inputs.outside(&root)?;
        let directory = ResultDirectory::prepare(&root, force)?;
        (reached.root, reached.report) = (root, scene.output.report);
        reached.notes = simulation.notes().to_vec();
        let mut progress = log::progress(scene.time.span.until.get());
        let origin = (&*scene, state.as_deref());
        let done = recorded(origin, &mut simulation, &directory, &mut progress, interrupt, others);
        progress.finish();
        reached.notes.extend_from_slice(simulation.faults());
        done.map(|_| ())
    })
}

/// Continues the run in a directory; the directory.
#[pyfunction]
#[pyo3(signature = (directory, changes, observe, law, plugins, threads))]
#[allow(clippy::too_many_arguments)]
pub(crate) fn resume(
    py: Python<'_>,
    directory: PathBuf,
    changes: &Bound<'_, PyAny>,
    observe: Option<Py<PyAny>>,
    law: Option<&Law>,
    plugins: Option<Plugins>,
    threads: u16,
) -> PyResult<PathBuf> {
    let changes = overrides::texts(Some(changes))?;
    let attended = Attended::new(observe, threads.into());
    let law = law.map(|law| law.host_law(&attended.pending.law));
    attended.run(py, move |interrupt, others, reached| {
        let root = full(&directory)?;
        if !root.is_dir() {
            let text = format!("{}: no such directory", root.display());
            return Err(rumple::Error::Refused(text));
        }
        let directory = ResultDirectory::reopen(&root)?;
        let search = Plugins::search(plugins.as_ref()).with_law(law);
        let mut resumed = resumption::resume(&directory, &changes, &search)?;
        (reached.root, reached.report) = (root, resumed.scene.output.report);
        reached.notes = resumed.notes.clone();
        let end = resumed.scene.time.span.until.get();
        let mut progress = log::progress(end);
        let done = continued(&mut resumed, &directory, &mut progress, interrupt, others);
        progress.finish();
        reached.notes.extend_from_slice(resumed.simulation.faults());
        done.map(|_| ())
    })
}

/// Draws the results in a directory into the file `out`: a movie at `rate` frames a second of at most so many frames, or the
/// frame nearest to `time`. `drawing` is JSON.
#[pyfunction]
pub(crate) fn draw(
    py: Python<'_>,
    files: (PathBuf, PathBuf, bool),
    drawing: &str,
    time: Option<f64>,
    movie: Option<(usize, f64)>,
) -> PyResult<()> {
    engine::call(py, || {
        let drawing = DrawingOptions::from_json(drawing)?;
        let (root, out) = (full(&files.0)?, full(&files.1)?);
        let files = (root.as_path(), out.as_path(), files.2);
        match movie {
            None => picture::picture(files, &drawing, time).map(drop),
            Some(frames) => picture::movie(files, &drawing, frames).map(drop),
        }
    })
}

/// Writes the viewer of the results in a directory beside them; its path.
#[pyfunction]
pub(crate) fn report(py: Python<'_>, directory: PathBuf) -> PyResult<PathBuf> {
    engine::call(py, || view::write_report(&full(&directory)?))
}
