//! Arguments of every command that takes a scene.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::Result;
use crate::kinetics::PluginSearch;
use crate::output::OutputError;
use crate::scene::Scene;

/// Bytes of stack of a thread: what the main one has elsewhere.
pub(super) const STACK_BYTES: usize = 8 << 20;

/// What every command that takes a scene takes.
#[derive(Debug, Clone, Args)]
pub(super) struct SceneArgs {
    /// The scene file.
    pub(super) scene: PathBuf,
    /// Override a key of the scene, as in `--set time.until=100`; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(super) overrides: Vec<String>,
    /// Directory to look for plugins in, before RUMPLE_PLUGIN_PATH and the program's own
    /// directory; may be repeated.
    #[arg(long = "plugin-path", value_name = "DIR")]
    pub(super) plugin_path: Vec<PathBuf>,
    /// Threads to compute with; all cores by default, for a member of a sweep 1. Results do not depend on
    /// it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) threads: Option<u16>,
}

impl SceneArgs {
    /// Sets up the threads.
    pub(super) fn set_threads(&self) {
        set_threads(self.threads);
    }

    /// Sets up the threads and does `work` on one of them: parallel loops begin there at once, where another
    /// thread would have to wake them and to wait.
    pub(super) fn with_threads<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.set_threads();
        rayon::scope(|_| work())
    }

    /// Sets up the threads and reads the scene.
    pub(super) fn load(&self) -> Result<(Scene, PluginSearch)> {
        self.set_threads();
        let scene = Scene::load(&self.scene, &self.overrides)?;
        Ok((scene, super::defaults().search(&self.plugin_path)))
    }
}

/// Sets up the threads, as many as there are cores if no number is given.
pub(super) fn set_threads(threads: Option<u16>) {
    // Only fails if a pool exists already, which then serves as well.
    let threads = threads.or(super::defaults().threads()).map_or(0, usize::from);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).stack_size(STACK_BYTES);
    let _ = pool.build_global();
}

/// A path that does not depend on the working directory.
pub(super) fn absolute(path: &Path) -> Result<PathBuf> {
    std::path::absolute(path)
        .map_err(|source| OutputError::Read { path: path.to_owned(), source }.into())
}

/// A number of the command line that is finite.
pub(super) fn finite(text: &str) -> std::result::Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "is not a number".to_owned())?;
    number.is_finite().then_some(number).ok_or_else(|| "is not finite".to_owned())
}
