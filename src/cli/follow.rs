//! `rumple follow SCENE --along KEY --to B`: a branch of equilibria.

use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime};

use clap::Args;

use super::{SceneArgs, warn};
use crate::num::plural;
use crate::output::{Interrupt, ResultDirectory};
use crate::run::follow::{Follow, FollowEvent, FollowSummary, Measure, Request};
use crate::run::run::end;
use crate::run::{Error, Result, provenance};
use crate::sheet::read;
use crate::solve::SolveError;

/// Arguments of `follow`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct FollowArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// The key of the scene that is the parameter, as `--set` has it: a load, a pressure, a modulus, a
    /// displacement of pins, a parameter of a law. With `time` it is the time at which ramps and growth are evaluated.
    #[arg(long, value_name = "KEY")]
    along: String,
    /// Its value at the start; by default that of the scene.
    #[arg(long, value_name = "A", allow_hyphen_values = true, value_parser = finite)]
    from: Option<f64>,
    /// The value that the branch is followed towards. It ends where it leaves the range of the two.
    #[arg(long, value_name = "B", allow_hyphen_values = true, value_parser = finite)]
    to: f64,
    /// Least and largest value of a wider range.
    #[arg(long, num_args = 2, value_names = ["LEAST", "LARGEST"], allow_hyphen_values = true, value_parser = finite)]
    within: Option<Vec<f64>>,
    /// Start from a state, an equilibrium or nearly: points are positions. Without it the scene's start is relaxed.
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// Time at which ramps and growth are evaluated; by default the end of the scene's time.
    #[arg(long, value_name = "T", allow_hyphen_values = true, value_parser = finite)]
    time: Option<f64>,
    #[command(flatten)]
    steps: StepArgs,
    /// Follow the other branches at the first N bifurcations as well; 1 if no number is given.
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "1",
          value_parser = clap::value_parser!(u16).range(1..))]
    switch: Option<u16>,
    /// With `--switch`: follow those branches both ways.
    #[arg(long, requires = "switch")]
    both_ways: bool,
    /// What the diagram shows: along-mode, along-load, displacement, mean-x, mean-y, mean-z, height, area, volume,
    /// species (mean of the first one); by default the displacement along the first critical mode with `--switch`, and else that
    /// along the load. The table has all.
    #[arg(long, value_name = "MEASURE")]
    measure: Option<Measure>,
    /// Directory for the results; by default the scene's name with the time.
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace earlier results in that directory.
    #[arg(long)]
    force: bool,
    /// Print how the branch ended as JSON, as status.json has it, with the directory and the folds and bifurcations.
    #[arg(long)]
    json: bool,
    /// Print nothing but errors.
    #[arg(long)]
    quiet: bool,
}

/// How far the steps go.
#[derive(Debug, Args)]
struct StepArgs {
    /// Most steps of a branch.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u16).range(1..))]
    steps: u16,
    /// Arc length of the first step; 1 is the whole range of the key without displacement. If not given 0.02, or the longest
    /// step.
    #[arg(long, value_name = "H", allow_hyphen_values = true, value_parser = positive)]
    first_step: Option<f64>,
    /// Arc length of the longest step.
    #[arg(long, value_name = "H", default_value_t = 0.1, allow_hyphen_values = true, value_parser = positive)]
    longest_step: f64,
    /// Root mean square displacement that counts as much as the whole range of the key; by default a tenth of the square
    /// root of the sheet's area.
    #[arg(long, value_name = "L", allow_hyphen_values = true, value_parser = positive)]
    length: Option<f64>,
}

/// Arc length of the first step, if neither it nor a shorter longest one is given.
const FIRST_STEP: f64 = 0.02;

const EXAMPLES: &str = "\
Examples:
  rumple follow arch.toml --along effect.load.force.per-area[2] --from 0 --to -2e-3 -o arch
  rumple follow strip.toml --along effect.load.force.per-length[0] --to -0.5 --switch -o column
  rumple follow shell.toml --along effect.pressure.value --from 0 --to -1 --measure volume

Written are branch.csv (a row for every point: arc length, key, energy, negative eigenvalues, measures, event), frames
(sheet.pvd; their time is the number of the row) and the diagram in report.html: stable parts solid, unstable
ones dashed, folds and bifurcations marked. Ctrl-C ends after the step with all files complete. Not followed: scenes with contact, constraints or remodelling.";

