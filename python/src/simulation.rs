//! A simulation: stepped, asked and changed between steps.

use std::path::PathBuf;

use numpy::PyArray2;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};
use rumple::geometry;
use rumple::run::{Checkpoint, inspect};
use rumple::sheet::Surface;
use rumple::study::{Measures, measure};

use crate::course::{Course, OwnedField, Simulation};
use crate::law::Law;
use crate::plugins::Plugins;
use crate::run::{full, warn};
use crate::scene::SceneOrFile;
use crate::species::Species;
use crate::step::Step;
use crate::{convert, engine};

#[pymethods]
impl Simulation {
    /// Makes a scene, or the scene of a file, ready to run; `plugins` are folders in which its plugins are looked for first.
    #[new]
    #[pyo3(signature = (scene, *, law = None, plugins = None))]
    fn new(
        py: Python<'_>,
        scene: SceneOrFile<'_>,
        law: Option<Py<Law>>,
        plugins: Option<Plugins>,
    ) -> PyResult<Self> {
        let mut made = Self::set_up(py, scene.checked(py)?.unbind(), law, plugins)?;
        made.course().engine.notes().iter().try_for_each(|note| warn(py, note, 1))?;
        Ok(made)
    }

    /// Brings the start into equilibrium and tries its laws, as the first step does; the number of iterations.
    pub(crate) fn prepare(&mut self, py: Python<'_>) -> PyResult<usize> {
        let first = !self.course().prepared;
        let iterations = self.with(py, |course| Ok(course.prepare()?.iterations))?;
        if first {
            self.course().engine.faults().iter().try_for_each(|fault| warn(py, fault, 1))?;
        }
        Ok(iterations)
    }

    /// Brings the shape into equilibrium with its species; the number of iterations.
    fn relax(&mut self, py: Python<'_>) -> PyResult<usize> {
        self.with(py, |course| {
            let prepared = course.prepare()?.iterations;
            Ok(prepared + course.engine.relax()?.iterations)
        })
    }

    /// One step, which ends at the latest at the next output time and at `until`; None at the end.
    #[pyo3(signature = (until = None))]
    fn step(&mut self, py: Python<'_>, until: Option<f64>) -> PyResult<Option<Step>> {
        let until = self.goal(until)?;
        self.advance(py, until)
    }

