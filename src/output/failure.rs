//! The folder that a run leaves where it failed.
//!
//! ```text
//! DIR/failure/report.md      what failed, where, and what to try
//! DIR/failure/ledger.csv     the last steps, and the rejected step attempts
//! DIR/failure/state.vtu      the last good state, with what acts on it
//! ```
//!
//! It is built aside and takes its name by a rename: a reader sees all of it or nothing.

use std::fs;
use std::path::{Path, PathBuf};

use super::{OutputError, ResultDirectory};

/// The files in it.
const FILES: [&str; 3] = ["report.md", "ledger.csv", "state.vtu"];
/// Its name while it is built.
const PARTIAL_NAME: &str = ".failure.part";

impl ResultDirectory {
    /// Name of the folder of a run that failed.
    pub const FAILURE: &'static str = "failure";

    /// The folder of a run that failed.
    #[must_use]
    pub fn failure(&self) -> PathBuf {
        self.root().join(Self::FAILURE)
    }

    /// Removes that folder; whatever a run does not write stays, and then the folder does.
    ///
    /// # Errors
    /// [`OutputError::Write`] from the operating system.
    pub(crate) fn forget_failure(&self) -> Result<(), OutputError> {
        for folder in [self.failure(), self.root().join(PARTIAL_NAME)] {
            // Nothing is removed through a link.
            if is_folder(&folder) {
                super::directory::remove_all(FILES.map(|name| folder.join(name)).to_vec())?;
                let _ = fs::remove_dir(folder);
            }
        }
        Ok(())
    }
}

/// The folder while it is built; dropped unfinished it leaves nothing.
pub struct FailureFolder {
    directory: ResultDirectory,
    part: PathBuf,
}

impl FailureFolder {
    /// Begins one in `directory`, in place of an old one.
    ///
    /// # Errors
    /// [`OutputError::Write`] from the operating system.
    pub fn begin(directory: &ResultDirectory) -> Result<Self, OutputError> {
        directory.forget_failure()?;
        let part = directory.root().join(PARTIAL_NAME);
        fs::create_dir_all(&part).map_err(OutputError::write(&part))?;
        Ok(Self { directory: directory.clone(), part })
    }

    /// Where the file `name` is built, and where it will be.
    #[must_use]
    pub fn file(&self, name: &str) -> (PathBuf, PathBuf) {
        (self.part.join(name), self.directory.failure().join(name))
    }

    /// Gives it its name, which is returned.
    ///
    /// # Errors
    /// [`OutputError::Write`] from the operating system, as where something that no run writes is in the way.
    pub fn finish(self) -> Result<PathBuf, OutputError> {
        let path = self.directory.failure();
        fs::rename(&self.part, &path).map_err(OutputError::write(&path))?;
        Ok(path)
    }
}

impl Drop for FailureFolder {
    fn drop(&mut self) {
        if is_folder(&self.part) {
            let _ = super::directory::remove_all(FILES.map(|name| self.part.join(name)).to_vec());
            let _ = fs::remove_dir(&self.part);
        }
    }
}

fn is_folder(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|found| found.is_dir())
}