pub(super) fn run(args: &FollowArgs) -> Result<()> {
    args.scene.with_threads(|| run_in_pool(args))
}

fn run_in_pool(args: &FollowArgs) -> Result<()> {
    let (_, search) = args.scene.load()?;
    let stamp = || ResultDirectory::default_path(&args.scene.scene, SystemTime::now());
    let root = super::absolute(&args.out.clone().unwrap_or_else(stamp))?;
    let given = args.state.as_ref().map(read::surface).transpose()?;
    let mut follow = Follow::new(request(args), &search)?;
    if let Some(surface) = &given {
        follow.take_state(surface)?;
    }
    let mut inputs = provenance::inputs(&follow.scene, follow.simulation.plugins());
    if let Some(path) = &args.state {
        inputs.add("the state", path);
    }
    inputs.outside(&root)?;
    if !args.quiet {
        follow.simulation.notes().iter().for_each(|note| warn(note));
    }
    let interrupt = Interrupt::install()?;
    let directory = ResultDirectory::prepare(&root, args.force)?;
    let mut listener = listener(args.quiet, args.json);
    let mut done = FollowSummary::default();
    let outcome = follow.run(&directory, &mut listener, interrupt).map(|found| {
        done = found;
        format!(
            "{} on {}",
            plural(done.points, "point", "points"),
            plural(done.branches, "branch", "branches")
        )
    });
    let interrupted = matches!(outcome, Err(Error::Solve(SolveError::Interrupted)));
    let ended = end(directory.claim(), outcome);
    if interrupted && !args.quiet {
        warn(&format!(
            "interrupted: the points so far are in {}; --state with the last of their frames, and --from with its number, \
             follow the rest",
            directory.branch().display()
        ));
    }
    let report = super::view::write_report(&root, follow.scene.output.report);
    if args.json {
        super::run::print_standing(&root, &[("events", done.events.clone().into())]);
    }
    ended?;
    if !args.quiet && !args.json {
        print_summary(&done, &directory);
        super::run::print_report_path(report.as_deref());
    }
    Ok(())
}

/// What the command line asks for.
fn request(args: &FollowArgs) -> Request {
    let StepArgs { steps, first_step, longest_step, length } = args.steps;
    Request {
        scene: args.scene.scene.clone(),
        set: args.scene.overrides.clone(),
        along: args.along.clone(),
        from: args.from,
        to: args.to,
        within: args.within.as_ref().and_then(|ends| Some([*ends.first()?, *ends.get(1)?])),
        time: args.time,
        steps: steps.into(),
        first_step: first_step.unwrap_or(FIRST_STEP.min(longest_step)),
        longest_step,
        length,
        switch: args.switch.unwrap_or(0).into(),
        both_ways: args.both_ways,
        measure: args.measure,
    }
}

/// Prints events, and progress every [`PROGRESS_INTERVAL`].
fn listener(quiet: bool, json: bool) -> impl FnMut(FollowEvent<'_>) {
    let mut last = Instant::now();
    move |news| match news {
        _ if quiet => {}
        FollowEvent::Event(text) if json => warn(text),
        FollowEvent::Event(text) => say!("{text}"),
        FollowEvent::Step(text) if last.elapsed() >= PROGRESS_INTERVAL => {
            last = Instant::now();
            warn(text);
        }
        FollowEvent::Step(_) => {}
    }
}

/// Least time between two lines of progress.
const PROGRESS_INTERVAL: Duration = Duration::from_secs(5);

fn print_summary(done: &FollowSummary, directory: &ResultDirectory) {
    say!(
        "{} on {}, {}",
        plural(done.points, "point", "points"),
        plural(done.branches, "branch", "branches"),
        plural(done.events.len(), "fold or bifurcation", "folds and bifurcations")
    );
    say!("table {}", directory.branch().display());
    // A point has no frames.
    let index = directory.pvd();
    if index.is_file() {
        say!("open {} in ParaView", index.display());
    }
}

pub(super) fn finite(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| number.is_finite());
    number.ok_or_else(|| format!("{text:?} is not a number"))
}

fn positive(text: &str) -> Result<f64, String> {
    finite(text)
        .ok()
        .filter(|number| *number > 0.0)
        .ok_or_else(|| format!("{text:?} is not a number above 0"))
}
