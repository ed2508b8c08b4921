//! Scenes.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;

use crate::{engine, overrides};

/// A checked scene.
#[pyclass(module = "rumple", frozen)]
pub(crate) struct Scene(pub(crate) Arc<rumple::scene::Scene>);

#[pymethods]
impl Scene {
    /// Path of its file, or the name that it was parsed with.
    #[getter]
    fn name(&self) -> &str {
        self.0.name()
    }

    /// Time of the last state.
    #[getter]
    fn until(&self) -> f64 {
        self.0.time.span.until.get()
    }

    /// The scene as TOML with every default written out.
    fn resolved(&self, py: Python<'_>) -> PyResult<String> {
        engine::call(py, || Ok(self.0.resolved()?))
    }

    fn __repr__(&self) -> String {
        format!("<rumple.Scene {}>", self.0.name())
    }
}

/// Reads and checks the scene file at `path`, after the overrides.
#[pyfunction]
#[pyo3(signature = (path, overrides = None))]
pub(crate) fn load(
    py: Python<'_>,
    path: PathBuf,
    overrides: Option<&Bound<'_, PyAny>>,
) -> PyResult<Scene> {
    let texts = overrides::texts(overrides)?;
    let scene = engine::call(py, || Ok(rumple::scene::Scene::load(&path, &texts)?))?;
    Ok(Scene(Arc::new(scene)))
}

/// Checks the scene `text`, after the overrides.
#[pyfunction]
#[pyo3(signature = (text, overrides = None, name = "scene"))]
pub(crate) fn parse(
    py: Python<'_>,
    text: &str,
    overrides: Option<&Bound<'_, PyAny>>,
    name: &str,
) -> PyResult<Scene> {
    let texts = overrides::texts(overrides)?;
    let scene = engine::call(py, || Ok(rumple::scene::Scene::parse(text, name, &texts)?))?;
    Ok(Scene(Arc::new(scene)))
}
