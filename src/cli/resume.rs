//! `rumple resume DIR`: a resumed run.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;

use super::run;
use crate::output::{Interrupt, Mode, Progress, ResultDirectory};
use crate::reduction::Communicator;
use crate::run::ranks::{self, agreed};
use crate::run::run::{Ending, continued};
use crate::run::{Error, Result, resume};
use crate::solve::SolveError;

/// Arguments of `resume`.
#[derive(Debug, Args)]
pub(super) struct ResumeArgs {
    /// The directory of the run.
    directory: PathBuf,
    /// Continue until this time instead of the one in the scene.
    #[arg(long, value_name = "T")]
    until: Option<f64>,
    /// Override a key that decides when the run ends, or of its checkpoints, as in `--set time.max_steps=100`; may be
    /// repeated. Any other is refused.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
    /// Directory to look for plugins in, before RUMPLE_PLUGIN_PATH and the program's own
    /// directory; may be repeated.
    #[arg(long = "plugin-path", value_name = "DIR")]
    plugin_path: Vec<PathBuf>,
    /// Threads to compute with; all cores by default. Results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Print nothing but errors, and what a law does wrong.
    #[arg(long)]
    quiet: bool,
}

pub(super) fn run(args: &ResumeArgs) -> Result<()> {
    let ranks = super::ranks::all()?;
    super::set_threads(args.threads.or(ranks.is_some().then_some(1)));
    rayon::scope(|_| run_in_pool(args, ranks))
}

/// The directory that this rank writes to: that of the run, or one within it.
fn directory(root: &Path, ranks: Option<&dyn Communicator>) -> Result<ResultDirectory> {
    let own = ranks.map_or_else(|| root.to_owned(), |ranks| ranks::root(root, ranks));
    match own.is_dir() {
        true => Ok(ResultDirectory::reopen(&own)?),
        false => Ok(ResultDirectory::prepare(&own, false)?),
    }
}

fn run_in_pool(args: &ResumeArgs, ranks: Option<Arc<dyn Communicator>>) -> Result<()> {
    let root = super::absolute(&args.directory)?;
    if !root.is_dir() {
        return Err(Error::Refused(format!("{}: no such directory", root.display())));
    }
    let directory = agreed(ranks.as_deref(), directory(&root, ranks.as_deref()))?;
    let quiet = args.quiet || ranks.as_ref().is_some_and(|ranks| ranks.rank() > 0);
    let search = super::defaults().search(&args.plugin_path);
    let until = args.until.map(|until| format!("time.until={until:?}"));
    let overrides: Vec<String> = args.overrides.iter().cloned().chain(until).collect();
    let resumed =
        resume::resume_on(&root, &directory, &overrides, &search, ranks.as_ref().map(Arc::clone));
    let mut resumed = agreed(ranks.as_deref(), resumed)?;
    let interrupt = Interrupt::install()?;
    let mode = if quiet { Mode::Silent } else { Mode::detect() };
    let until = resumed.scene.time.span.until.get();
    let mut progress = Progress::new(mode, until);
    let outcome = continued(&mut resumed, &directory, &mut progress, interrupt, &mut []);
    progress.finish();
    let resume::Resumed { scene, notes, .. } = resumed;
    let first = ranks.as_ref().is_none_or(|ranks| ranks.rank() == 0);
    let report = super::view::write_report(&root, scene.output.report && first);
    let done = outcome?;
    if quiet {
        notes.iter().for_each(|note| super::warn(note));
    } else {
        run::print_summary(&done, &directory);
        run::print_report_path(report.as_deref());
    }
    match done.ending {
        Ending::Interrupted => Err(Error::Solve(SolveError::Interrupted)),
        _ => Ok(()),
    }
}
