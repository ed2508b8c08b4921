//! The files that a command reads: nothing that it writes may take their place.

use std::fs;
use std::path::{Path, PathBuf};

use super::OutputError;

/// The files that a command reads.
#[derive(Debug, Clone, Default)]
pub struct Inputs {
    /// What each is, and its full path without links.
    files: Vec<(String, PathBuf)>,
}

impl Inputs {
    /// Adds a file; `what` is its role, as in `the scene`.
    pub fn add(&mut self, what: impl Into<String>, path: &Path) {
        // What is not there cannot be overwritten.
        if let Ok(full) = fs::canonicalize(path) {
            self.files.push((what.into(), full));
        }
    }

    /// Checks that none of them lies in `directory`.
    ///
    /// # Errors
    /// [`OutputError::Directory`] with the file and its role.
    pub fn outside(&self, directory: &Path) -> Result<(), OutputError> {
        let Ok(full) = fs::canonicalize(directory) else { return Ok(()) };
        match self.files.iter().find(|(_, file)| file.starts_with(&full)) {
            None => Ok(()),
            Some((what, file)) if *file == full => {
                let message = format!(
                    "it is {what} of this command; choose a directory or an unused name with --out"
                );
                Err(OutputError::Directory { path: directory.to_owned(), message })
            }
            Some((what, file)) => {
                let file = file.strip_prefix(&full).unwrap_or(file).display();
                let message = format!(
                    "`{file}` in it is {what} of this command; choose a directory without inputs \
                     with --out"
                );
                Err(OutputError::Directory { path: directory.to_owned(), message })
            }
        }
    }

    /// Checks that `path` is none of them.
    ///
    /// # Errors
    /// [`OutputError::Refused`] with the file and its role.
    pub(crate) fn check_not_input(&self, path: &Path) -> Result<(), OutputError> {
        let Ok(full) = fs::canonicalize(path) else { return Ok(()) };
        match self.files.iter().find(|(_, file)| *file == full) {
            None => Ok(()),
            Some((what, _)) => {
                let message = format!("it is {what} of this command, which is never overwritten");
                Err(OutputError::Refused { path: path.to_owned(), message })
            }
        }
    }
}
