//! A viewer in one HTML file: the frames of a result directory in 3D, its ledger, scene, provenance and costs.
//!
//! ```text
//! page      one HTML file: style and script (src/view/page), data as base64, everything else as JSON
//! picture   PNG and movies, by the page in a browser
//! programs  the browser, and ffmpeg
//! runs      which runs a directory holds: one, or the members of a study
//! sheet     frames of one run: which are shown, positions and fields with 16 bits
//! ledger    columns of the ledger
//! record    scene, warnings, provenance, costs, how to reproduce
//! blocks    bytes that the page holds as base64, each once
//! ```
//!
//! The page needs no network and no other file. Positions are signed 16-bit numbers of a bounding box over all
//! frames, fields unsigned ones of the range of each frame, NaN for what is not finite; the error is at most half a
//! level, 1/131 068 of that range. What the page shows is read from the directory; nothing is evaluated.

mod blocks;
mod ledger;
mod page;
pub mod picture;
mod programs;
mod record;
mod runs;
mod sheet;
pub mod watch;

pub use page::{Options, Page};
pub use programs::NamedProgram;

use std::path::{Path, PathBuf};

use crate::output::{ResultDirectory, atomic};
use crate::run::{Error, Result};

/// Makes the page of the result directory `root`: of `run`, `sweep`, `compare` or `accuracy`.
///
/// # Errors
/// [`Error::Refused`] for a directory without results and for bounds that the first and the last frame exceed,
/// [`Error::Sheet`] and [`Error::Output`] for files that cannot be read or contradict one another, with their names.
pub fn page(root: &Path, options: Options) -> Result<Page> {
    if options.frames < 2 {
        let message =
            format!("{} frames: expected at least 2, the first and the last", options.frames);
        return Err(Error::Refused(message));
    }
    let found = runs::find(root)?;
    page::render(root, &found, options, None)
}

/// Writes the page of `root` beside its results, as [`ResultDirectory::REPORT`], over an earlier one; its path.
///
/// # Errors
/// As [`page`], and a file that cannot be written.
pub fn write_report(root: &Path) -> Result<PathBuf> {
    let page = page(root, Options::default())?;
    let path = root.join(ResultDirectory::REPORT);
    atomic::replace(&path, |writer| writer.write_all(page.html.as_bytes()))?;
    Ok(path)
}

/// Times and files of the frames of the run in `root`, as [`crate::sheet::read::surface`] reads them; none of a directory
/// without any.
///
/// # Errors
/// An index that is not one of a run.
pub fn frames(root: &std::path::Path) -> Result<Vec<(f64, std::path::PathBuf)>> {
    sheet::index(root)
}
