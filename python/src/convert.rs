//! Columns of the engine as NumPy arrays.

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use rumple::Vec3;

/// Positions or vectors, n × 3.
pub(crate) fn vectors<'py>(py: Python<'py>, x: &[Vec3]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let flat = x.iter().flat_map(|x| [x.x, x.y, x.z]).collect();
    PyArray1::from_vec(py, flat).reshape([x.len(), 3])
}

/// Vertices of triangles, n × 3.
pub(crate) fn triangles<'py>(
    py: Python<'py>,
    corners: &[[u32; 3]],
) -> PyResult<Bound<'py, PyArray2<i64>>> {
    let flat = corners.iter().flatten().map(|&vertex| i64::from(vertex)).collect();
    PyArray1::from_vec(py, flat).reshape([corners.len(), 3])
}

/// A field with one or more components, as an array with one or two axes.
pub(crate) fn field<'py>(
    py: Python<'py>,
    components: usize,
    values: Vec<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let rows = values.len() / components.max(1);
    let flat = PyArray1::from_vec(py, values);
    match components {
        1 => Ok(flat.into_any()),
        _ => Ok(flat.reshape([rows, components])?.into_any()),
    }
}
