//! The species of a simulation as a mapping.

use numpy::PyArray1;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use rumple::run::inspect;
use rumple::sheet::Array;

use crate::convert;
use crate::course::{Course, Simulation};

/// Values of the species where they live, by name: read-only copies, and to be set.
#[pyclass(module = "rumple", frozen)]
pub(crate) struct Species {
    pub(crate) of: Py<Simulation>,
}

fn names(course: &Course) -> Vec<String> {
    let chemistry = course.engine.model().chemistry();
    let all = chemistry.map(|c| c.descriptor().species.as_slice()).unwrap_or_default();
    all.iter().map(|species| species.name.clone()).collect()
}

/// The number of the species `name`.
fn index(course: &Course, name: &str) -> PyResult<usize> {
    let names = names(course);
    names.iter().position(|known| known == name).ok_or_else(|| {
        PyKeyError::new_err(format!("no species {name:?}; expected one of: {}", names.join(", ")))
    })
}

#[pymethods]
impl Species {
    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut simulation = self.of.try_borrow_mut(py)?;
        let course = simulation.course();
        let values = &course.engine.state().species[index(course, name)?];
        Ok(convert::column(py, inspect::own(course.engine.sheet(), values)))
    }

    fn __setitem__(&self, py: Python<'_>, name: &str, values: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut simulation = self.of.try_borrow_mut(py)?;
        let course = simulation.course();
        let values_now = &course.engine.state().species[index(course, name)?];
        let count = inspect::own(course.engine.sheet(), values_now).len();
        let values = convert::values(values, name, count)?;
        simulation.with(py, |course| {
            let mut surface = course.surface();
            let arrays = surface.point_arrays.iter_mut().chain(&mut surface.cell_arrays);
            for array in arrays.filter(|array| array.name == name) {
                *array = Array { values: values.clone(), ..array.clone() };
            }
            course.take(&surface)
        })
    }

    /// Names of the species.
    fn keys(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        Ok(names(self.of.try_borrow_mut(py)?.course()))
    }

    /// Names and values of the species.
    fn items<'py>(&self, py: Python<'py>) -> PyResult<Vec<(String, Bound<'py, PyArray1<f64>>)>> {
        let value = |name: String| Ok((name.clone(), self.__getitem__(py, &name)?));
        self.keys(py)?.into_iter().map(value).collect()
    }

    /// Values of the species.
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyArray1<f64>>>> {
        Ok(self.items(py)?.into_iter().map(|item| item.1).collect())
    }

    fn __contains__(&self, py: Python<'_>, name: &str) -> PyResult<bool> {
        Ok(self.keys(py)?.iter().any(|known| known == name))
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.keys(py)?.len())
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.keys(py)?.into_pyobject(py)?.try_iter()?.into_any())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<rumple.Species {}>", self.keys(py)?.join(", ")))
    }
}
