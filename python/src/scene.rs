//! Scenes.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::prelude::*;

use crate::{engine, overrides};

/// A checked scene.
#[pyclass(module = "rumple", frozen)]
pub(crate) struct Scene {
    pub(crate) checked: Arc<rumple::scene::Scene>,
    /// The overrides that it was read with.
    pub(crate) set: Vec<String>,
}

impl Scene {
    /// The file that it was read from, which a study reads again.
    pub(crate) fn file(&self) -> rumple::Result<&Path> {
        let file = self.checked.file();
        match file.as_os_str().is_empty() {
            false => Ok(file),
            true => Err(rumple::Error::Refused(format!(
                "the scene {:?} was parsed from text, and a study reads a file: save the text and use \
                 rumple.load",
                self.checked.name()
            ))),
        }
    }
}

#[pymethods]
impl Scene {
    /// Path of its file, or the name that it was parsed with.
    #[getter]
    fn name(&self) -> &str {
        self.checked.name()
    }

    /// Time of the last state.
    #[getter]
    fn until(&self) -> f64 {
        self.checked.time.span.until.get()
    }

    /// The scene as TOML with every default written out.
    fn resolved(&self, py: Python<'_>) -> PyResult<String> {
        engine::call(py, || Ok(self.checked.resolved()?))
    }

    fn __repr__(&self) -> String {
        format!("<rumple.Scene {}>", self.checked.name())
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
    Ok(Scene { checked: Arc::new(scene), set: texts })
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
    Ok(Scene { checked: Arc::new(scene), set: texts })
}
