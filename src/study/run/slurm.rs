//! A sweep as an array job of Slurm: one task a member.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::output::{OutputError, atomic};
use crate::run::{Error, Result};
use crate::study::plan::Plan;

/// Name of the job script in the directory of a sweep.
pub const SCRIPT: &str = "sweep.sbatch";
/// Name of the folder of what the tasks print, and of the number of the job.
pub const LOGS: &str = "slurm";
const JOB_FILE: &str = "job";
/// Seconds between SIGTERM to a member and the end of its time limit.
pub(super) const SIGNAL_LEAD: u32 = 60;

/// How Slurm runs members: an array job.
#[derive(Debug, Clone)]
pub struct SlurmSettings {
    /// This program, its full path.
    pub program: PathBuf,
    /// More options of sbatch, as in `--time=1:00:00`.
    pub options: Vec<String>,
    /// Whether the job script is submitted.
    pub submit: bool,
}

impl SlurmSettings {
    /// The job script for `members` of `plan` in `root`, most `jobs` at once.
    fn script(
        &self,
        (plan, root): (&Plan, &Path),
        members: &[usize],
        jobs: Option<usize>,
    ) -> Result<String> {
        let (root, program) = (script_path(root)?, script_path(&self.program)?);
        let name = job_name(&plan.scene);
        let most = jobs.map_or(String::new(), |jobs| format!("%{jobs}"));
        let logs = escaped_log_path(&root);
        let mut lines = vec![
            "#!/bin/sh".to_owned(),
            format!("# A task for every member of the sweep in {root}; written by rumple sweep."),
            format!("#SBATCH --job-name=\"{name}\""),
            format!("#SBATCH --array={}{most}", ranges(members)),
            format!("#SBATCH --cpus-per-task={}", plan.threads),
            format!("#SBATCH --output=\"{logs}/{LOGS}/%A_%a.log\""),
            format!("#SBATCH --signal=B:TERM@{SIGNAL_LEAD}"),
            "#SBATCH --requeue".to_owned(),
        ];
        lines.extend(options(&self.options)?);
        // In place of the shell, so that Slurm's signals reach the program.
        lines.push(format!(
            "exec {} sweep member {} \"$SLURM_ARRAY_TASK_ID\"",
            shell_quoted(&program),
            shell_quoted(&root)
        ));
        Ok(lines.join("\n") + "\n")
    }

    /// Writes the script for `members` of `plan` into `root` and submits it, if settings say so; its path, and the number of
    /// the job.
    ///
    /// # Errors
    /// A path or an option with a line end in it; from the operating system; sbatch is not there, or refuses.
    pub(super) fn write(
        &self,
        (plan, root): (&Plan, &Path),
        members: &[usize],
        jobs: Option<usize>,
    ) -> Result<(PathBuf, Option<String>)> {
        let script = self.script((plan, root), members, jobs)?;
        let (path, logs) = (root.join(SCRIPT), root.join(LOGS));
        std::fs::create_dir_all(&logs).map_err(OutputError::write(&logs))?;
        atomic::replace(&path, |writer| writer.write_all(script.as_bytes()))?;
        let job = self.submit.then(|| submit(&path)).transpose()?;
        if let Some(job) = &job {
            atomic::replace(&logs.join(JOB_FILE), |writer| writeln!(writer, "{job}"))?;
        }
        Ok((path, job))
    }
}

/// Submits the script at `path`; the number of the job.
///
/// # Errors
/// If sbatch is not there, or refuses.
pub fn submit(path: &Path) -> Result<String> {
    let out = Command::new("sbatch").arg("--parsable").arg(path).output().map_err(|error| {
        Error::Refused(format!(
            "cannot run sbatch: {error}; is this a machine that submits to Slurm? The script is {}",
            path.display()
        ))
    })?;
    if !out.status.success() {
        let said = String::from_utf8_lossy(&out.stderr);
        return Err(Error::Refused(format!("sbatch refuses {}: {}", path.display(), said.trim())));
    }
    // With several clusters the name of one follows.
    let said = String::from_utf8_lossy(&out.stdout);
    Ok(said.trim().split(';').next().unwrap_or_default().to_owned())
}

/// The name of a job: that of its scene.
pub(super) fn job_name(scene: &Path) -> String {
    let name = scene.file_stem().unwrap_or_default().to_string_lossy();
    name.chars().filter(|c| !c.is_whitespace() && *c != '"').collect()
}

/// A path within the quoted name of a file of messages, where a % begins a number of the job.
pub(super) fn escaped_log_path(path: &str) -> String {
    path.replace('%', "%%").replace('"', "\\\"")
}

/// The lines of a script with more options of sbatch.
pub(super) fn options(given: &[String]) -> Result<Vec<String>> {
    let line = |option: &String| match option.contains(['\n', '\r']) || !option.starts_with('-') {
        true => Err(Error::Refused(format!(
            "--slurm-option {option:?}: expected an option of sbatch, as in --slurm-option=--time=1:00:00"
        ))),
        false => Ok(format!("#SBATCH {option}")),
    };
    given.iter().map(line).collect()
}

/// The job that was submitted for the sweep in `root`, if tasks of it wait or run.
pub(crate) fn active_job(root: &Path) -> Option<String> {
    let job = std::fs::read_to_string(root.join(LOGS).join(JOB_FILE)).ok()?.trim().to_owned();
    let number = !job.is_empty() && job.bytes().all(|b| b.is_ascii_digit());
    // A job that is long gone is an error of squeue.
    let out = Command::new("squeue").args(["-h", "-o", "%T", "-j", &job]).output().ok()?;
    let alive = out.status.success() && !out.stdout.trim_ascii().is_empty();
    (number && alive).then_some(job)
}

/// `0-3,7` for 0, 1, 2, 3 and 7.
fn ranges(members: &[usize]) -> String {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for &member in members {
        match runs.last_mut() {
            Some((_, last)) if *last + 1 == member => *last = member,
            _ => runs.push((member, member)),
        }
    }
    let text = |(first, last): &(usize, usize)| match first == last {
        true => first.to_string(),
        false => format!("{first}-{last}"),
    };
    runs.iter().map(text).collect::<Vec<_>>().join(",")
}

/// A path in a line of a job script.
pub(super) fn script_path(path: &Path) -> Result<String> {
    let text = path.to_str().filter(|text| !text.contains(['\n', '\r']));
    text.map(str::to_owned).ok_or_else(|| {
        let what = "has a line break in it, or is not UTF-8; a job script cannot name it";
        Error::Refused(format!("{}: {what}", path.display()))
    })
}

/// A word for a shell.
pub(crate) fn shell_quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', "'\\''"))
}
