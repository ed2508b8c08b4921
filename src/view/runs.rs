//! Which runs a result directory holds: one, or the members of a study in their order.

use std::path::{Path, PathBuf};

use crate::output::{OutputError, ResultDirectory};
use crate::run::{Error, Result};
use crate::study::plan::Plan;

/// The runs of a directory.
#[derive(Debug)]
pub(super) struct FoundRuns {
    /// Names and directories.
    pub(super) runs: Vec<(String, PathBuf)>,
    /// Whether they are the members of a study.
    pub(super) study: bool,
}

/// Finds the runs in `root`.
///
/// # Errors
/// [`Error::Refused`] where there are none; a plan that cannot be read.
pub(super) fn find(root: &Path) -> Result<FoundRuns> {
    let refuse = |what: &str| Err(Error::Refused(format!("{}: {what}", root.display())));
    if !root.is_dir() {
        return refuse(
            "no such directory; expected one that run, sweep, compare or accuracy wrote",
        );
    }
    if is_run(root) {
        return Ok(FoundRuns { runs: vec![(name_of(root), root.to_owned())], study: false });
    }
    if let Some(plan) = Plan::read(root)? {
        let member = |k: usize| (plan.members[k].folder.clone(), plan.directory(root, k));
        return Ok(FoundRuns { runs: (0..plan.members.len()).map(member).collect(), study: true });
    }
    let entries = std::fs::read_dir(root).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
    let entries = entries.map_err(OutputError::read(root))?;
    let mut folders: Vec<PathBuf> = entries.iter().map(std::fs::DirEntry::path).collect();
    folders.retain(|path| path.is_dir() && is_run(path));
    folders.sort();
    if folders.is_empty() {
        return refuse(
            "no resolved.toml, in it or in a folder of it: expected a directory that run, sweep, compare or \
             accuracy wrote",
        );
    }
    let runs = folders.into_iter().map(|path| (name_of(&path), path)).collect();
    Ok(FoundRuns { runs, study: true })
}

fn is_run(directory: &Path) -> bool {
    ResultDirectory::resolved_in(directory).is_file()
}

/// The name of the directory `path`.
pub(super) fn name_of(path: &Path) -> String {
    let full = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    full.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
