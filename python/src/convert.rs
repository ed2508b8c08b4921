//! Columns of the engine as NumPy arrays, and back.

use numpy::{Element, PyArray, PyArray1, PyArray2, PyArrayLike1, PyArrayLike2, PyArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use rumple::Vec3;

/// The same array, which cannot be written to: what it shows is not to be set.
pub(crate) fn read_only<'py, T: Element, D: numpy::ndarray::Dimension>(
    array: &Bound<'py, PyArray<T, D>>,
) -> Bound<'py, PyArray<T, D>> {
    Bound::clone(&array.readwrite().make_nonwriteable())
}

/// A column that cannot be written to.
pub(crate) fn column<'py>(py: Python<'py>, values: &[f64]) -> Bound<'py, PyArray1<f64>> {
    read_only(&PyArray1::from_slice(py, values))
}

/// Positions or vectors, n × 3, which cannot be written to.
pub(crate) fn vectors<'py>(py: Python<'py>, x: &[Vec3]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let flat = x.iter().flat_map(|x| [x.x, x.y, x.z]).collect();
    Ok(read_only(&PyArray1::from_vec(py, flat).reshape([x.len(), 3])?))
}

/// Vertices of triangles, n × 3.
pub(crate) fn triangles<'py>(
    py: Python<'py>,
    corners: &[[u32; 3]],
) -> PyResult<Bound<'py, PyArray2<i64>>> {
    let flat = corners.iter().flatten().map(|&vertex| i64::from(vertex)).collect();
    Ok(read_only(&PyArray1::from_vec(py, flat).reshape([corners.len(), 3])?))
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
        1 => Ok(read_only(&flat).into_any()),
        _ => Ok(read_only(&flat.reshape([rows, components])?).into_any()),
    }
}

/// The `count` values that are given for `name`: a number for all, or one each.
///
/// # Errors
/// TypeError or ValueError that says what was given.
pub(crate) fn values(given: &Bound<'_, PyAny>, name: &str, count: usize) -> PyResult<Vec<f64>> {
    let expected = format!("a number, or an array of {count} numbers");
    check_real(given, name, &expected)?;
    if let Ok(value) = given.extract::<f64>() {
        return Ok(vec![value; count]);
    }
    let found: Option<PyArrayLike1<'_, f64, numpy::AllowTypeChange>> = given.extract().ok();
    match found.as_ref().map(|column| column.as_array()).filter(|column| column.len() == count) {
        Some(column) => Ok(column.iter().copied().collect()),
        None => Err(misfit(given, name, &expected)),
    }
}

/// The positions that are given, n × 3.
///
/// # Errors
/// TypeError or ValueError that says what was given.
pub(crate) fn points(given: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<Vec3>> {
    let expected = format!("an array of shape ({count}, 3)");
    check_real(given, "positions", &expected)?;
    let found: Option<PyArrayLike2<'_, f64, numpy::AllowTypeChange>> = given.extract().ok();
    match found.as_ref().map(|rows| rows.as_array()).filter(|rows| rows.dim() == (count, 3)) {
        Some(rows) => {
            Ok(rows.rows().into_iter().map(|row| Vec3::new(row[0], row[1], row[2])).collect())
        }
        None => Err(misfit(given, "positions", &expected)),
    }
}

/// Refuses what is not of real numbers: NumPy would take the real part of others, read text, make NaN of None, and masked
/// values are no values.
fn check_real(given: &Bound<'_, PyAny>, name: &str, expected: &str) -> PyResult<()> {
    let numpy = given.py().import("numpy")?;
    if numpy.getattr("ma")?.call_method1("is_masked", (given,))?.is_truthy()? {
        let text =
            format!("{name}: masked values, expected {expected}: fill them, as by .filled(0)");
        return Err(PyValueError::new_err(text));
    }
    let array = numpy.call_method1("asarray", (given,));
    let kind = array.and_then(|a| a.getattr("dtype")?.getattr("kind")?.extract::<String>());
    match kind {
        Ok(kind) if ["b", "i", "u", "f"].contains(&kind.as_str()) => Ok(()),
        _ => Err(misfit(given, name, expected)),
    }
}

fn misfit(given: &Bound<'_, PyAny>, name: &str, expected: &str) -> PyErr {
    let shape = given.getattr("shape").and_then(|shape| Ok(shape.str()?.to_string()));
    match (shape, given.len()) {
        (Ok(shape), _) => {
            let kind = given.getattr("dtype").map(|kind| format!(" of {kind}")).unwrap_or_default();
            let text =
                format!("{name}: an array{kind} with the shape {shape}, expected {expected}");
            PyValueError::new_err(text)
        }
        (_, Ok(items)) if !given.is_instance_of::<pyo3::types::PyString>() => {
            PyValueError::new_err(format!("{name}: {items} items, expected {expected}"))
        }
        _ => {
            let kind = given.get_type().name().map(|name| name.to_string()).unwrap_or_default();
            PyTypeError::new_err(format!("{name}: {kind}, expected {expected}"))
        }
    }
}
