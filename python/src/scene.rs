//! Scenes.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rumple::kinetics::HostLaw;
use rumple::study::gradient::SceneSource;

use crate::engine::{Error, Slot};
use crate::law::Law;
use crate::{engine, overrides};

/// A checked scene.
#[pyclass(module = "rumple", frozen)]
pub(crate) struct Scene {
    pub(crate) checked: Arc<rumple::scene::Scene>,
    /// The overrides that it was read with.
    pub(crate) set: Vec<String>,
    /// The text that it was parsed from; none of a file.
    text: Option<String>,
    law: Option<Py<Law>>,
}

impl Scene {
    /// Where it is read from, and its overrides.
    pub(crate) fn source(&self) -> (SceneSource, Vec<String>) {
        let source = match &self.text {
            None => SceneSource::File(self.checked.file().to_owned()),
            Some(text) => {
                SceneSource::Text { text: text.clone(), name: self.checked.name().to_owned() }
            }
        };
        (source, self.set.clone())
    }

    /// The file that it was read from, which a study reads again.
    pub(crate) fn file(&self) -> rumple::Result<&Path> {
        let file = self.checked.file();
        match file.as_os_str().is_empty() {
            false => Ok(file),
            true => Err(rumple::Error::Refused(format!(
                "the scene {:?} was parsed from text, and a study reads a file",
                self.checked.name()
            ))),
        }
    }

    /// The law in Python that goes with it, `law` if that is given, which leaves its exceptions in `raised`.
    pub(crate) fn host_law(&self, law: Option<&Law>, raised: &Slot) -> Option<HostLaw> {
        law.or(self.law.as_ref().map(Py::get)).map(|law| law.host_law(raised))
    }
}

#[pymethods]
impl Scene {
    /// Path of its file, or the name that it was parsed with.
    #[getter]
    fn name(&self) -> &str {
        self.checked.name()
    }

    /// Path of its file; None of a scene that was parsed.
    #[getter]
    fn path(&self) -> Option<&Path> {
        Some(self.checked.file()).filter(|file| !file.as_os_str().is_empty())
    }

    /// The law in Python that goes with it.
    #[getter]
    fn law(&self, py: Python<'_>) -> Option<Py<Law>> {
        self.law.as_ref().map(|law| law.clone_ref(py))
    }

    /// The scene with another law in Python.
    fn with_law(&self, py: Python<'_>, law: Option<Py<Law>>) -> Self {
        let Self { checked, set, text, .. } = self.copy(py);
        Self { checked, set, text, law }
    }

    /// The scene with more overrides.
    fn varied(&self, py: Python<'_>, overrides: &Bound<'_, PyAny>) -> PyResult<Self> {
        let set = [self.set.clone(), overrides::texts(Some(overrides))?].concat();
        let checked = engine::call(py, || {
            Ok(Arc::new(match &self.text {
                None => rumple::scene::Scene::load(self.checked.file(), &set)?,
                Some(text) => rumple::scene::Scene::parse(text, self.checked.name(), &set)?,
            }))
        })?;
        Ok(Self { checked, set, ..self.copy(py) })
    }

    /// Text and overrides of a scene that was parsed.
    fn _parsed(&self) -> (Option<&str>, Vec<String>) {
        (self.text.as_deref(), self.set.clone())
    }

    /// Key paths of the files that it names.
    fn _files(&self) -> Vec<String> {
        self.checked.files().into_iter().map(|(key, _)| key).collect()
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

    /// The resolved scene, folded, as a notebook shows it.
    fn _repr_html_(&self, py: Python<'_>) -> PyResult<String> {
        let escaped = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;");
        let text = escaped(&self.resolved(py)?);
        let name = escaped(self.checked.name());
        Ok(format!("<details><summary>scene {name}</summary><pre>{text}</pre></details>"))
    }

    fn __repr__(&self) -> String {
        format!("<rumple.Scene {}>", self.checked.name())
    }
}

impl Scene {
    fn copy(&self, py: Python<'_>) -> Self {
        Self {
            checked: Arc::clone(&self.checked),
            set: self.set.clone(),
            text: self.text.clone(),
            law: self.law(py),
        }
    }
}

/// A scene, or the path of its file.
pub(crate) enum SceneOrFile<'py> {
    Scene(Bound<'py, Scene>),
    File(PathBuf),
}

impl<'a, 'py> FromPyObject<'a, 'py> for SceneOrFile<'py> {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(scene) = given.cast::<Scene>() {
            return Ok(Self::Scene(scene.to_owned()));
        }
        let file = given.extract().map(Self::File);
        file.map_err(|_| {
            let kind = given.get_type().name().map(|name| name.to_string()).unwrap_or_default();
            let text = format!(
                "{kind}, expected a scene or the path of its file; rumple.scene(sheet={{…}}, …) makes one of tables"
            );
            PyTypeError::new_err(text)
        })
    }
}

impl<'py> SceneOrFile<'py> {
    pub(crate) fn checked(self, py: Python<'py>) -> PyResult<Bound<'py, Scene>> {
        match self {
            Self::Scene(scene) => Ok(scene),
            Self::File(path) => Bound::new(py, load(py, path, None, None)?),
        }
    }
}

/// Tables of a scene as TOML.
#[pyfunction]
pub(crate) fn tables_as_toml(tables: &Bound<'_, PyDict>) -> PyResult<String> {
    let table = overrides::toml_of(tables)?;
    toml::to_string(&table).map_err(|error| Error::new_err(error.to_string()))
}

/// Reads and checks the scene file at `path`, after the overrides.
#[pyfunction]
#[pyo3(signature = (path, overrides = None, *, law = None))]
pub(crate) fn load(
    py: Python<'_>,
    path: PathBuf,
    overrides: Option<&Bound<'_, PyAny>>,
    law: Option<Py<Law>>,
) -> PyResult<Scene> {
    let texts = overrides::texts(overrides)?;
    let scene = engine::call(py, || Ok(rumple::scene::Scene::load(&path, &texts)?))?;
    Ok(Scene { checked: Arc::new(scene), set: texts, text: None, law })
}

/// Checks the scene `text`, after the overrides.
#[pyfunction]
#[pyo3(signature = (text, overrides = None, name = "scene", *, law = None))]
pub(crate) fn parse(
    py: Python<'_>,
    text: &str,
    overrides: Option<&Bound<'_, PyAny>>,
    name: &str,
    law: Option<Py<Law>>,
) -> PyResult<Scene> {
    let texts = overrides::texts(overrides)?;
    let scene = engine::call(py, || Ok(rumple::scene::Scene::parse(text, name, &texts)?))?;
    Ok(Scene { checked: Arc::new(scene), set: texts, text: Some(text.to_owned()), law })
}