    /// Steps to the time `until`, or to the end of the scene; the last step.
    #[pyo3(signature = (until = None, observe = None))]
    fn run<'py>(
        slf: &Bound<'py, Self>,
        until: Option<f64>,
        observe: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Option<Bound<'py, Step>>> {
        let py = slf.py();
        let until = slf.try_borrow_mut()?.goal(until)?;
        let mut last = None;
        loop {
            py.check_signals()?;
            let Some(step) = slf.try_borrow_mut()?.advance(py, until)? else { return Ok(last) };
            let step = Bound::new(py, step)?;
            let ended = match &observe {
                Some(observe) => observe.call1((slf, &step))?.is_truthy()?,
                None => false,
            };
            last = Some(step);
            if ended {
                return Ok(last);
            }
        }
    }

    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __next__(&mut self, py: Python<'_>) -> PyResult<Option<Step>> {
        let until = self.goal(None)?;
        self.advance(py, until)
    }

    /// Writes all that later steps depend on into a file.
    fn checkpoint(&mut self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let checkpoint = self.checkpointed(py)?;
        engine::call(py, || checkpoint.write(&full(&path)?))
    }

    /// Continues from the file of a checkpoint of the same scene.
    fn restore(&mut self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let checkpoint = engine::call(py, || Checkpoint::read(&full(&path)?))?;
        *self = self.continued(py, &checkpoint)?;
        Ok(())
    }

    /// Another simulation in the same state, which makes the same steps.
    fn copy(&mut self, py: Python<'_>) -> PyResult<Self> {
        let checkpoint = self.checkpointed(py)?;
        self.continued(py, &checkpoint)
    }

    /// Why the run is at its end; None before it.
    #[getter]
    fn ending(&mut self, py: Python<'_>) -> PyResult<Option<String>> {
        self.with(py, |course| Ok(course.ending()?.map(|ending| ending.to_string())))
    }

    /// Time of the state.
    #[getter]
    fn time(&mut self) -> f64 {
        self.course().engine.state().time
    }

    /// Accepted steps.
    #[getter]
    fn steps(&mut self) -> u64 {
        self.course().engine.state().step
    }

    /// Warnings about the mesh, the scene or the laws, which are issued as UserWarning too.
    #[getter]
    fn notes(&mut self) -> Vec<String> {
        let engine = &self.course().engine;
        [engine.notes(), engine.faults()].concat()
    }

    /// Positions of the vertices, n × 3; a read-only copy.
    #[getter]
    fn positions<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let engine = &self.course().engine;
        convert::vectors(py, inspect::own(engine.sheet(), &engine.state().x))
    }

    #[setter]
    fn set_positions(&mut self, py: Python<'_>, positions: &Bound<'_, PyAny>) -> PyResult<()> {
        let [vertices, _] = self.course().engine.sheet().counts_of_whole();
        let points = convert::points(positions, vertices)?;
        self.with(py, |course| course.take(&Surface { points, ..course.surface() }))
    }

    /// Positions of the vertices in the reference configuration, n × 3.
    #[getter]
    fn rest_positions<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let sheet = self.course().engine.sheet();
        convert::vectors(py, inspect::own(sheet, sheet.rest()))
    }

    /// Vertices of the triangles, m × 3; those across the end of a period have vertices on either side of it.
    #[getter]
    fn triangles<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<i64>>> {
        let sheet = self.course().engine.sheet();
        let own = inspect::own(sheet, sheet.triangles()).iter();
        let triangles: Vec<_> = own.map(|t| t.map(|v| sheet.number(v as usize))).collect();
        convert::triangles(py, &triangles)
    }

    /// Translations by which a periodic sheet repeats itself, one a row; none of other sheets.
    #[getter]
    fn periods<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        convert::vectors(py, self.course().engine.sheet().reduction().periods())
    }

    /// The species, by name.
    #[getter]
    fn species(slf: Py<Self>) -> Species {
        Species { of: slf }
    }

    /// Energy of every effect that has one, by name.
    fn energies<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let energies = PyDict::new(py);
        for (name, energy) in self.with(py, |course| course.engine.energies())? {
            energies.set_item(name, energy)?;
        }
        Ok(energies)
    }

    /// The fields of a frame of the state, by name with unit: on vertices, or on triangles with `cells`.
    #[pyo3(signature = (*, cells = false))]
    fn fields<'py>(&mut self, py: Python<'py>, cells: bool) -> PyResult<Bound<'py, PyDict>> {
        let fields = PyDict::new(py);
        let [points, triangles] = self.with(py, Course::fields)?;
        for (name, components, values) in if cells { triangles } else { points } {
            fields.set_item(name, convert::field(py, components, values)?)?;
        }
        Ok(fields)
    }

    /// One field of a frame of the state, with or without its unit in the name.
    #[pyo3(signature = (name, *, cells = false))]
    fn field<'py>(
        &mut self,
        py: Python<'py>,
        name: &str,
        cells: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let [points, triangles] = self.with(py, Course::fields)?;
        let bare = |title: &str| title.split(" [").next().unwrap_or_default().to_owned();
        let mut all: Vec<OwnedField> = if cells { triangles } else { points };
        match all.iter().position(|field| field.0 == name || bare(&field.0) == name) {
            Some(found) => {
                let (_, components, values) = all.swap_remove(found);
                convert::field(py, components, values)
            }
            None => {
                let names: Vec<String> = all.iter().map(|field| bare(&field.0)).collect();
                let place = if cells { "on triangles" } else { "on vertices" };
                let listed = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
                Err(PyKeyError::new_err(format!(
                    "frames have no field {name:?} {place}, they have: {listed}; output.fields of the scene \
                     lists what they have"
                )))
            }
        }
    }

    /// Titles and numbers that the ledger has of the state, but for wall time and watches on stability.
    fn ledger_row<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let row = self.with(py, |course| {
            let Course { engine, latest, .. } = course;
            engine.ledger_row(latest)
        })?;
        row.into_py_dict(py)
    }

    /// Scalar measures of the state.
    #[pyo3(signature = (*, level = None))]
    fn measures<'py>(
        &mut self,
        py: Python<'py>,
        level: Option<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let measured =
            self.with(py, |course| Ok(measure(&mut course.engine.evaluate(), level)?))?;
        let Measures {
            energy, amplitude, deflection, share, rate, separation, nearest, width, ..
        } = measured;
        let measures = PyDict::new(py);
        let known = [("energy", energy), ("amplitude", amplitude), ("deflection", deflection)];
        let mut known = known.into_iter().chain([("share", share), ("rate", rate)]);
        known.try_for_each(|(name, value)| measures.set_item(name, value))?;
        measures.set_item("spots", measured.spots)?;
        measures.set_item("separation", separation)?;
        measures.set_item("nearest", nearest)?;
        measures.set_item("width", width)?;
        measures.set_item("wrinkle_width", measured.wrinkle_width)?;
        Ok(measures)
    }

    /// Everything that is known of the state, by name.
    fn inspect<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let text = self.with(py, |course| Ok(inspect::inspect(&mut course.engine)?.to_string()))?;
        py.import("rumple._inspect")?.call_method1("state", (text,))
    }

    /// Current area.
    #[getter]
    fn area(&mut self) -> f64 {
        let engine = &self.course().engine;
        geometry::area(engine.sheet(), &engine.state().x)
    }

    /// Volume that a closed sheet encloses, positive where normals point outwards; None of a sheet with a boundary.
    #[getter]
    fn volume(&mut self) -> Option<f64> {
        let engine = &self.course().engine;
        let (sheet, x) = (engine.sheet(), &engine.state().x);
        let bounded = sheet.boundary().contains(&true) || !sheet.reduction().periods().is_empty();
        let closed = !sheet.triangles().is_empty() && !bounded;
        closed.then(|| geometry::volume(sheet, x, x[0]))
    }

    /// The surface with its fields as a mesh of PyVista.
    fn to_pyvista<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("rumple._pyvista")?.call_method1("mesh_of", (slf,))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("rumple._html")?.call_method1("simulation", (slf,))
    }

    fn __repr__(&mut self) -> String {
        let engine = &self.course().engine;
        let ([vertices, _], state) = (engine.sheet().counts_of_whole(), engine.state());
        let (time, step) = (state.time, state.step);
        format!("<rumple.Simulation at time {time}, step {step}, {vertices} vertices>")
    }
}
