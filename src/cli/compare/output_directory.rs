//! The directory of a comparison: one folder a member, a table, plots and pictures.

use std::path::Path;

use crate::cli::output_directory::{claim, names, refuse, remove_file, remove_run};
use crate::output::Claim;
use crate::run::Result;

pub(super) const TABLE: &str = "compare.csv";
/// Name of the plots, as SVG and as PNG.
pub(super) const PLOTS: &str = "compare";
pub(super) const PICTURES: &str = "pictures.png";

/// Makes room in `root`, and the directory where there is none: what a comparison would write over
/// is refused, or removed with `force`. Whatever else is there stays.
pub(super) fn make(root: &Path, force: bool) -> Result<Claim> {
    let (claim, ours) = claim(root, || check(root, force))?;
    for path in ours.iter().map(|name| root.join(name)) {
        if is_member(&path) { remove_run(&path)? } else { remove_file(&path)? }
    }
    claim.begin()?;
    Ok(claim)
}

/// The names in `root` of what a comparison writes, members first.
fn check(root: &Path, force: bool) -> Result<Vec<String>> {
    let written = [TABLE, "compare.svg", "compare.png", PICTURES, Claim::STATUS];
    let ours = |name: &String| written.contains(&name.as_str()) || is_member(&root.join(name));
    let ours: Vec<String> = names(root)?.into_iter().filter(ours).collect();
    let Some(first) = ours.first() else { return Ok(ours) };
    if !force {
        let member = is_member(&root.join(first));
        let what = if member { "an earlier comparison".into() } else { format!("`{first}`") };
        let how = "choose another with --out, or --force to replace it";
        return refuse(root, format!("it holds {what}: {how}"));
    }
    if root.is_symlink() {
        let message = "is a link, and nothing is removed through a link; give the directory itself";
        return refuse(root, message);
    }
    let link = |name: &&String| is_member(&root.join(name)) && root.join(name).is_symlink();
    match ours.iter().find(link) {
        Some(name) => refuse(root, format!("`{name}` in it is a link, which is not followed")),
        None => Ok(ours),
    }
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
