//! Where plugins are found: by path, or by name along a list of directories.

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use super::HostLaw;
use super::error::{KineticsError, nearest};

/// The environment variable with further directories, separated as in `PATH`.
pub const PATH_VARIABLE: &str = "RUMPLE_PLUGIN_PATH";

/// Where an installed program keeps its plugins, from the folder above that of the program: `bin/rumple` finds
/// those in `lib/rumple/plugins`.
pub const INSTALLED: &str = "lib/rumple/plugins";

/// The directories in which a plugin is looked up by name, in order; and the law of the host program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PluginSearch {
    directories: Vec<PathBuf>,
    host_law: Option<HostLaw>,
}

impl PluginSearch {
    /// These directories and no others.
    #[must_use]
    pub fn in_directories(directories: Vec<PathBuf>) -> Self {
        Self { directories, host_law: None }
    }

    /// With the law `host_law`: that of a table which names it as its plugin, or of the scene besides its others.
    #[must_use]
    pub fn with_law(self, host_law: Option<HostLaw>) -> Self {
        Self { host_law, ..self }
    }

    /// The law of the host program.
    #[must_use]
    pub fn host_law(&self) -> Option<&HostLaw> {
        self.host_law.as_ref()
    }

    /// The same, if `plugin` is its name.
    #[must_use]
    pub fn host_law_named(&self, plugin: &str) -> Option<&HostLaw> {
        self.host_law().filter(|law| law.name() == plugin)
    }

    /// The explicit directories first, then those of [`PATH_VARIABLE`], then the executable's own, then
    /// [`INSTALLED`] beside that, where it exists.
    #[must_use]
    pub fn from_environment(explicit: &[PathBuf]) -> Self {
        let mut directories = explicit.to_vec();
        if let Some(paths) = env::var_os(PATH_VARIABLE) {
            directories
                .extend(env::split_paths(&paths).filter(|path| !path.as_os_str().is_empty()));
        }
        if let Ok(executable) = env::current_exe() {
            let own = executable.parent().map(Path::to_owned);
            let installed = own.as_deref().and_then(Path::parent).map(|root| root.join(INSTALLED));
            directories.extend(own);
            directories.extend(installed.filter(|directory| directory.is_dir()));
        }
        // A plugin may change the working directory before the next is looked up.
        for directory in &mut directories {
            if let Ok(full) = std::path::absolute(&directory) {
                *directory = full;
            }
        }
        Self { directories, host_law: None }
    }

    /// The same, which looks in `directory` last.
    #[must_use]
    pub fn then_in(mut self, directory: &Path) -> Self {
        self.directories.push(directory.to_owned());
        self
    }

    /// The directories, in order.
    #[must_use]
    pub fn directories(&self) -> &[PathBuf] {
        &self.directories
    }

    /// The file of a plugin: `plugin` is a path (relative to `scene_directory`) if it has a
    /// directory part or the ending of a shared library, else a name.
    ///
    /// # Errors
    /// [`KineticsError::MissingFile`] or [`KineticsError::Folder`] for a path;
    /// [`KineticsError::NotFound`] for a name, with the names that there are.
    pub fn resolve(&self, plugin: &str, scene_directory: &Path) -> Result<PathBuf, KineticsError> {
        if is_path(plugin) {
            let path = scene_directory.join(plugin);
            return if path.is_file() { Ok(path) } else { Err(no_file(path)) };
        }
        let file = file_name(plugin);
        self.directories
            .iter()
            .map(|directory| directory.join(&file))
            .find(|path| path.is_file())
            .ok_or_else(|| {
                let own = self.host_law().map(|law| law.name().to_owned());
                let found: Vec<String> =
                    own.into_iter().chain(self.list().into_iter().map(|(name, _)| name)).collect();
                KineticsError::NotFound {
                    name: plugin.to_owned(),
                    nearest: nearest(plugin, found.iter().map(String::as_str)),
                    found,
                    searched: self
                        .directories
                        .iter()
                        .map(|path| path.display().to_string())
                        .collect(),
                }
            })
    }

    /// Names and files of all plugins in the directories, sorted; where a name occurs twice, the
    /// one that [`resolve`](Self::resolve) takes. Files are read, not loaded: one counts as a plugin if it has
    /// the entry symbol.
    #[must_use]
    pub fn list(&self) -> Vec<(String, PathBuf)> {
        let mut found: Vec<(String, PathBuf)> = Vec::new();
        for directory in &self.directories {
            let Ok(entries) = fs::read_dir(directory) else { continue };
            for path in entries.flatten().map(|entry| entry.path()) {
                if let Some(name) = plugin_name(&path)
                    && !found.iter().any(|(known, _)| *known == name)
                    && has_entry(&path)
                {
                    found.push((name, path));
                }
            }
        }
        found.sort();
        found
    }
}

/// What is wrong with the path of a plugin that is not a file.
pub(super) fn no_file(path: PathBuf) -> KineticsError {
    if !path.is_dir() {
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let here = if folder.as_os_str().is_empty() { PathBuf::from(".") } else { folder };
        let there = PluginSearch::in_directories(vec![here]).list();
        let stem = || path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let near = nearest(
            &plugin_name(&path).unwrap_or_else(stem),
            there.iter().map(|(name, _)| name.as_str()),
        );
        let file = near.and_then(|near| there.iter().find(|(name, _)| *name == near));
        let nearest = file.map(|(_, file)| file.display().to_string());
        return KineticsError::MissingFile { path, nearest };
    }
    let built = path.join("target").join("release");
    let libraries = PluginSearch::in_directories(vec![path.clone(), built]).list();
    let libraries = libraries.into_iter().map(|(_, library)| library).collect();
    KineticsError::Folder { path, libraries }
}

/// The file name of a plugin on this system, for example `libcurvature_feedback.so`.
#[must_use]
pub fn file_name(plugin: &str) -> String {
    let stem = plugin.replace('-', "_");
    format!("{}{stem}{}", env::consts::DLL_PREFIX, env::consts::DLL_SUFFIX)
}

/// Whether `plugin` is the path of a library, not a name to look up.
#[must_use]
pub fn is_path(plugin: &str) -> bool {
    plugin.contains(['/', '\\']) || plugin.ends_with(env::consts::DLL_SUFFIX)
}

fn plugin_name(path: &Path) -> Option<String> {
    let file = path.file_name()?.to_str()?;
    let stem = file.strip_prefix(env::consts::DLL_PREFIX)?.strip_suffix(env::consts::DLL_SUFFIX)?;
    (!stem.is_empty()).then(|| stem.replace('_', "-"))
}

/// Whether a library has the entry symbol, in a table of names that end with a zero byte; texts of the engine do not.
fn has_entry(path: &Path) -> bool {
    let symbol = format!("{}\0", rumple_plugin_abi::ENTRY_SYMBOL);
    let symbol = symbol.as_bytes();
    fs::read(path).is_ok_and(|bytes| bytes.windows(symbol.len()).any(|part| part == symbol))
}
