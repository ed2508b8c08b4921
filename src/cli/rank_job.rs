//! `rumple run SCENE --slurm`: a run over ranks as a job of Slurm.

use std::path::Path;

use clap::Args;

use super::SceneArgs;
use crate::run::{Error, Result};
use crate::study::run::{RankJob, slurm};

/// Options of `run` for Slurm.
#[derive(Debug, Clone, Args)]
pub(super) struct JobArgs {
    /// Write a job script for Slurm, which runs the scene over ranks, and submit it; where the directory has
    /// results, it resumes them.
    #[arg(long, requires = "ranks", requires = "out")]
    pub(super) slurm: bool,
    /// With `--slurm`: processes that the sheet is spread over.
    #[arg(long, value_name = "N", requires = "slurm", value_parser = clap::value_parser!(u32).range(1..))]
    ranks: Option<u32>,
    /// With `--slurm`: what starts the ranks, with its options, as in `--launcher "srun --mpi=pmix"` or
    /// `--launcher mpirun`.
    #[arg(long, value_name = "COMMAND", default_value = "srun")]
    launcher: String,
    /// An option of sbatch for the script, as in `--slurm-option=--time=1:00:00`; may be repeated.
    #[arg(long, value_name = "OPTION", requires = "slurm", allow_hyphen_values = true)]
    slurm_option: Vec<String>,
    /// Write the job script, but do not submit it.
    #[arg(long, requires = "slurm")]
    no_submit: bool,
}

impl JobArgs {
    /// Writes the job script of the run of `scene` with results in `root` and these options, and submits it.
    pub(super) fn submit(
        &self,
        scene: &SceneArgs,
        root: &Path,
        arguments: Vec<String>,
        quiet: bool,
    ) -> Result<()> {
        if !cfg!(feature = "mpi") {
            let what = "--slurm: this program was built without MPI, and starts no ranks; build it with \
                        `cargo build --release --features mpi`";
            return Err(Error::Refused(what.to_owned()));
        }
        let program = std::env::current_exe().map_err(|error| {
            Error::Refused(format!("--slurm: where this program is cannot be found out: {error}"))
        })?;
        let job = RankJob {
            root,
            program,
            scene: super::absolute(&scene.scene)?,
            run: arguments,
            resume: scene.words_of_plugins()?,
            ranks: self.ranks.unwrap_or(1),
            threads: scene.threads.unwrap_or(1),
            launcher: &self.launcher,
            options: &self.slurm_option,
        };
        let path = job.write()?;
        if self.no_submit {
            if !quiet {
                say!("sbatch {} submits it", path.display());
            }
            return Ok(());
        }
        let job = slurm::submit(&path)?;
        if !quiet {
            say!("job {job}: {}", path.display());
        }
        Ok(())
    }
}
