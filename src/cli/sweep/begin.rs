//! Begins a sweep, or goes on with it: here, or through Slurm.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::{PlanArgs, counts, outcome, report, room};
use crate::cli::warn;
use crate::kinetics::Search;
use crate::output::plot::label;
use crate::output::{Claim, Interrupt, RunStatus, interrupt};
use crate::run::{Error, Result, Simulation};
use crate::scene::Scene;
use crate::solve::SolveError;
use crate::study::sweep::slurm::Array;
use crate::study::sweep::{
    Axis, Event, MemberStatus, Plan, Pool, available, gather, seeds, status, write, write_tables,
};

pub(super) fn run(args: &PlanArgs) -> Result<()> {
    let scene = &args.scene;
    crate::cli::watchdog::start(scene.plugin_limit);
    let directories = Search::from_environment(&scene.plugin_path).directories().to_vec();
    let mut plan = Plan::new(&scene.scene, &scene.overrides, axes(args)?)?;
    plan.level = args.level;
    plan.threads = scene.threads.unwrap_or(1);
    plan.plugin_limit = scene.plugin_limit;
    plan.plugin_path =
        directories.iter().map(|path| crate::cli::absolute(path)).collect::<Result<_>>()?;
    let root = args.out.clone().unwrap_or_else(|| {
        let stem = scene.scene.file_stem().unwrap_or("scene".as_ref()).to_string_lossy();
        PathBuf::from(format!("{stem}-sweep"))
    });
    // A plugin may change the working directory.
    let root = crate::cli::absolute(&root)?;
    let program = std::env::current_exe()
        .map_err(|error| Error::Refused(format!("the program does not find itself: {error}")))?;
    {
        // What is wrong with every member is wrong with the first.
        let first = plan.scene(0)?;
        let simulation = Simulation::new(&first, &plan.search())?;
        crate::cli::inputs(&first, simulation.plugins()).outside(&root)?;
        if !args.quiet {
            simulation.notes().iter().for_each(|note| warn(note));
        }
    }
    plan.seal()?;
    let interrupt = Interrupt::install()?;
    let claim = room::make(&root, &plan, args.force)?;
    let work = if args.slurm { submit } else { here };
    let outcome = work(args, &plan, &root, program, interrupt);
    let (standing, reason) = match &outcome {
        Ok(reason) => (RunStatus::Complete, reason.clone()),
        Err(Error::Solve(SolveError::Interrupted)) => {
            (RunStatus::Interrupted, interrupt::reason().to_owned())
        }
        Err(error) => (RunStatus::Failed, error.to_string()),
    };
    let ended = Claim::end(&claim, standing, &reason);
    outcome?;
    Ok(ended?)
}

/// The keys that are varied; seeds last.
fn axes(args: &PlanArgs) -> Result<Vec<Axis>> {
    let mut axes: Vec<Axis> = Vec::new();
    for text in &args.over {
        axes.push(Axis::parse(text).map_err(Error::Refused)?);
    }
    if let Some(count) = args.seeds {
        let first: Vec<String> = axes.iter().flat_map(|axis| axis.overrides(0)).collect();
        let scene = Scene::varied(&args.scene.scene, &args.scene.overrides, &first)?;
        let paths = seeds(&scene)?;
        if paths.is_empty() {
            let message = "--seeds: nothing in the scene is random; give sheet.imperfection, or a \
                           random start of a species";
            return Err(Error::Refused(message.into()));
        }
        axes.push(Axis::seeds(paths, count.into()));
    }
    Ok(axes)
}

/// The members that are to be run: those that are not complete, those that failed only if asked for.
fn open(args: &PlanArgs, plan: &Plan, root: &Path) -> Vec<usize> {
    let is_open = |number: &usize| match status(&plan.directory(root, *number)).0 {
        MemberStatus::Complete => false,
        MemberStatus::Failed => args.retry_failed,
        _ => true,
    };
    (0..plan.members.len()).filter(is_open).collect()
}

