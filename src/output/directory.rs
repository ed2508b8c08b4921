//! The directory that takes the results of one run.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use super::{Claim, OutputError, atomic, clock};

/// A directory set up for one run, and the names of everything in it.
///
/// It is claimed for that run until the last copy is dropped.
#[derive(Debug, Clone)]
pub struct ResultDirectory {
    root: PathBuf,
    claim: Arc<Claim>,
}

impl ResultDirectory {
    /// Name of the subdirectory of the frames.
    pub const FRAMES: &'static str = "frames";
    const MODES: &'static str = "modes";
    const CHECKPOINTS: &'static str = "checkpoints";
    /// Name of the list of events.
    pub const EVENTS: &'static str = "events.csv";
    /// Name of the index of frames.
    pub const PVD: &'static str = "sheet.pvd";
    /// Names of the frames, and of their index, that earlier versions wrote in other formats.
    pub const OLD_FRAMES: [&'static str; 2] = ["sheet.vtkhdf", "sheet.vtk.series"];
    /// Name of the ledger.
    pub const LEDGER: &'static str = "ledger.csv";
    /// Name of the viewer of the results.
    pub const REPORT: &'static str = "report.html";
    /// Name of the macro for ParaView.
    pub const MACRO: &'static str = "open-in-paraview.py";
    /// Name of the table of branches of equilibria.
    pub const BRANCH: &'static str = "branch.csv";
    /// Name of what a study shows, as data that the viewer draws.
    pub const PLOTS: &'static str = "plots.json";
    const RESOLVED: &'static str = "resolved.toml";
    /// Name of the provenance.
    pub const PROVENANCE: &'static str = "provenance.json";
    const COSTS: &'static str = "costs.json";
    /// Name of the folder of a run that failed.
    pub const FAILURE: &'static str = "failure";
    /// In it why the run failed …
    pub const FAILURE_REPORT: &'static str = "report.md";
    /// … and the last good state.
    pub const LAST_GOOD_STATE: &'static str = "state.vtu";
    /// Name of the measures of a member of a sweep.
    pub const MEASURES: &'static str = "measures.csv";
    /// Name of the states of a member at its output times.
    pub const STATES: &'static str = "states.bin";

    /// The directory of a run for which none was named: the scene's stem and the time in UTC, as
    /// `spots-20261121-123456` in the working directory.
    #[must_use]
    pub fn default_path(scene: &Path, now: SystemTime) -> PathBuf {
        let stem = scene.file_stem().unwrap_or("run".as_ref()).to_string_lossy();
        PathBuf::from(format!("{stem}-{}", clock::stamp(now)))
    }

    /// Makes `root` ready: creates it, or empties it of an earlier run if `force` is given.
    ///
    /// Only files that a run writes are removed, known by their names; whatever else is there
    /// stays. Links are not followed to remove anything. Nothing is removed, nor made in a directory
    /// that is refused, before everything has been checked.
    ///
    /// # Errors
    /// [`OutputError::Directory`] if `root` is not a directory, is not empty and `force` is
    /// not given, has links where a run has directories, or is in use by another run;
    /// [`OutputError::Write`] or [`OutputError::Read`] from the operating system.
    pub fn prepare(root: &Path, force: bool) -> Result<Self, OutputError> {
        let full = std::path::absolute(root).map_err(OutputError::write(root))?;
        check(root, force)?;
        fs::create_dir_all(&full).map_err(OutputError::write(root))?;
        let claim = Arc::new(Claim::take(&full)?);
        // Another run may have been there until just now.
        check(root, force)?;
        let directory = Self { root: full, claim };
        directory.clear()?;
        directory.claim.begin()?;
        Ok(directory)
    }

    /// Locks `root` for a run to be continued in it; nothing is changed but the record of its status, and
    /// that by [`Claim::begin`].
    ///
    /// # Errors
    /// [`OutputError::Directory`] if it is in use, or has links where a run has directories;
    /// [`OutputError::Write`] from the operating system.
    pub fn reopen(root: &Path) -> Result<Self, OutputError> {
        let full = std::path::absolute(root).map_err(OutputError::write(root))?;
        if Claim::in_use(&full) {
            let message = "a run is still writing to it; wait for its end, or end it".to_owned();
            return Err(OutputError::Directory { path: root.to_owned(), message });
        }
        check_folders(root)?;
        let claim = Arc::new(Claim::take(&full)?);
        Ok(Self { root: full, claim })
    }

    /// Removes frames and modes from these numbers on, and what says how the run ended: of a resumed run
    /// from before them.
    ///
    /// # Errors
    /// [`OutputError::Read`] and [`OutputError::Write`] from the operating system.
    pub fn cut_back(&self, frames: usize, modes: usize) -> Result<(), OutputError> {
        let mut later = vec![self.costs(), self.root.join(Self::REPORT)];
        for (folder, stem, count) in
            [(self.frames(), "frame_", frames), (self.modes(), "mode_", modes)]
        {
            later.extend(numbered(&folder, stem, count)?);
        }
        remove_all(later)?;
        self.forget_failure()
    }

    /// Removes the folder of a run that failed; with anything else in it, it stays.
    ///
    /// # Errors
    /// [`OutputError::Write`] from the operating system.
    pub fn forget_failure(&self) -> Result<(), OutputError> {
        let folder = self.root.join(Self::FAILURE);
        // Nothing is removed through a link.
        if fs::symlink_metadata(&folder).is_ok_and(|found| found.is_dir()) {
            // The last one is of earlier versions.
            let files = [Self::FAILURE_REPORT, Self::LAST_GOOD_STATE, "ledger.csv"];
            remove_all(files.map(|name| folder.join(name)).to_vec())?;
            let _ = fs::remove_dir(folder);
        }
        Ok(())
    }

    /// Numbers and paths of all checkpoints, ascending.
    ///
    /// # Errors
    /// [`OutputError::Read`] from the operating system.
    pub fn checkpoints_found(&self) -> Result<Vec<(usize, PathBuf)>, OutputError> {
        Self::checkpoints_in(&self.root)
    }

    /// The same of a directory that is not claimed.
    ///
    /// # Errors
    /// As for [`Self::checkpoints_found`].
    pub fn checkpoints_in(root: &Path) -> Result<Vec<(usize, PathBuf)>, OutputError> {
        let folder = root.join(Self::CHECKPOINTS);
        let found = if folder.is_dir() { names(&folder)? } else { Vec::new() };
        let whole = found.iter().filter(|name| !name.starts_with('.'));
        let place = |name: &String| Some((number_of(name, "checkpoint_")?, folder.join(name)));
        let mut all: Vec<_> = whole.filter_map(place).collect();
        all.sort();
        Ok(all)
    }

    /// Removes what a run has written.
    fn clear(&self) -> Result<(), OutputError> {
        // The index goes first: what is left if this is cut short then claims nothing.
        let mut ours = vec![self.pvd()];
        let content = names(&self.root)?;
        ours.extend(content.iter().filter(|n| is_root_file(n)).map(|name| self.root.join(name)));
        let folders = [
            (self.frames(), "frame_"),
            (self.modes(), "mode_"),
            (self.checkpoints(), "checkpoint_"),
        ];
        for (folder, stem) in &folders {
            ours.extend(numbered(folder, stem, 0)?);
        }
        remove_all(ours)?;
        self.forget_failure()?;
        for (folder, _) in folders {
            // One with anything else in it stays.
            let _ = fs::remove_dir(folder);
        }
        Ok(())
    }

    /// The claim on the directory, through which it is recorded how the run ends.
    #[must_use]
    pub fn claim(&self) -> &Claim {
        &self.claim
    }

    /// The directory itself.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The index of frames, which is the file to open in ParaView.
    #[must_use]
    pub fn pvd(&self) -> PathBuf {
        self.root.join(Self::PVD)
    }

    /// The subdirectory of the frames.
    #[must_use]
    pub fn frames(&self) -> PathBuf {
        self.root.join(Self::FRAMES)
    }

    /// Frame `number`, counted from 0.
    #[must_use]
    pub fn frame(&self, number: usize) -> PathBuf {
        self.frames().join(Self::frame_name(number))
    }

    /// The ledger.
    #[must_use]
    pub fn ledger(&self) -> PathBuf {
        self.root.join(Self::LEDGER)
    }

    /// The table of branches of equilibria.
    #[must_use]
    pub fn branch(&self) -> PathBuf {
        self.root.join(Self::BRANCH)
    }

    /// The list of events.
    #[must_use]
    pub fn events(&self) -> PathBuf {
        self.root.join(Self::EVENTS)
    }

    /// The subdirectory of the modes of events.
    #[must_use]
    pub fn modes(&self) -> PathBuf {
        self.root.join(Self::MODES)
    }

    /// The modes of event `number`, counted from 0.
    #[must_use]
    pub fn mode(&self, number: usize) -> PathBuf {
        self.modes().join(format!("mode_{number:06}.vtu"))
    }

    /// The subdirectory of the checkpoints.
    #[must_use]
    pub fn checkpoints(&self) -> PathBuf {
        self.root.join(Self::CHECKPOINTS)
    }

    /// Checkpoint `number`, counted from 0.
    #[must_use]
    pub fn checkpoint(&self, number: usize) -> PathBuf {
        self.checkpoints().join(format!("checkpoint_{number:06}.bin"))
    }

    /// The scene with every default written out.
    #[must_use]
    pub fn resolved(&self) -> PathBuf {
        Self::resolved_in(&self.root)
    }

    /// The same of the run whose results are in `root`.
    #[must_use]
    pub fn resolved_in(root: &Path) -> PathBuf {
        root.join(Self::RESOLVED)
    }

    /// Versions, hashes, host and command line.
    #[must_use]
    pub fn provenance(&self) -> PathBuf {
        self.root.join(Self::PROVENANCE)
    }

    /// What the run cost, part by part.
    #[must_use]
    pub fn costs(&self) -> PathBuf {
        Self::costs_in(&self.root)
    }

    /// The same of the run whose results are in `root`.
    #[must_use]
    pub fn costs_in(root: &Path) -> PathBuf {
        root.join(Self::COSTS)
    }

    /// Name of frame `number` within [`frames`](Self::frames).
    #[must_use]
    pub(crate) fn frame_name(number: usize) -> String {
        format!("frame_{number:06}.vtu")
    }
}

/// Refuses what cannot take the results of a run.
fn check(root: &Path, force: bool) -> Result<(), OutputError> {
    let refuse = |message: &str| {
        Err(OutputError::Directory { path: root.to_owned(), message: message.to_owned() })
    };
    let Ok(found) = fs::symlink_metadata(root) else { return Ok(()) };
    if !root.is_dir() {
        return refuse("is a file, expected a directory or an unused name");
    }
    check_folders(root)?;
    if is_empty(root)? {
        return Ok(());
    }
    if found.is_symlink() {
        return refuse(
            "is a link, and nothing is removed through a link; give the directory \
            itself",
        );
    }
    if !force {
        return refuse(
            "is not empty; choose another with --out, or give --force to replace the results of an \
             earlier run in it",
        );
    }
    Ok(())
}

/// Refuses links and files where a run has directories.
fn check_folders(root: &Path) -> Result<(), OutputError> {
    let folders = [
        ResultDirectory::FRAMES,
        ResultDirectory::MODES,
        ResultDirectory::CHECKPOINTS,
        ResultDirectory::FAILURE,
    ];
    for name in folders {
        let what = match fs::symlink_metadata(root.join(name)) {
            Ok(found) if found.is_symlink() => "link, which is not followed",
            Ok(found) if !found.is_dir() => "file",
            _ => continue,
        };
        let message = format!("`{name}` in it is a {what}; a run writes to a directory so named");
        return Err(OutputError::Directory { path: root.to_owned(), message });
    }
    Ok(())
}

/// Removes files, whether they are there or not.
fn remove_all(files: Vec<PathBuf>) -> Result<(), OutputError> {
    for path in files {
        match fs::remove_file(&path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                return Err(OutputError::Write { path, source: e });
            }
            _ => {}
        }
    }
    Ok(())
}

