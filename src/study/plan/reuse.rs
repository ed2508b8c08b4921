//! Changes of a member since an earlier study.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use super::Plan;
use crate::output::ResultDirectory;
use crate::run::Result;

impl Plan {
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
