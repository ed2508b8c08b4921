//! Where plugins are looked for.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use rumple::kinetics::PluginSearch;

/// The folder of the package that has the plugins that ship with it.
static SHIPPED: OnceLock<PathBuf> = OnceLock::new();

/// Remembers where the package is that the module is loaded into.
pub(crate) fn remember_package(py: Python<'_>) -> PyResult<()> {
    let folders = py.import("sys")?.getattr("modules")?.get_item("rumple");
    if let Ok(package) = folders
        && let Ok(folder) = package.getattr("__path__")?.get_item(0)
    {
        SHIPPED.get_or_init(|| folder.extract::<PathBuf>().unwrap_or_default().join("plugins"));
    }
    Ok(())
}

/// Folders in which plugins are looked for first: a path, or several.
#[derive(Clone)]
pub(crate) struct Plugins(Vec<PathBuf>);

impl Plugins {
    /// Where plugins are looked for: there, in the environment's folders, and in that of the package.
    pub(crate) fn search(given: Option<&Self>) -> PluginSearch {
        let search = PluginSearch::from_environment(given.map_or(&[], |plugins| &plugins.0));
        match SHIPPED.get().map(PathBuf::as_path).filter(|folder: &&Path| folder.is_dir()) {
            Some(folder) => search.then_in(folder),
            None => search,
        }
    }
}

impl<'a, 'py> FromPyObject<'a, 'py> for Plugins {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(one) = given.extract::<PathBuf>() {
            return Ok(Self(vec![one]));
        }
        let text = "plugins: expected a folder, or a list of folders";
        given.extract().map(Self).map_err(|_| PyTypeError::new_err(text))
    }
}
