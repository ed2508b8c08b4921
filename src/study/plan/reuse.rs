//! Members of an earlier study that are used again: what has changed since, and imports.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::Plan;
use crate::output::{Claim, OutputError, ResultDirectory};
use crate::run::{Error, Result};
use crate::study::gather::{MemberStatus, status};

impl Plan {
    /// The directory of the complete member of the sweep in `other` that is run `number` of this one, if there is
    /// one.
    ///
    /// # Errors
    /// It has one of the same name and another scene.
    pub fn completed_in(&self, number: usize, other: &Path) -> Result<Option<PathBuf>> {
        let Some(theirs) = Self::read(other)? else { return Ok(None) };
        let point = &self.members[number];
        if let Some(same) = theirs.members.iter().position(|m| m.fingerprint == point.fingerprint) {
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

    /// Imports member `number` from the sweep in `other`, if it is [complete there](Self::completed_in).
    ///
    /// # Errors
    /// It has one of the same name and another scene; a file that cannot be copied.
    pub fn import(&self, number: usize, root: &Path, other: &Path) -> Result<()> {
        let to = self.directory(root, number);
        match self.completed_in(number, other)? {
            Some(from) if status(self, &to).0 != MemberStatus::Complete => copy(&from, &to),
            _ => Ok(()),
        }
    }

    /// Describes the change of a member since it was run by the sweep in `root`.
    pub(super) fn difference(&self, number: usize, root: &Path) -> Result<String> {
        let now = self.scene(number)?.resolved()?;
        let written = ResultDirectory::resolved_in(&self.directory(root, number));
        let then = fs::read_to_string(written).unwrap_or_default();
        let mut pairs = then.lines().zip(now.lines());
        let name = self.name(number);
        if let Some((then, now)) = pairs.find(|(then, now)| then != now) {
            return Ok(format!("the scene has changed: `{then}` for {name}, now `{now}`"));
        }
        let earlier = Self::read(root)?.map_or(BTreeMap::new(), |plan| plan.files);
        Ok(match self.changed_file(number, &earlier)? {
            Some(file) => format!("{} has changed, for {name}", file.display()),
            None if then.is_empty() || then != now => {
                format!("the scene, a file that it names or a plugin has changed, for {name}")
            }
            None => format!("a file that the scene names or a plugin has changed, for {name}"),
        })
    }

    /// The first file of a member whose hash was another one in `earlier`.
    pub(in crate::study) fn changed_file(
        &self,
        number: usize,
        earlier: &BTreeMap<PathBuf, String>,
    ) -> Result<Option<PathBuf>> {
        let mut now = BTreeMap::new();
        self.fingerprint(number, &mut now)?;
        let other = |(file, hash): &(&PathBuf, &String)| {
            earlier.get(*file).is_some_and(|then| then != *hash)
        };
        Ok(now.iter().find(other).map(|(file, _)| file.clone()))
    }
}

/// Copies a folder, its status last.
fn copy(from: &Path, to: &Path) -> Result<()> {
    fs::create_dir_all(to).map_err(OutputError::write(to))?;
    let entries = fs::read_dir(from).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
    let mut entries = entries.map_err(OutputError::read(from))?;
    entries.sort_by_key(|entry| entry.file_name() == Claim::STATUS);
    for path in entries.iter().map(fs::DirEntry::path) {
        let target = to.join(path.file_name().unwrap_or_default());
        if path.is_dir() {
            copy(&path, &target)?;
        } else {
            fs::copy(&path, &target).map_err(OutputError::write(to))?;
        }
    }
    Ok(())
}
