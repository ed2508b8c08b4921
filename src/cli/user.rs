//! Defaults of the user, by a file in the place of variables of the environment.

use std::env;
use std::ffi::OsString;
use std::num::NonZeroU16;
use std::path::PathBuf;

use serde::Deserialize;

use crate::run::{Error, Result};

/// The file `rumple/config.toml` of the user's directory for configuration.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Defaults {
    threads: Option<NonZeroU16>,
    color: Option<Color>,
    plugin_path: Vec<PathBuf>,
    browser: Option<PathBuf>,
    ffmpeg: Option<PathBuf>,
}

#[derive(Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Color {
    Auto,
    Never,
}

impl Defaults {
    /// The variables that have the same meaning.
    fn variables(self) -> Result<Vec<(&'static str, OsString)>> {
        let full = |path: PathBuf| match (path.strip_prefix("~"), env::home_dir()) {
            (Ok(rest), Some(home)) => home.join(rest),
            _ => path,
        };
        let folders = self.plugin_path.into_iter().map(full);
        let folders = env::join_paths(folders)
            .map_err(|error| Error::Refused(format!("plugin_path: {error}")))?;
        let all = [
            ("RAYON_NUM_THREADS", self.threads.map(|threads| threads.to_string().into())),
            ("NO_COLOR", (self.color == Some(Color::Never)).then(|| "1".into())),
            ("RUMPLE_PLUGIN_PATH", Some(folders).filter(|folders| !folders.is_empty())),
            ("RUMPLE_BROWSER", self.browser.map(|program| full(program).into())),
            ("RUMPLE_FFMPEG", self.ffmpeg.map(|program| full(program).into())),
        ];
        let new = |(name, value)| {
            Some((name, Option::<OsString>::filter(value, |_| env::var_os(name).is_none())?))
        };
        Ok(all.into_iter().filter_map(new).collect())
    }
}

/// Starts the program again with the variables that the user's file gives and the environment does not, if there are any.
///
/// # Errors
/// A file that cannot be read, with its line.
#[cfg(unix)]
pub(super) fn apply_defaults() -> Result<()> {
    use std::os::unix::process::CommandExt;

    let folder = env::var_os("XDG_CONFIG_HOME").filter(|folder| !folder.is_empty());
    let folder = folder.map(PathBuf::from).or_else(|| Some(env::home_dir()?.join(".config")));
    let Some(file) = folder.map(|folder| folder.join("rumple/config.toml")) else { return Ok(()) };
    if !file.is_file() {
        return Ok(());
    }
    let refuse = |why: String| Error::Refused(format!("{}: {why}", file.display()));
    let text = std::fs::read_to_string(&file).map_err(|error| refuse(error.to_string()))?;
    let defaults = toml::from_str::<Defaults>(&text).map_err(|error| refuse(error.to_string()))?;
    let variables = defaults.variables()?;
    if variables.is_empty() {
        return Ok(());
    }
    let program = env::current_exe().map_err(|error| refuse(error.to_string()))?;
    let mut again = std::process::Command::new(program);
    let error = again.args(env::args_os().skip(1)).envs(variables).exec();
    Err(refuse(format!("the program cannot be started again: {error}")))
}

#[cfg(not(unix))]
pub(super) fn apply_defaults() -> Result<()> {
    Ok(())
}
