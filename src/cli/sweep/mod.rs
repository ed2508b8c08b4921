//! `rumple sweep SCENE`: the same scene over lists and ranges of its keys.

pub(super) mod begin;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};

use super::SceneArgs;
use crate::run::Result;
use crate::study::plan::Plan;
use crate::study::{Purpose, run};

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

/// Arguments that begin a sweep, or resume it; they are there with the scene.
#[derive(Debug, Args)]
#[group(args = ["scene"])]
pub(super) struct PlanArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// A key of the scene and the values that it takes (see below); may be repeated.
    #[arg(long, value_name = "KEY=VALUES")]
    over: Vec<String>,
    /// Repeat every member on meshes of 1, 2 and 4 times as many vertices, for the order of convergence of every
    /// measure.
    #[arg(long)]
    refine: bool,
    /// Repeat every member with seeds 1 to N for everything random in the scene: mesh, imperfection,
    /// random starts.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    seeds: Option<u16>,
    /// Value of the first species above which there is a spot; by default half way between its least and
    /// largest values.
    #[arg(long, value_name = "VALUE", allow_hyphen_values = true, value_parser = crate::cli::finite)]
    level: Option<f64>,
    #[command(flatten)]
    how: HowArgs,
}

/// Options of the runs of many members.
#[derive(Debug, Args)]
pub(super) struct HowArgs {
    /// Directory for the results; by default named after the scene and the command.
    #[arg(short, long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Members at once; by default as many as there are cores for their --threads, which are 1 each if
    /// not given. Never more than fit into memory.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) jobs: Option<u16>,
    /// Memory that all members together may take, as in 8GB; by default 90 % of what is free.
    #[arg(long, value_name = "SIZE", value_parser = bytes)]
    pub(super) memory: Option<u64>,
    /// Run members again that failed.
    #[arg(long)]
    pub(super) retry_failed: bool,
    /// Replace an earlier sweep in that directory.
    #[arg(long)]
    pub(super) force: bool,
    /// Print nothing but errors.
    #[arg(long)]
    pub(super) quiet: bool,
    /// Write a job script for Slurm, an array with a task for every member that is not complete, and
    /// submit it.
    #[arg(long)]
    pub(super) slurm: bool,
    /// An option of sbatch for the script, as in `--slurm-option=--time=1:00:00`; may be repeated.
    #[arg(long, value_name = "OPTION", requires = "slurm", allow_hyphen_values = true)]
    pub(super) slurm_option: Vec<String>,
    /// Write the job script, but do not submit it.
    #[arg(long, requires = "slurm")]
    pub(super) no_submit: bool,
}

pub(super) fn run(args: &SweepArgs) -> Result<()> {
    match (&args.command, &args.plan) {
        (Some(Command::Collect { directory, quiet }), _) => {
            let root = super::absolute(directory)?;
            let plan = Plan::of(&root)?;
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

/// `8GB`, `500 MB`, `2GiB`, or a number of bytes.
fn bytes(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic()).trim_end();
    let unit: f64 = match text[digits.len()..].trim().to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "k" | "kb" => 1e3,
        "m" | "mb" => 1e6,
        "g" | "gb" => 1e9,
        "kib" => 1024.0,
        "mib" => 1_048_576.0,
        "gib" => 1_073_741_824.0,
        other => return Err(format!("unknown unit {other:?}; expected a size as 8GB or 500MB")),
    };
    let number = digits.parse::<f64>();
    let wrong = |_| format!("{digits:?} is not a number; expected a size as 8GB");
    let size = number.map_err(wrong)? * unit;
    if !(1.0..1e18).contains(&size) {
        return Err("expected a size above 0, as 8GB".into());
    }
    Ok(crate::num::whole(size) as u64)
}
