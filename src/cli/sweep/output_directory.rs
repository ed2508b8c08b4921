//! The directory of a sweep.

use std::fs;
use std::path::Path;

use crate::cli::remove_run;
use crate::output::{Claim, OutputError};
use crate::run::Result;
use crate::study::accuracy::Study;
use crate::study::plan::Plan;
use crate::study::run::slurm;
use crate::study::sweep::{PAGE, PICTURES, PLOT, TABLE};

/// Makes room in `root` for `plan`, and the directory where there is none. A sweep that is there goes on if
/// it is the same, and is removed with `force`; anything else that is there is refused.
pub(super) fn make(root: &Path, plan: &Plan, force: bool) -> Result<Claim> {
    check(root, plan, force)?;
    fs::create_dir_all(root).map_err(OutputError::write(root))?;
    let claim = Claim::take(root)?;
    // Another sweep may have been there until just now.
    if check(root, plan, force)? && force {
        clear(root)?;
    }
    plan.write(root)?;
    claim.begin()?;
    Ok(claim)
}

/// Whether there is a sweep in `root`; refuses what cannot be gone on with.
fn check(root: &Path, plan: &Plan, force: bool) -> Result<bool> {
    let refuse = |message: &str| {
        let (path, message) = (root.to_owned(), message.to_owned());
        Err(OutputError::Directory { path, message }.into())
    };
    let Ok(found) = fs::symlink_metadata(root) else { return Ok(false) };
    if !root.is_dir() {
        return refuse("is a file, expected a directory or an unused name");
    }
    if let Some(earlier) = Plan::read(root)? {
        if !force {
            plan.check_resumable(&earlier, root)?;
        } else if found.is_symlink() || root.join(Plan::MEMBERS).is_symlink() {
            return refuse(
                "is a link, or has one in it, and nothing is removed through a link; give the \
                 directory itself",
            );
        }
        if let Some(job) = slurm::queued(root) {
            return refuse(&format!(
                "Slurm has job {job} for it: wait until that has ended, or end it with scancel {job}"
            ));
        }
        return Ok(true);
    }
    let entries = fs::read_dir(root).and_then(Iterator::collect::<std::io::Result<Vec<_>>>);
    let names = entries.map_err(OutputError::read(root))?.into_iter().map(|e| e.file_name());
    match names.into_iter().all(|name| name == Claim::LOCK || name == Claim::STATUS) {
        true => Ok(false),
        false => refuse("is not empty and holds no sweep; choose another with --out"),
    }
}

/// Removes what a sweep wrote; whatever else is there stays.
fn clear(root: &Path) -> Result<()> {
    let members = root.join(Plan::MEMBERS);
    for path in entries(&members) {
        if path.is_dir() && !path.is_symlink() {
            remove_run(&path)?;
        } else if path.extension().is_some_and(|e| e == "log") {
            let _ = fs::remove_file(path);
        }
    }
    let _ = fs::remove_dir(members);
    let logs = root.join(slurm::LOGS);
    if !logs.is_symlink() {
        for path in entries(&logs) {
            let _ = fs::remove_file(path);
        }
        let _ = fs::remove_dir(logs);
    }
    let ours = [&[Plan::FILE, TABLE, PAGE, PICTURES, slurm::SCRIPT], &Study::FILES[..]].concat();
    for path in entries(root) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let plot = name.starts_with(PLOT) && (name.ends_with(".svg") || name.ends_with(".png"));
        if plot || ours.contains(&name.as_str()) {
            fs::remove_file(&path).map_err(OutputError::write(&path))?;
        }
    }
    Ok(())
}

fn entries(folder: &Path) -> Vec<std::path::PathBuf> {
    fs::read_dir(folder).map_or(Vec::new(), |all| all.flatten().map(|e| e.path()).collect())
}
