//! Arguments of every command that takes a law.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;

use crate::Result;
use crate::kinetics::{Kinetics, Library, PluginSearch};
use crate::run::laws;
use crate::scene::Scene;

/// Where to look for plugins.
#[derive(Debug, Args)]
pub(super) struct SearchArgs {
    /// Directory to look for plugins in, before RUMPLE_PLUGIN_PATH and the program's own
    /// directory; may be repeated.
    #[arg(long = "plugin-path", value_name = "DIR")]
    pub(super) plugin_path: Vec<PathBuf>,
}

impl SearchArgs {
    pub(super) fn search(&self) -> PluginSearch {
        crate::cli::defaults().search(&self.plugin_path)
    }
}

/// A law to inspect.
#[derive(Debug, Args)]
pub(super) struct LawArgs {
    /// Name of a plugin, path of its library, or a scene (.toml), whose laws are taken.
    pub(super) law: String,
    #[command(flatten)]
    pub(super) search: SearchArgs,
}

impl LawArgs {
    pub(super) fn find(&self) -> Result<LawSource> {
        let search = self.search.search();
        let path = Path::new(&self.law);
        if path.extension().is_some_and(|ending| ending == "toml") {
            let scene = Scene::load(path, &[])?;
            let (laws, fields) = laws::load_with_parameter_fields(&scene, &search)?;
            return Ok(LawSource::Scene { kinetics: laws.kinetics, fields: fields.at_points });
        }
        let file = search.resolve(&self.law, Path::new(""))?;
        Ok(LawSource::Library(Library::load(&file)?))
    }
}

/// Where a law comes from: a library, or a scene with its plugins and formulas.
pub(super) enum LawSource {
    Library(Arc<Library>),
    Scene {
        kinetics: Arc<dyn Kinetics>,
        /// Where parameters differ over the sheet: one column a parameter.
        fields: Vec<Vec<f64>>,
    },
}
