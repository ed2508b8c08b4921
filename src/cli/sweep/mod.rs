//! `rumple sweep SCENE`: the same scene over lists and ranges of its keys.

pub(super) mod begin;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};

use crate::run::Result;
use crate::study::plan::Plan;
use crate::study::{Purpose, run};
pub(super) use begin::{HowArgs, PlanArgs};

/// Arguments of `sweep`: those of a sweep, or a command for one that there is.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(after_help = VALUES_HELP)]
pub(super) struct SweepArgs {
    #[command(flatten)]
    plan: Option<PlanArgs>,
    #[command(subcommand)]
    command: Option<Command>,
}

/// How values are written.
const VALUES_HELP: &str = "\
Values of --over:
  material.thickness=0.5,1,1.5          a list
  sheet.seed=1..8                       whole numbers, both ends included
  material.thickness=0.5..1.5:5         5 values, evenly spaced, both ends included
  kinetics.parameters.k=0.01..10:4:log  4 values with equal ratios
  time.policy=quasi-static,simultaneous names; items of a list may be ranges
Several --over give every combination of their values.

The same command again continues an interrupted sweep: members that are complete are not run again. An
earlier sweep in DIR that had another scene is refused. Exit code 1 if members failed.";

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Gather what there is of a sweep, comparison or accuracy study, finished or not: tables and plots.
    Collect {
        /// Its directory.
        directory: PathBuf,
        /// Print nothing.
        #[arg(long)]
        quiet: bool,
    },
    /// Run one member of a sweep that was planned: what every task of an array job does.
    Member {
        /// The directory of the sweep.
        directory: PathBuf,
        /// The number of the member, from 0.
        number: usize,
        /// End, as if interrupted, when standard input is closed.
        #[arg(long)]
        leash: bool,
    },
}

pub(super) fn run(args: &SweepArgs) -> Result<()> {
    match (&args.command, &args.plan) {
        (Some(Command::Collect { directory, quiet }), _) => {
            let root = super::absolute(directory)?;
            let plan = Plan::load(&root)?;
            show(&Purpose::read(&plan, &root)?, &plan, &root, *quiet)
        }
        (Some(Command::Member { directory, number, leash }), _) => {
            run::member(&super::absolute(directory)?, *number, None, *leash)
        }
        (None, plan) => plan.as_ref().map_or(Ok(()), begin::run),
    }
}

/// Shows what there is of the study in `root`. Fails if members failed or were killed.
pub(super) fn show(purpose: &Purpose, plan: &Plan, root: &Path, quiet: bool) -> Result<()> {
    let say = |text: &str| {
        if !quiet {
            say!("{text}");
        }
    };
    let shown = purpose.show(plan, root, &say, false);
    super::view::write_study_report(plan, root);
    shown.map(|_| ())
}
