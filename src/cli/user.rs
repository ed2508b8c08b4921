//! Defaults of the user: `rumple/config.toml` in the directory for configuration.

use std::env;
use std::num::NonZeroU16;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use serde::Deserialize;

use crate::kinetics::PluginSearch;
use crate::kinetics::search::PATH_VARIABLE;
use crate::run::{Error, Result};
use crate::view::NamedProgram;

/// What the file says; variables of the environment and options come first.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct Defaults {
    threads: Option<NonZeroU16>,
    color: Option<Color>,
    plugin_path: Vec<PathBuf>,
    browser: Option<PathBuf>,
    ffmpeg: Option<PathBuf>,
    #[serde(skip)]
    file: PathBuf,
}

#[derive(Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Color {
    Auto,
    Never,
}

static DEFAULTS: OnceLock<Defaults> = OnceLock::new();

/// The defaults that [`load`] has read.
pub(super) fn defaults() -> &'static Defaults {
    DEFAULTS.get_or_init(Defaults::default)
}

/// Reads the file, if there is one.
///
/// # Errors
/// A file that cannot be read, a key or a value that is not known, with the line.
pub(super) fn load() -> Result<()> {
    let folder = env::var_os("XDG_CONFIG_HOME").filter(|folder| !folder.is_empty());
    let folder = folder.map(PathBuf::from).or_else(|| Some(env::home_dir()?.join(".config")));
    let Some(folder) = folder.map(|folder| folder.join("rumple")) else { return Ok(()) };
    let file = folder.join("config.toml");
    if !file.exists() {
        return Ok(());
    }
    let refuse = |why: String| Error::Refused(format!("{}: {}", file.display(), why.trim_end()));
    let text = std::fs::read_to_string(&file).map_err(|error| refuse(error.to_string()))?;
    let mut read: Defaults = toml::from_str(&text).map_err(|error| refuse(error.to_string()))?;
    let programs = read.browser.iter_mut().chain(&mut read.ffmpeg);
    programs.for_each(|program| *program = from_home(program));
    read.plugin_path.iter_mut().for_each(|path| *path = folder.join(from_home(path)));
    DEFAULTS.get_or_init(|| Defaults { file, ..read });
    Ok(())
}

/// The path, with the home directory in place of `~`.
fn from_home(path: &Path) -> PathBuf {
    let home = path.strip_prefix("~").ok().and_then(|rest| Some(env::home_dir()?.join(rest)));
    home.unwrap_or_else(|| path.to_owned())
}

impl Defaults {
    /// Threads, unless the environment has their number.
    pub(super) fn threads(&self) -> Option<u16> {
        let threads = self.threads.filter(|_| env::var_os("RAYON_NUM_THREADS").is_none());
        threads.map(NonZeroU16::get)
    }

    /// Whether messages have no colours.
    pub(super) fn plain(&self) -> bool {
        self.color == Some(Color::Never)
    }

    /// Where plugins are looked for: in the directories `given`, then in those of the environment or, without, of the file.
    pub(super) fn search(&self, given: &[PathBuf]) -> PluginSearch {
        let more = match env::var_os(PATH_VARIABLE) {
            None => &self.plugin_path[..],
            Some(_) => &[],
        };
        PluginSearch::from_environment(&[given, more].concat())
    }

    /// The browser and ffmpeg.
    pub(super) fn programs(&self) -> [Option<NamedProgram>; 2] {
        [("browser", &self.browser), ("ffmpeg", &self.ffmpeg)].map(|(key, path)| {
            let by = format!("{}: {key}", self.file.display());
            path.clone().map(|path| NamedProgram { path, by })
        })
    }
}
