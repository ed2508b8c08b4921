//! Measures of an equilibrium, or of a run in time, as functions of parameters, with gradients: what optimisers take.

use std::sync::{Mutex, PoisonError};

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rumple::study::gradient::{self, Evaluated, Place, Request};

use crate::convert;
use crate::engine::Pending;
use crate::law::Law;
use crate::plugins::Plugins;
use crate::scene::SceneOrFile;

/// J(p) and dJ/dp of the equilibria of a scene, or of its run in time.
#[pyclass(module = "rumple")]
pub(crate) struct Objective {
    work: Mutex<Work>,
    pending: Pending,
    broken: bool,
}

struct Work {
    objective: gradient::Objective,
    /// The last parameters with their equilibrium.
    last: Option<(Vec<f64>, Evaluated)>,
}

impl Work {
    /// `x` as one list a parameter.
    fn split(&self, x: &[f64]) -> rumple::Result<Vec<Vec<f64>>> {
        let needed: usize = self.objective.parameters().iter().map(|p| p.value.len()).sum();
        if x.len() != needed {
            return Err(rumple::Error::Refused(format!(
                "{} numbers are given, and the parameters are {needed}",
                x.len()
            )));
        }
        let mut rest = x;
        let mut take = |count: usize| {
            let (first, others) = rest.split_at(count);
            rest = others;
            first.to_vec()
        };
        Ok(self.objective.parameters().iter().map(|p| take(p.value.len())).collect())
    }

    fn at(&mut self, x: &[f64]) -> rumple::Result<&mut Evaluated> {
        if self.last.as_ref().is_none_or(|(known, _)| known != x) {
            let values = self.split(x)?;
            self.last = Some((x.to_vec(), self.objective.evaluate(&values)?));
        }
        match &mut self.last {
            Some((_, evaluated)) => Ok(evaluated),
            None => Err(rumple::Error::Refused("nothing is evaluated yet".to_owned())),
        }
    }

    fn value(&mut self, x: &[f64]) -> rumple::Result<f64> {
        Ok(self.at(x)?.value)
    }

    fn gradient(&mut self, x: &[f64]) -> rumple::Result<Vec<f64>> {
        self.at(x)?;
        let Self { objective, last } = self;
        let Some((_, evaluated)) = last else { return Ok(Vec::new()) };
        Ok(objective.gradient(evaluated)?.concat())
    }
}

/// A measure, or several.
#[derive(FromPyObject)]
pub(crate) enum Measures {
    One(String),
    All(Vec<String>),
}

impl Objective {
    fn with<R: Send>(
        &mut self,
        py: Python<'_>,
        work: impl FnOnce(&mut Work) -> rumple::Result<R> + Send,
    ) -> PyResult<R> {
        let Self { work: inner, pending, broken } = self;
        let inner = inner.get_mut().unwrap_or_else(PoisonError::into_inner);
        pending.call(py, broken, || work(inner))
    }

    fn work(&mut self) -> &mut Work {
        self.work.get_mut().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl Objective {
    /// Of a scene or its file; `measure` is one text or several, whose sum is J, `parameters` are keys of numbers and `fields` keys
    /// of fields. J is that of the state at rest at the end of the scene; `at_start`, of the first equilibrium; `in_time`, of the run at its end,
    /// or the sum over `times`.
    #[new]
    #[pyo3(signature = (scene, measure, parameters = Vec::new(), fields = Vec::new(), *, at_start = false, in_time = false, times = Vec::new(), law = None, plugins = None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        scene: SceneOrFile<'_>,
        measure: Measures,
        parameters: Vec<String>,
        fields: Vec<String>,
        at_start: bool,
        in_time: bool,
        times: Vec<f64>,
        law: Option<Py<Law>>,
        plugins: Option<Plugins>,
    ) -> PyResult<Self> {
        let scene = scene.checked(py)?.unbind();
        let pending = Pending::default();
        let host_law = scene.get().host_law(law.as_ref().map(Py::get), &pending.law);
        let search = Plugins::search(plugins.as_ref()).with_law(host_law);
        let (source, set) = scene.get().source();
        let place = match (at_start, in_time || !times.is_empty()) {
            (true, false) => Place::Start,
            (false, true) => Place::InTime(times),
            (false, false) => Place::End,
            (true, true) => {
                let message = "at_start and in_time exclude one another";
                return Err(pyo3::exceptions::PyValueError::new_err(message));
            }
        };
        let measures = match measure {
            Measures::One(text) => vec![text],
            Measures::All(texts) => texts,
        };
        let request = Request { scene: source, set, measures, numbers: parameters, fields, place };
        let control = pending.control();
        let made = pending
            .call(py, &mut false, move || gradient::Objective::new(request, search, control))?;
        Ok(Self { work: Mutex::new(Work { objective: made, last: None }), pending, broken: false })
    }

    /// Names of the parameters, numbers before fields.
    #[getter]
    fn names(&mut self) -> Vec<String> {
        self.work().objective.parameters().iter().map(|p| p.key.clone()).collect()
    }

    /// The parameters of the scene: numbers, and fields vertex by vertex.
    #[getter]
    fn start<'py>(&mut self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.work().objective.values().concat())
    }

    /// J.
    fn value(&mut self, py: Python<'_>, x: Vec<f64>) -> PyResult<f64> {
        self.with(py, |work| work.value(&x))
    }

    /// dJ/dp.
    fn gradient<'py>(
        &mut self,
        py: Python<'py>,
        x: Vec<f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let gradient = self.with(py, |work| work.gradient(&x))?;
        Ok(PyArray1::from_vec(py, gradient))
    }

    /// J and dJ/dp: what `scipy.optimize.minimize(objective, objective.start, jac=True)` calls.
    fn __call__<'py>(
        &mut self,
        py: Python<'py>,
        x: Vec<f64>,
    ) -> PyResult<(f64, Bound<'py, PyArray1<f64>>)> {
        let (value, gradient) = self.with(py, |work| Ok((work.value(&x)?, work.gradient(&x)?)))?;
        Ok((value, PyArray1::from_vec(py, gradient)))
    }

    /// The parameters `x` by name: numbers, and arrays of fields.
    fn split<'py>(&mut self, py: Python<'py>, x: Vec<f64>) -> PyResult<Bound<'py, PyDict>> {
        let values = self.with(py, |work| work.split(&x))?;
        let by_name = PyDict::new(py);
        for (parameter, values) in self.work().objective.parameters().iter().zip(values) {
            match parameter.is_field() {
                true => by_name.set_item(&parameter.key, convert::column(py, &values))?,
                false => by_name.set_item(&parameter.key, values.first().copied())?,
            }
        }
        Ok(by_name)
    }

    /// The shape at rest, or at the last time, with the parameters `x`, n × 3.
    fn positions<'py>(
        &mut self,
        py: Python<'py>,
        x: Vec<f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let positions = self.with(py, |work| Ok(work.at(&x)?.state().x.to_vec()))?;
        convert::vectors(py, &positions)
    }
}
