//! `rumple run SCENE`: the main job.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

use clap::Args;

use super::SceneArgs;
use crate::num::plural;
use crate::output::{Claim, Interrupt, Mode, Progress, ResultDirectory, SelfIntersection};
use crate::reduction::Communicator;
use crate::run::ranks::{self, agreed};
use crate::run::run::{self, Ending, Summary};
use crate::run::{Error, Result, Simulation, inspect, provenance};
use crate::scene::Scene;
use crate::sheet::read;
use crate::solve::SolveError;

/// Arguments of `run`.
#[derive(Debug, Clone, Args)]
pub(super) struct RunArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Directory for the results; by default the scene's name with the time.
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Start from a state: points are positions, arrays are species by name; the time begins at 0, or as --start-time says.
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
    /// The time at which the state of --from begins: ramps, growth and laws that read t continue from there.
    #[arg(long, value_name = "T", requires = "from", value_parser = super::finite)]
    start_time: Option<f64>,
    /// Replace the results of an earlier run in that directory.
    #[arg(long)]
    force: bool,
    /// Print how the run ended as JSON, as status.json has it, with the directory, in place of the summary.
    #[arg(long)]
    json: bool,
    /// Print nothing but errors, and what a law does wrong.
    #[arg(long)]
    quiet: bool,
}

pub(super) fn run(args: &RunArgs) -> Result<()> {
    let ranks = super::ranks::all()?;
    let Some(ranks) = ranks else { return args.scene.with_threads(|| run_in_pool(args, None)) };
    // One says what there is to say, and no rank takes the threads of another.
    let quiet = args.quiet || ranks.rank() > 0;
    let threads = args.scene.threads.or(Some(1));
    let args =
        RunArgs { quiet, scene: SceneArgs { threads, ..args.scene.clone() }, ..args.clone() };
    args.scene.with_threads(|| run_in_pool(&args, Some(ranks)))
}

fn run_in_pool(args: &RunArgs, ranks: Option<Arc<dyn Communicator>>) -> Result<()> {
    let (scene, search) = args.scene.load()?;
    let root = args
        .out
        .clone()
        .unwrap_or_else(|| ResultDirectory::default_path(&args.scene.scene, SystemTime::now()));
    let root = super::absolute(&root)?;
    let from = args.from.as_deref().map(super::absolute).transpose()?;
    let given = from.as_ref().map(read::surface).transpose()?;
    let waiting = super::Waiting::on("making sheet, effects and laws ready", args.quiet);
    let mut simulation = match &ranks {
        None => Simulation::new(&scene, &search)?,
        Some(ranks) => Simulation::over(&scene, &search, Arc::clone(ranks))?,
    };
    drop(waiting);
    let mut inputs = provenance::inputs(&scene, simulation.plugins());
    if let Some(path) = &from {
        inputs.add("the state", path);
    }
    inputs.outside(&root)?;
    if let Some(surface) = given {
        inspect::start_from(&mut simulation, &scene, surface, args.start_time)?;
    }
    let interrupt = Interrupt::install()?;
    let directory = directory(&root, args.force, ranks.as_deref())?;
    let outcome =
        run_with_progress(args, (&scene, from.as_deref()), &mut simulation, &directory, interrupt);
    let first = ranks.as_ref().is_none_or(|ranks| ranks.rank() == 0);
    let report = super::view::write_report(&root, scene.output.report && first);
    if args.json && first {
        print_standing(&root, &[]);
    }
    let done = outcome?;
    if !args.quiet && !args.json {
        print_summary(&done, &directory);
        print_report_path(report.as_deref());
    }
    match done.ending {
        Ending::Interrupted => Err(Error::Solve(SolveError::Interrupted)),
        _ => Ok(()),
    }
}

/// Prints what the directory of a run or a study says of it, and `more`.
pub(super) fn print_standing(root: &Path, more: &[(&str, serde_json::Value)]) {
    let text = std::fs::read(root.join(Claim::STATUS)).unwrap_or_default();
    let mut about: serde_json::Value = serde_json::from_slice(&text).unwrap_or_default();
    about["directory"] = root.to_string_lossy().into();
    more.iter().for_each(|(key, value)| about[*key] = value.clone());
    say!("{about:#}");
}

