//! One result in a file that the user names, or on standard output.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use super::{Inputs, OutputError, atomic};

/// Where one result goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ResultFile {
    /// `-`.
    StandardOutput,
    /// A file.
    File {
        /// Its full path.
        path: PathBuf,
        /// Whether a file that is there may be replaced.
        force: bool,
    },
}

impl ResultFile {
    /// The file that `path` names, or standard output for `-`; asked for before any work is done.
    ///
    /// # Errors
    /// [`OutputError::Refused`] for one of the `inputs`, for a directory, for a file in a directory
    /// that does not exist, and without `force` for a file that exists.
    pub fn new(path: &Path, force: bool, inputs: &Inputs) -> Result<Self, OutputError> {
        if path == Path::new("-") {
            return Ok(Self::StandardOutput);
        }
        let refuse = |message: &str| {
            Err(OutputError::Refused { path: path.to_owned(), message: message.to_owned() })
        };
        inputs.check_not_input(path)?;
        let full = std::path::absolute(path).map_err(OutputError::write(path))?;
        if full.is_dir() {
            return refuse("it is a directory, expected the name of a file");
        }
        if let Some(parent) = full.parent()
            && !parent.is_dir()
        {
            return refuse(&format!("no directory {}", parent.display()));
        }
        let there = fs::symlink_metadata(&full).is_ok();
        if there && !force && !atomic::is_device(&full) {
            return refuse("it exists already; choose another, or give --force to replace it");
        }
        Ok(Self::File { path: full, force })
    }

    /// Checks that it is none of the `inputs`, which may be known only later.
    ///
    /// # Errors
    /// [`OutputError::Refused`] for one of them.
    pub fn check_inputs(&self, inputs: &Inputs) -> Result<(), OutputError> {
        match self {
            Self::StandardOutput => Ok(()),
            Self::File { path, .. } => inputs.check_not_input(path),
        }
    }

    /// Writes what `fill` writes, whole or not at all.
    ///
    /// # Errors
    /// [`OutputError::Write`] if the operating system refuses, or if the file has come to exist
    /// meanwhile and may not be replaced.
    pub fn write(
        &self,
        fill: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
    ) -> Result<(), OutputError> {
        match self {
            Self::StandardOutput => {
                let mut out = std::io::stdout().lock();
                match fill(&mut out).and_then(|()| out.flush()) {
                    // A closed pipe is not a failure.
                    Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => {
                        Err(OutputError::write(Path::new("standard output"))(e))
                    }
                    _ => Ok(()),
                }
            }
            Self::File { path, force: true } => atomic::replace(path, fill),
            Self::File { path, force: false } => atomic::create(path, fill),
        }
    }
}