/// Whether a directory holds nothing but the lock of a run that has ended.
fn is_empty(directory: &Path) -> Result<bool, OutputError> {
    Ok(names(directory)?.iter().all(|name| name == Claim::LOCK))
}

/// Names of all entries of `directory`, sorted.
fn names(directory: &Path) -> Result<Vec<String>, OutputError> {
    let mut names = fs::read_dir(directory)
        .and_then(|entries| {
            entries
                .map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()))
                .collect::<std::io::Result<Vec<_>>>()
        })
        .map_err(OutputError::read(directory))?;
    names.sort();
    Ok(names)
}

/// The name of the finished file for one that a killed run left under construction.
fn finished(name: &str) -> &str {
    name.strip_prefix('.').and_then(|n| n.strip_suffix(atomic::PART_SUFFIX)).unwrap_or(name)
}

fn is_root_file(name: &str) -> bool {
    [
        ResultDirectory::PVD,
        ResultDirectory::OLD_FRAMES[0],
        ResultDirectory::OLD_FRAMES[1],
        ResultDirectory::LEDGER,
        ResultDirectory::EVENTS,
        ResultDirectory::BRANCH,
        ResultDirectory::PLOTS,
        ResultDirectory::RESOLVED,
        ResultDirectory::PROVENANCE,
        "failed.vtu",
        ResultDirectory::COSTS,
        ResultDirectory::REPORT,
        ResultDirectory::MACRO,
        ResultDirectory::MEASURES,
        // Of earlier versions.
        "branch.svg",
        "branch.png",
        "shown.vtu",
        ResultDirectory::STATES,
        "timing.json",
        Claim::STATUS,
    ]
    .contains(&finished(name))
}

/// Paths of the files in `folder` whose names are `stem` with a number from `first` on, finished or not.
fn numbered(folder: &Path, stem: &str, first: usize) -> Result<Vec<PathBuf>, OutputError> {
    let found = if folder.is_dir() { names(folder)? } else { Vec::new() };
    let later = found.iter().filter(|name| number_of(name, stem).is_some_and(|k| k >= first));
    Ok(later.map(|name| folder.join(name)).collect())
}

/// The number of a file as frames, modes and checkpoints have them.
fn number_of(name: &str, stem: &str) -> Option<usize> {
    let rest = finished(name).strip_prefix(stem)?;
    let number = [".vtu", ".vtk", ".bin"].iter().find_map(|ending| rest.strip_suffix(ending))?;
    let digits = number.len() >= 6 && number.bytes().all(|b| b.is_ascii_digit());
    if digits { number.parse().ok() } else { None }
}