/// The directory of this rank: the first one makes it, then the others theirs within it.
fn directory(
    root: &Path,
    force: bool,
    ranks: Option<&dyn Communicator>,
) -> Result<ResultDirectory> {
    let Some(ranks) = ranks else { return Ok(ResultDirectory::prepare(root, force)?) };
    let first = match ranks.rank() {
        0 => Some(ResultDirectory::prepare(root, force)).transpose(),
        _ => Ok(None),
    };
    let first = agreed(Some(ranks), first.map_err(Error::from))?;
    let own = match first {
        Some(first) => Ok(first),
        None => ResultDirectory::prepare(&ranks::root(root, ranks), force),
    };
    agreed(Some(ranks), own.map_err(Error::from))
}

/// The run with its progress; `origin` is the scene, and the state that it starts from.
fn run_with_progress(
    args: &RunArgs,
    origin: (&Scene, Option<&Path>),
    simulation: &mut Simulation,
    directory: &ResultDirectory,
    interrupt: Interrupt,
) -> Result<Summary> {
    let mode = if args.quiet { Mode::Silent } else { Mode::detect() };
    let mut progress = Progress::new(mode, origin.0.time.span.until.get());
    let outcome = run::recorded(origin, simulation, directory, &mut progress, interrupt, &mut []);
    progress.finish();
    if args.quiet {
        simulation.faults.iter().for_each(|fault| super::warn(fault));
    }
    outcome
}

pub(super) fn print_report_path(report: Option<&Path>) {
    if let Some(path) = report {
        say!("{} shows the results in a browser", path.display());
    }
}

pub(super) fn print_summary(done: &Summary, directory: &ResultDirectory) {
    say!("time {}: {}", done.time, done.ending);
    let root = directory.root().display();
    match done.resumable {
        Some(step) if step < done.step => say!(
            "`rumple resume {root}` continues from step {step}, where the last checkpoint is, and computes {} again; \
             `rumple run --from FRAME` begins with the last frame, with other rounding",
            done.step - step
        ),
        Some(step) => say!("`rumple resume {root}` continues from step {step}"),
        None if done.ending == Ending::Interrupted => {
            say!("it cannot be resumed: no checkpoint has been written yet")
        }
        None => {}
    }
    let work = done.spent.work;
    let kinds = [
        (work.iterations, "iteration"),
        (work.newton_iterations, "Newton iteration"),
        (work.right_hand_sides, "right-hand side"),
        (work.factorisations, "factorisation"),
    ];
    let count = |count: u64, what: &str| {
        plural(usize::try_from(count).unwrap_or(usize::MAX), what, &format!("{what}s"))
    };
    let mut counts = vec![format!("{} ({} rejected)", count(work.steps, "step"), work.rejected)];
    counts.extend(kinds.iter().filter(|k| k.0 > 0).map(|(number, what)| count(*number, what)));
    say!("{}", counts.join(", "));
    // The two last steps before an output time share the way.
    let [to_outputs, steps] = done.to_outputs;
    if to_outputs > 0 && 2 * to_outputs >= steps {
        say!(
            "{to_outputs} of {steps} steps end at output times: output.every sets their length, and results change with it \
             within the error that the tolerance allows"
        );
    }
    say!(
        "{:.1} s, of these {:.1} s for the first relaxation and {:.1} s for output",
        done.wall.as_secs_f64(),
        done.start.wall_seconds,
        done.output.as_secs_f64()
    );
    if done.drag_share > 0.0 {
        let percent = 100.0 * done.drag_share;
        say!("the stabilising drag took up {percent:.2} % of the energy supplied, snaps aside");
    }
    for invariant in &done.invariants {
        say!("{invariant}");
    }
    if let Some(text) = done.intersection.and_then(SelfIntersection::words) {
        say!("warning: {text}, at the end");
    }
    if done.frames > 0 {
        let index = directory.pvd();
        let frames = plural(done.frames, "frame", "frames");
        say!("{frames}; open {} in ParaView", index.display());
    } else {
        say!("the species at every step are in {}", directory.ledger().display());
    }
}
