//! Members taken over from another sweep, so that they are not made again.

use std::fs;
use std::path::{Path, PathBuf};

use super::member::{MemberStatus, status};
use super::plan::Plan;
use crate::output::{Claim, OutputError};
use crate::run::{Error, Result};

impl Plan {
    /// The member of the sweep in `other` that is complete and is run `number` of this one, if there is one.
    ///
    /// # Errors
    /// It has one of the same name and another scene.
    pub fn made_in(&self, number: usize, other: &Path) -> Result<Option<PathBuf>> {
        let Some(theirs) = Self::read(other)? else { return Ok(None) };
        let point = &self.members[number];
        let same = theirs.members.iter().position(|m| m.fingerprint == point.fingerprint);
        if let Some(same) = same {
            let from = theirs.directory(other, same);
            return Ok((status(&theirs, &from).0 == MemberStatus::Complete).then_some(from));
        }
        if theirs.members.iter().any(|m| m.folder == point.folder) {
            let what = self.difference(number, other)?;
            let message = format!("{}: has references of another scene: {what}", other.display());
            return Err(Error::Refused(message));
        }
        Ok(None)
    }

    /// Takes member `number` over from the sweep in `other`, if it was [made in](Self::made_in) that.
    ///
    /// # Errors
    /// It has one of the same name and another scene; a file that cannot be copied.
    pub fn adopt(&self, number: usize, root: &Path, other: &Path) -> Result<()> {
        let to = self.directory(root, number);
        match self.made_in(number, other)? {
            Some(from) if status(self, &to).0 != MemberStatus::Complete => copy(&from, &to),
            _ => Ok(()),
        }
    }
}

/// Copies a folder, what says how it stands last.
fn copy(from: &Path, to: &Path) -> Result<()> {
    let read = |source| OutputError::Read { path: from.to_owned(), source };
    let write = |source| OutputError::Write { path: to.to_owned(), source };
    fs::create_dir_all(to).map_err(write)?;
    let mut last = None;
    for entry in fs::read_dir(from).map_err(read)? {
        let entry = entry.map_err(read)?;
        let (path, target) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() {
            copy(&path, &target)?;
        } else if entry.file_name() == Claim::STATUS {
            last = Some((path, target));
        } else {
            fs::copy(&path, &target).map_err(write)?;
        }
    }
    if let Some((path, target)) = last {
        fs::copy(&path, &target).map_err(write)?;
    }
    Ok(())
}
