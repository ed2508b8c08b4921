//! Directories of studies: what is in them, and what is removed.

use std::fs;
use std::path::Path;

use crate::output::{Claim, OutputError, ResultDirectory};
use crate::run::Result;

/// Refuses the directory `root`.
pub(crate) fn refuse<T>(root: &Path, message: impl Into<String>) -> Result<T> {
    Err(OutputError::Directory { path: root.to_owned(), message: message.into() }.into())
}

/// Names of the entries of the directory `root`, sorted; none if it does not exist.
pub(crate) fn names(root: &Path) -> Result<Vec<String>> {
    if fs::symlink_metadata(root).is_err() {
        return Ok(Vec::new());
    }
    if !root.is_dir() {
        return refuse(root, "is a file, expected a directory or an unused name");
    }
    let entries = fs::read_dir(root).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
    let entries = entries.map_err(OutputError::read(root))?.into_iter();
    let mut names: Vec<String> =
        entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    Ok(names)
}

/// Removes what a run wrote into the directory `path`; a folder that holds anything else stays.
pub(crate) fn remove_run(path: &Path) -> Result<()> {
    drop(ResultDirectory::prepare(path, true)?);
    for rest in [Claim::STATUS, Claim::LOCK] {
        let _ = fs::remove_file(path.join(rest));
    }
    let _ = fs::remove_dir(path);
    Ok(())
}
