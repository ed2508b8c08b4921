//! Programs that draw pictures and encode movies: those that the environment or the user names, or those in PATH.

use std::env;
use std::path::{Path, PathBuf};

use crate::run::{Error, Result};

/// Names of browsers that take the options of Chromium.
const BROWSERS: [&str; 7] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
];

/// A program, and what names it, for messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedProgram {
    /// Its path, or its name.
    pub path: PathBuf,
    /// The variable of the environment, or the file and the key.
    pub by: String,
}

/// A browser that draws without a window.
pub(super) fn browser(default: Option<&NamedProgram>) -> Result<PathBuf> {
    if let Some(named) = named_by("RUMPLE_BROWSER", default)? {
        return Ok(named);
    }
    BROWSERS.iter().find_map(|name| in_path(Path::new(name))).ok_or_else(|| {
        Error::Refused(
            "no browser draws the pictures: install Chromium or Chrome, or name one in RUMPLE_BROWSER; without one, \
             `rumple paraview DIR` writes a macro by which ParaView draws"
                .to_owned(),
        )
    })
}

/// The program that a variable of the environment names, or else `default`.
fn named_by(variable: &str, default: Option<&NamedProgram>) -> Result<Option<PathBuf>> {
    let named = env::var_os(variable).filter(|name| !name.is_empty());
    let named = named.map(|name| NamedProgram { path: name.into(), by: variable.to_owned() });
    let Some(NamedProgram { path, by }) = named.as_ref().or(default) else { return Ok(None) };
    let missing = || {
        let expected = "expected the path of a program, or the name of one that PATH has";
        Error::Refused(format!("{by} = {}: no such program; {expected}", path.display()))
    };
    in_path(path).map(Some).ok_or_else(missing)
}

/// The program of this name.
fn in_path(name: &Path) -> Option<PathBuf> {
    if name.components().count() > 1 {
        return name.is_file().then(|| name.to_owned());
    }
    env::split_paths(&env::var_os("PATH")?)
        .map(|folder| folder.join(name))
        .find(|path| path.is_file())
}

/// The program that encodes movies of this `kind`.
pub(super) fn ffmpeg(kind: &str, default: Option<&NamedProgram>) -> Result<PathBuf> {
    named_by("RUMPLE_FFMPEG", default)?.or_else(|| in_path(Path::new("ffmpeg"))).ok_or_else(|| {
        Error::Refused(format!(
            ".{kind} is encoded by ffmpeg, which is not found: install it, or name it in RUMPLE_FFMPEG; .gif needs none"
        ))
    })
}
