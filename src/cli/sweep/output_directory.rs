//! The directory of a sweep.

use std::fs;
use std::path::Path;

use crate::cli::output_directory::{claim, names, refuse, remove_file, remove_run};
use crate::output::Claim;
use crate::run::Result;
use crate::study::accuracy::Study;
use crate::study::plan::Plan;
use crate::study::run::slurm;
use crate::study::sweep::{PAGE, PICTURES, PLOT, TABLE};

/// Makes room in `root` for `plan`, and the directory where there is none. A sweep that is there is resumed if
/// it is the same, and is removed with `force`; anything else that is there is refused.
pub(super) fn make(root: &Path, plan: &Plan, force: bool) -> Result<Claim> {
    let (claim, found) = claim(root, || check(root, plan, force))?;
    if found && force {
        clear(root)?;
    }
    plan.write(root)?;
    claim.begin()?;
    Ok(claim)
}

/// Whether there is a sweep in `root`; refuses one that cannot be resumed.
fn check(root: &Path, plan: &Plan, force: bool) -> Result<bool> {
    let names = names(root)?;
    let Some(earlier) = Plan::read(root)? else {
        return match names.iter().all(|name| name == Claim::LOCK || name == Claim::STATUS) {
            true => Ok(false),
            false => refuse(root, "is not empty and holds no sweep; choose another with --out"),
        };
    };
    if !force {
        plan.check_resumable(&earlier, root)?;
    } else if root.is_symlink() || root.join(Plan::MEMBERS).is_symlink() {
        let message = "is a link, or has one in it, and nothing is removed through a link; give the \
                       directory itself";
        return refuse(root, message);
    }
    match slurm::queued(root) {
        None => Ok(true),
        Some(job) => {
            let how = format!("wait until that has ended, or end it with scancel {job}");
            refuse(root, format!("Slurm has job {job} for it: {how}"))
        }
    }
}

/// Removes what a sweep wrote; anything else that is there stays.
fn clear(root: &Path) -> Result<()> {
    let members = root.join(Plan::MEMBERS);
    for path in names(&members)?.iter().map(|name| members.join(name)) {
        if path.is_dir() && !path.is_symlink() {
            remove_run(&path)?;
        } else if path.extension().is_some_and(|e| e == "log") {
            let _ = fs::remove_file(path);
        }
    }
    let logs = root.join(slurm::LOGS);
    if !logs.is_symlink() {
        for name in names(&logs)? {
            let _ = fs::remove_file(logs.join(name));
        }
        let _ = fs::remove_dir(logs);
    }
    let _ = fs::remove_dir(members);
    let ours = [&[Plan::FILE, TABLE, PAGE, PICTURES, slurm::SCRIPT], &Study::FILES[..]].concat();
    for name in names(root)? {
        let plot = name.starts_with(PLOT) && (name.ends_with(".svg") || name.ends_with(".png"));
        if plot || ours.contains(&name.as_str()) {
            remove_file(&root.join(name))?;
        }
    }
    Ok(())
}
