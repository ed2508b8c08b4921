//! Overrides of a scene from Python: a mapping of key paths to values, or texts as after `--set`.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};

/// The overrides as texts `key.path=value`.
pub(crate) fn texts(overrides: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<String>> {
    let Some(overrides) = overrides else { return Ok(Vec::new()) };
    let Ok(table) = overrides.cast::<PyDict>() else {
        return overrides.extract().map_err(|_| {
            PyTypeError::new_err(
                "overrides are a dict of key paths and values, or a list of texts \"key.path=value\"",
            )
        });
    };
    let text = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let key = key.extract::<String>()?;
        let value = toml_of(&value)
            .map_err(|error| PyTypeError::new_err(format!("{key}: {}", error.value(value.py()))))?;
        Ok(format!("{key}={value}"))
    };
    table.iter().map(text).collect()
}

/// Keys and the values that they take in a study, as texts `key.path=values`: a text is taken verbatim, of a list every
/// item is a value.
pub(crate) fn axes(over: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<String>> {
    let text = |(key, values): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let values = match values.extract::<String>() {
            Ok(values) => values,
            Err(_) => {
                let items = values.try_iter()?.map(|item| Ok(toml_of(&item?)?.to_string()));
                items.collect::<PyResult<Vec<_>>>()?.join(",")
            }
        };
        Ok(format!("{}={values}", key.extract::<String>()?))
    };
    over.into_iter().flat_map(|over| over.iter()).map(text).collect()
}

/// A value as TOML has it.
pub(crate) fn toml_of(value: &Bound<'_, PyAny>) -> PyResult<toml::Value> {
    if value.is_instance_of::<PyBool>() {
        return Ok(value.extract::<bool>()?.into());
    }
    if value.is_instance_of::<PyInt>() {
        return Ok(value.extract::<i64>()?.into());
    }
    if value.is_instance_of::<PyFloat>() {
        return Ok(value.extract::<f64>()?.into());
    }
    if value.is_instance_of::<PyString>() {
        return Ok(value.extract::<String>()?.into());
    }
    if let Ok(table) = value.cast::<PyDict>() {
        let entry = |(key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
            Ok((key.extract::<String>()?, toml_of(&value)?))
        };
        let entries: PyResult<toml::Table> = table.iter().map(entry).collect();
        return Ok(entries?.into());
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let items: PyResult<Vec<_>> = value.try_iter()?.map(|item| toml_of(&item?)).collect();
        return Ok(items?.into());
    }
    // Paths, NumPy's arrays and its numbers.
    for method in ["__fspath__", "tolist"] {
        if value.hasattr(method)? {
            return toml_of(&value.call_method0(method)?);
        }
    }
    let kind = value.get_type().name()?;
    Err(PyTypeError::new_err(format!("a scene has no values of type {kind}")))
}