/// Submits the members as an array job; says what was done.
fn submit(
    args: &PlanArgs,
    plan: &Plan,
    root: &Path,
    program: PathBuf,
    _: Interrupt,
) -> Result<String> {
    let members = open(args, plan, root);
    if members.is_empty() {
        return gathered(args, plan, root);
    }
    let options = &args.slurm_option;
    let array = Array { plan, root, program, jobs: args.jobs.map(usize::from), options };
    let script = array.write(&members)?;
    let tell = |text: &str| {
        if !args.quiet {
            say!("{text}");
        }
    };
    if args.no_submit {
        tell(&format!(
            "{}: {} tasks; submit it with sbatch, then rumple sweep collect {}",
            script.display(),
            members.len(),
            root.display()
        ));
        return Ok("the job script is written".into());
    }
    let job = array.submit(&script)?;
    tell(&format!(
        "job {job}: {} tasks; gather what there is with rumple sweep collect {}",
        members.len(),
        root.display()
    ));
    Ok(format!("submitted to Slurm as job {job}"))
}

/// Runs the members as child processes; says how many came to their end.
fn here(
    args: &PlanArgs,
    plan: &Plan,
    root: &Path,
    program: PathBuf,
    interrupt: Interrupt,
) -> Result<String> {
    let members = open(args, plan, root);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = args.jobs.map_or((cores / usize::from(plan.threads)).max(1), usize::from);
    let memory = args.memory.or_else(available);
    let pool = Pool { plan, root, program, jobs, memory };
    if !args.quiet && !members.is_empty() {
        warn(&format!(
            "{}; {} to run, {} at once at most",
            counts(&gather(plan, root, false)),
            members.len(),
            jobs.min(members.len())
        ));
    }
    let (mut ended, mut broken) = (0, None);
    let (mut written, mut took) = (Instant::now(), Duration::ZERO);
    let mut happens = |event: &Event| {
        if matches!(event, Event::Ended { .. }) {
            ended += 1;
            // The tables of thousands of members take a while.
            if written.elapsed() >= SELDOM * took {
                let began = Instant::now();
                let outcome = write_tables(plan, &gather(plan, root, false), root);
                // The first failure to write is the one to report, when all has ended.
                broken = broken.take().or(outcome.err());
                (written, took) = (Instant::now(), began.elapsed());
            }
        }
        if !args.quiet {
            warn(&said(plan, event, ended, members.len()));
        }
    };
    pool.run(&members, interrupt, &mut happens)?;
    match broken {
        Some(error) => Err(error),
        None if interrupt.requested() => {
            let _ = gathered(args, plan, root);
            Err(Error::Solve(SolveError::Interrupted))
        }
        None => gathered(args, plan, root),
    }
}

/// Tables are written after so many times the time that it takes, at the earliest.
const SELDOM: u32 = 20;

/// Gathers everything; fails if members did.
fn gathered(args: &PlanArgs, plan: &Plan, root: &Path) -> Result<String> {
    let found = gather(plan, root, true);
    write(plan, &found, root)?;
    report(plan, &found, root, args.quiet);
    outcome(&found, true)?;
    Ok(counts(&found))
}

/// What happens, in a line.
fn said(plan: &Plan, event: &Event, ended: usize, all_members: usize) -> String {
    let megabytes = |bytes: &u64| bytes.div_ceil(1_000_000);
    match event {
        Event::Begun { member, running } => {
            format!("{}: begun, {running} at once", plan.name(*member))
        }
        Event::Ended { member, status, reason, seconds } => {
            let first = reason.lines().next().unwrap_or_default();
            let name = plan.name(*member);
            format!("[{ended}/{all_members}] {name}: {status} after {seconds:.1} s: {first}")
        }
        Event::Waits { member, needs, left } => format!(
            "{}: waits for memory: it needs about {} MB, {} MB are left",
            plan.name(*member),
            megabytes(needs),
            megabytes(left)
        ),
        Event::Going { running } => {
            let time = |(member, time): &(usize, Option<f64>)| {
                let until =
                    plan.until(*member).map_or(String::new(), |t| format!(" of {}", label(t)));
                let time =
                    time.map_or("at its start".into(), |t| format!("t = {}{until}", label(t)));
                format!("{}: {time}", plan.name(*member))
            };
            let all: Vec<String> = running.iter().map(time).collect();
            format!("[{ended}/{all_members}] {}", all.join("; "))
        }
        Event::Large { member, needs } => format!(
            "{}: needs about {} MB, more than there is; it runs alone",
            plan.name(*member),
            megabytes(needs)
        ),
    }
}
