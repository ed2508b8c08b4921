//! Frames and meshes of files.

use std::path::PathBuf;

use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rumple::sheet::{Array, read};

use crate::{convert, engine};

/// Points, triangles, point fields, cell fields, time.
type Parts<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<i64>>,
    Bound<'py, PyDict>,
    Bound<'py, PyDict>,
    Option<f64>,
);

/// Reads points, triangles, point fields, cell fields and the time of a file (.vtu, .vtp, .vtk, .obj).
#[pyfunction]
pub(crate) fn read_surface<'py>(py: Python<'py>, path: PathBuf) -> PyResult<Parts<'py>> {
    let surface = engine::call(py, || Ok(read::surface(&path)?))?;
    Ok((
        convert::vectors(py, &surface.points)?,
        convert::triangles(py, &surface.triangles)?,
        arrays(py, surface.point_arrays)?,
        arrays(py, surface.cell_arrays)?,
        surface.time,
    ))
}

fn arrays(py: Python<'_>, all: Vec<Array>) -> PyResult<Bound<'_, PyDict>> {
    let fields = PyDict::new(py);
    for Array { name, components, values } in all {
        fields.set_item(name, convert::field(py, components, values)?)?;
    }
    Ok(fields)
}
