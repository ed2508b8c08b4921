//! The directory of a comparison: one folder a member, a table, plots and pictures.

use std::fs;
use std::path::Path;

use crate::cli::remove_run;
use crate::output::{Claim, OutputError};

pub(super) const TABLE: &str = "compare.csv";
/// Name of the plots, as SVG and as PNG.
pub(super) const PLOTS: &str = "compare";
pub(super) const PICTURES: &str = "pictures.png";

/// Makes room in `root`, and the directory where there is none: what a comparison would write over
/// is refused, or removed with `force`. Whatever else is there stays.
pub(super) fn make(root: &Path, force: bool) -> Result<Claim, OutputError> {
    check(root, force)?;
    fs::create_dir_all(root).map_err(OutputError::write(root))?;
    let claim = Claim::take(root)?;
    // Another comparison may have been there until just now.
    for name in check(root, force)? {
        let path = root.join(&name);
        match is_member(&path) {
            true => remove_run(&path)?,
            false => fs::remove_file(&path).map_err(OutputError::write(&path))?,
        }
    }
    claim.begin()?;
    Ok(claim)
}

/// The names in `root` of what a comparison writes.
fn check(root: &Path, force: bool) -> Result<Vec<String>, OutputError> {
    let refuse = |message: String| Err(OutputError::Directory { path: root.to_owned(), message });
    let Ok(found) = fs::symlink_metadata(root) else { return Ok(Vec::new()) };
    if !root.is_dir() {
        return refuse("is a file, expected a directory or an unused name".into());
    }
    let entries = fs::read_dir(root).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
    let names = entries.map_err(OutputError::read(root))?.into_iter().map(|e| e.file_name());
    let names = names.map(|name| name.to_string_lossy().into_owned());
    let written = [TABLE, "compare.svg", "compare.png", PICTURES, Claim::STATUS];
    let ours = |name: &String| written.contains(&name.as_str()) || is_member(&root.join(name));
    let mut ours: Vec<String> = names.filter(ours).collect();
    // Members first.
    ours.sort();
    let Some(first) = ours.first() else { return Ok(ours) };
    if !force {
        let member = is_member(&root.join(first));
        let what = if member { "an earlier comparison".into() } else { format!("`{first}`") };
        return refuse(format!(
            "it holds {what}: choose another with --out, or --force to replace it"
        ));
    }
    if found.is_symlink() {
        return refuse(
            "is a link, and nothing is removed through a link; give the directory itself".into(),
        );
    }
    let link = |name: &&String| is_member(&root.join(name)) && root.join(name).is_symlink();
    if let Some(name) = ours.iter().find(link) {
        return refuse(format!("`{name}` in it is a link, which is not followed"));
    }
    Ok(ours)
}

/// Whether a folder is that of a member: `1-quasi-static-staggered`, with a run in it.
fn is_member(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let number = name.split('-').next().unwrap_or_default();
    !number.is_empty()
        && number.chars().all(|c| c.is_ascii_digit())
        && name.contains('-')
        && ["ledger.csv", Claim::STATUS].iter().any(|file| path.join(file).is_file())
}
