//! Begins a study or resumes it: here, or through Slurm.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::{HowArgs, PlanArgs, counts, gathered};
use crate::cli::output_directory::{claim, names, refuse, remove_file, remove_run};
use crate::cli::{SceneArgs, end, warn};
use crate::kinetics::Search;
use crate::output::{Claim, Interrupt, ResultDirectory};
use crate::run::{Error, Result, Simulation};
use crate::scene::Scene;
use crate::solve::SolveError;
use crate::study::accuracy::Study;
use crate::study::gather::{MemberStatus, gather, status};
use crate::study::plan::{Axis, Plan, seeds};
use crate::study::run::slurm::{self, Array};
use crate::study::run::{Pool, available, limit_of};
use crate::study::sweep::{PAGE, PICTURES, PLOT, TABLE, write_tables};

pub(super) fn run(args: &PlanArgs) -> Result<()> {
    let scene = &args.scene;
    let mut plan = Plan::new(&scene.scene, &scene.overrides, axes(args)?)?;
    plan.level = args.level;
    made_by(&mut plan, scene)?;
    let (how, check, prepare) = (&args.how, &|_: &Plan| Ok(()), &|_: &Path| Ok(()));
    let gather = &|plan: &Plan, root: &Path, quiet| gathered(plan, root, quiet, true);
    Runs { command: "sweep", how, jobs: None, check, prepare, gather }.on(plan)
}

/// Gives members what the command line says of threads and plugins.
pub(in crate::cli) fn made_by(plan: &mut Plan, scene: &SceneArgs) -> Result<()> {
    // Refused here where plugins cannot be isolated.
    crate::cli::isolation(scene.isolate, scene.plugin_limit)?;
    plan.isolate = scene.isolate;
    let directories = Search::from_environment(&scene.plugin_path).directories().to_vec();
    plan.threads = scene.threads.unwrap_or(1);
    plan.plugin_limit = scene.plugin_limit;
    plan.plugin_path =
        directories.iter().map(|path| crate::cli::absolute(path)).collect::<Result<_>>()?;
    Ok(())
}

/// Runs of many members, and what is made of them.
pub(in crate::cli) struct Runs<'a> {
    /// The command that makes them.
    pub(in crate::cli) command: &'a str,
    /// Options of the command line.
    pub(in crate::cli) how: &'a HowArgs,
    /// Default count of simultaneous runs; as many as there are cores for, if not given.
    pub(in crate::cli) jobs: Option<usize>,
    /// Refuses a plan before anything is written.
    pub(in crate::cli) check: &'a dyn Fn(&Plan) -> Result<()>,
    /// Prepares the directory before any is run.
    pub(in crate::cli) prepare: &'a dyn Fn(&Path) -> Result<()>,
    /// Gathers what there is of a plan in a directory, in silence or not; says how it stands.
    pub(in crate::cli) gather: &'a dyn Fn(&Plan, &Path, bool) -> Result<String>,
}

impl Runs<'_> {
    /// Begins `plan`, or resumes it.
    pub(in crate::cli) fn on(&self, mut plan: Plan) -> Result<()> {
        let root = self.how.out.clone().unwrap_or_else(|| {
            let stem = plan.scene.file_stem().unwrap_or("scene".as_ref()).to_string_lossy();
            PathBuf::from(format!("{stem}-{}", self.command))
        });
        let root = crate::cli::absolute(&root)?;
        let program = std::env::current_exe().map_err(|error| {
            Error::Refused(format!("the program does not find itself: {error}"))
        })?;
        // What is wrong with every member is wrong with the first.
        let first = plan.scene(0)?;
        let simulation = Simulation::new(&first, &plan.search())?;
        crate::cli::inputs(&first, simulation.plugins()).outside(&root)?;
        if !self.how.quiet {
            simulation.notes().iter().for_each(|note| warn(note));
        }
        drop(simulation);
        plan.seal()?;
        (self.check)(&plan)?;
        let interrupt = Interrupt::install()?;
        let claim = make_room(&root, &plan, self.how.force)?;
        let outcome = (self.prepare)(&root).and_then(|()| match self.how.slurm {
            true => self.submit(&plan, &root, program),
            false => self.here(&plan, &root, program, interrupt),
        });
        let ended = end(&claim, outcome);
        // Before the members of an array job have run there is nothing to be seen.
        crate::cli::view::report(&root, first.output.report && !self.how.slurm);
        ended
    }

    /// The members that are to be run: those that are not complete; those that failed only if asked for, or
    /// given up for a time limit that is longer now.
    fn open(&self, plan: &Plan, root: &Path) -> Vec<usize> {
        let longer = |number: usize, reason: &str| {
            let now = plan.members[number].limit;
            limit_of(reason).is_some_and(|then| now.is_none_or(|now| now > then))
        };
        let is_open = |number: &usize| match status(plan, &plan.directory(root, *number)) {
            (MemberStatus::Complete, _) => false,
            (MemberStatus::Failed, why) => self.how.retry_failed || longer(*number, &why),
            _ => true,
        };
        (0..plan.members.len()).filter(is_open).collect()
    }

    /// Submits the members as an array job; says what was done.
    fn submit(&self, plan: &Plan, root: &Path, program: PathBuf) -> Result<String> {
        let members = self.open(plan, root);
        if members.is_empty() {
            return (self.gather)(plan, root, self.how.quiet);
        }
        let options = &self.how.slurm_option;
        let array = Array { plan, root, program, jobs: self.how.jobs.map(usize::from), options };
        let script = array.write(&members)?;
        let command = if self.command == "sweep" { "sweep collect" } else { self.command };
        let (collect, tasks) = (format!("rumple {command} {}", root.display()), members.len());
        let (text, done) = if self.how.no_submit {
            let script = script.display();
            let text = format!("{script}: {tasks} tasks; submit it with sbatch, then {collect}");
            (text, "the job script is written".to_owned())
        } else {
            let job = array.submit(&script)?;
            let text = format!("job {job}: {tasks} tasks; gather what there is with {collect}");
            (text, format!("submitted to Slurm as job {job}"))
        };
        if !self.how.quiet {
            say!("{text}");
        }
        Ok(done)
    }

    /// Runs the members as child processes; says how many came to their end.
    fn here(
        &self,
        plan: &Plan,
        root: &Path,
        program: PathBuf,
        interrupt: Interrupt,
    ) -> Result<String> {
        let members = self.open(plan, root);
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let usual = self.jobs.unwrap_or((cores / usize::from(plan.threads)).max(1));
        let jobs = self.how.jobs.map_or(usual, usize::from);
        let memory = self.how.memory.or_else(available);
        if !self.how.quiet && !members.is_empty() {
            let all = gather(plan, root, false);
            let count = members.len();
            // Of those that have not begun it says nothing more.
            let standing =
                if count == all.len() { String::new() } else { format!("{}; ", counts(&all)) };
            let (jobs, noun) = (jobs.min(count), if count == 1 { "member" } else { "members" });
            warn(&format!("{standing}running {count} {noun}, at most {jobs} at a time"));
        }
        let (mut written, mut took, mut broken) = (Instant::now(), Duration::ZERO, None);
        let mut happens = |text: String, ended: bool| {
            // The tables of thousands of members take a while.
            if ended && written.elapsed() >= SELDOM * took {
                let began = Instant::now();
                let outcome = write_tables(plan, &gather(plan, root, false), root);
                // The first failure to write is the one to report, when all has ended.
                broken = broken.take().or(outcome.err());
                (written, took) = (Instant::now(), began.elapsed());
            }
            if !self.how.quiet {
                warn(&text);
            }
        };
        let mut pool = Pool { plan, root, program, jobs, memory, happens: &mut happens };
        pool.run(&members, interrupt)?;
        match broken {
            Some(error) => Err(error),
            None if interrupt.requested() => {
                let _ = (self.gather)(plan, root, self.how.quiet);
                Err(Error::Solve(SolveError::Interrupted))
            }
            None => (self.gather)(plan, root, self.how.quiet),
        }
    }
}

