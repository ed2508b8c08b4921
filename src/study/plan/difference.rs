//! Changes of a member since its study was planned or run.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use super::Plan;
use crate::output::ResultDirectory;
use crate::run::Result;

impl Plan {
    /// Describes the change of a member since the sweep in `root` planned or ran it.
    pub(in crate::study) fn difference(&self, number: usize, root: &Path) -> Result<String> {
        let now = self.scene(number)?.resolved()?;
        let written = ResultDirectory::resolved_in(&self.directory(root, number));
        let then = fs::read_to_string(written).unwrap_or_default();
        let mut pairs = then.lines().zip(now.lines());
        let name = self.name(number);
        if let Some((then, now)) = pairs.find(|(then, now)| then != now) {
            return Ok(format!("the scene has changed: `{then}` for {name}, now `{now}`"));
        }
        let earlier = Self::read(root)?.map_or(BTreeMap::new(), |plan| plan.files);
        let mut files = BTreeMap::new();
        self.fingerprint(number, &mut files)?;
        let changed =
            files.iter().find(|(file, hash)| earlier.get(*file).is_some_and(|then| then != *hash));
        let what = "the scene, a file that it names or a plugin".to_owned();
        let what = changed.map_or(what, |(file, _)| file.display().to_string());
        Ok(format!("{what} has changed, for {name}"))
    }
}
