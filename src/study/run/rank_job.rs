//! One run over ranks as a job of Slurm.
//!
//! ```text
//! DIR            the results
//! DIR.sbatch     the job script; submitted again, on as many ranks or others, it resumes the run
//! DIR.log        what the ranks print
//! ```

use std::path::{Path, PathBuf};

use super::slurm::{self, shell_quoted};
use crate::output::atomic;
use crate::run::Result;

/// Seconds that Open MPI's launcher waits before it passes a signal to end on to the ranks, and again before it kills them;
/// together less than the job has left then.
const GRACE: u32 = slurm::SIGNAL_LEAD / 2 - 5;

/// A run over ranks that Slurm starts.
pub struct RankJob<'a> {
    /// The directory of the results, its full path.
    pub root: &'a Path,
    /// This program, its full path.
    pub program: PathBuf,
    /// The scene, its full path.
    pub scene: PathBuf,
    /// Options of `rumple run`, word by word, without the directory.
    pub run: Vec<String>,
    /// Options of `rumple resume`.
    pub resume: Vec<String>,
    /// Processes, and threads of each.
    pub ranks: u32,
    /// Threads of a rank.
    pub threads: u16,
    /// What starts the ranks: `srun` or `mpirun`, with its options.
    pub launcher: &'a str,
    /// More options of sbatch, as in `--time=1:00:00`.
    pub options: &'a [String],
}

impl RankJob<'_> {
    /// The job script.
    ///
    /// # Errors
    /// A path or an option with a line break in it.
    pub fn script(&self) -> Result<String> {
        let (root, program) = (slurm::script_path(self.root)?, slurm::script_path(&self.program)?);
        let (scene, launcher) =
            (slurm::script_path(&self.scene)?, slurm::script_path(Path::new(self.launcher))?);
        let mut lines = vec![
            "#!/bin/sh".to_owned(),
            format!(
                "# A run over ranks with results in {root}; written by rumple run. Submitted again, it is resumed."
            ),
            format!("#SBATCH --job-name=\"{}\"", slurm::job_name(&self.scene)),
            format!("#SBATCH --ntasks={}", self.ranks),
            format!("#SBATCH --cpus-per-task={}", self.threads),
            format!("#SBATCH --output=\"{}.log\"", slurm::escaped_log_path(&root)),
            "#SBATCH --open-mode=append".to_owned(),
            format!("#SBATCH --signal=B:TERM@{}", slurm::SIGNAL_LEAD),
            "#SBATCH --requeue".to_owned(),
        ];
        lines.extend(slurm::options(self.options)?);
        let [quoted, program, scene] = [&root, &program, &scene].map(|text| shell_quoted(text));
        let words = |words: &[String]| -> String {
            words.iter().map(|word| format!(" {}", shell_quoted(word))).collect()
        };
        // In place of the shell, so that Slurm's signals reach the launcher, which passes them on.
        let timeout = "OMPI_MCA_odls_base_sigkill_timeout";
        lines.push(format!("export {timeout}=\"${{{timeout}:-{GRACE}}}\""));
        lines.push(format!("if [ -e {quoted}/resolved.toml ]; then"));
        lines.push(format!("    exec {launcher} {program} resume {quoted}{}", words(&self.resume)));
        lines.push("fi".to_owned());
        let run = words(&self.run);
        lines.push(format!("exec {launcher} {program} run {scene} --out {quoted}{run}"));
        Ok(lines.join("\n") + "\n")
    }

    /// Writes the script beside the directory of the results; its path.
    ///
    /// # Errors
    /// As for [`RankJob::script`], and from the operating system.
    pub fn write(&self) -> Result<PathBuf> {
        let (script, mut path) = (self.script()?, self.root.as_os_str().to_owned());
        path.push(".sbatch");
        let path = PathBuf::from(path);
        atomic::replace(&path, |writer| writer.write_all(script.as_bytes()))?;
        Ok(path)
    }
}
