//! Directories of studies: claimed, and emptied of an earlier study that is replaced.

use std::fs;
use std::path::Path;

use crate::output::{Claim, OutputError, ResultDirectory};
use crate::run::Result;

/// Claims the directory `root`, made where there is none, once nothing in it is refused by `check`; what that finds.
pub(crate) fn claim<T>(root: &Path, check: impl Fn() -> Result<T>) -> Result<(Claim, T)> {
    check()?;
    fs::create_dir_all(root).map_err(OutputError::write(root))?;
    let claim = Claim::take(root)?;
    // Another study may have been there until just now.
    Ok((claim, check()?))
}

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

/// Removes the file `path`.
pub(crate) fn remove_file(path: &Path) -> Result<()> {
    Ok(fs::remove_file(path).map_err(OutputError::write(path))?)
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