/// The keys that are varied; seeds last.
fn axes(args: &PlanArgs) -> Result<Vec<Axis>> {
    let axes = args.over.iter().map(|text| Axis::parse(text).map_err(Error::Refused));
    let mut axes = axes.collect::<Result<Vec<_>>>()?;
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

/// Tables are written after so many times the time that it takes, at the earliest.
const SELDOM: u32 = 20;

/// Makes room in `root` for `plan`, and the directory where there is none. A sweep that is there is resumed if
/// it is the same, and is removed with `force`; anything else that is there is refused.
fn make_room(root: &Path, plan: &Plan, force: bool) -> Result<Claim> {
    let (claim, found) = claim(root, || check(root, plan, force))?;
    if found && force {
        clear(root)?;
    }
    plan.write(root)?;
    claim.begin()?;
    Ok(claim)
}

/// Whether there is a sweep in `root`; refuses one that cannot be resumed.
fn check(root: &Path, plan: &Plan, force: bool) -> Result<bool> {
    let names = names(root)?;
    let Some(earlier) = Plan::read(root)? else {
        return match names.iter().all(|name| name == Claim::LOCK || name == Claim::STATUS) {
            true => Ok(false),
            false => refuse(root, "is not empty and holds no sweep; choose another with --out"),
        };
    };
    if !force {
        plan.check_resumable(&earlier, root)?;
    } else if root.is_symlink() || root.join(Plan::MEMBERS).is_symlink() {
        let message = "is a link, or has one in it, and nothing is removed through a link; give the \
                       directory itself";
        return refuse(root, message);
    }
    match slurm::queued(root) {
        None => Ok(true),
        Some(job) => {
            let how = format!("wait until that has ended, or end it with scancel {job}");
            refuse(root, format!("Slurm has job {job} for it: {how}"))
        }
    }
}

/// Removes what a sweep wrote; anything else that is there stays.
fn clear(root: &Path) -> Result<()> {
    let members = root.join(Plan::MEMBERS);
    for path in names(&members)?.iter().map(|name| members.join(name)) {
        if path.is_dir() && !path.is_symlink() {
            remove_run(&path)?;
        } else if path.extension().is_some_and(|e| e == "log") {
            let _ = fs::remove_file(path);
        }
    }
    let logs = root.join(slurm::LOGS);
    if !logs.is_symlink() {
        for name in names(&logs)? {
            let _ = fs::remove_file(logs.join(name));
        }
        let _ = fs::remove_dir(logs);
    }
    let _ = fs::remove_dir(members);
    let ours = [Plan::FILE, TABLE, PAGE, PICTURES, slurm::SCRIPT, ResultDirectory::REPORT];
    let ours = [&ours[..], &Study::FILES[..]].concat();
    for name in names(root)? {
        let plot = name.starts_with(PLOT) && (name.ends_with(".svg") || name.ends_with(".png"));
        if plot || ours.contains(&name.as_str()) {
            remove_file(&root.join(name))?;
        }
    }
    Ok(())
}
