//! Begins a study or resumes it: here, or through Slurm.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::slurm::{self, Array};
use super::{Pool, available, limit_of};
use crate::output::{Claim, Interrupt, ResultDirectory};
use crate::run::run::end;
use crate::run::{Error, Result, Simulation, provenance};
use crate::scene::Scene;
use crate::solve::SolveError;
use crate::study::accuracy::Study;
use crate::study::directory::{claim, names, refuse, remove_file, remove_run};
use crate::study::gather::{MemberStatus, counts, gather, status};
use crate::study::plan::Plan;
use crate::study::sweep::{PAGE, STATISTICS, TABLE, write_tables};

/// How members are run.
#[derive(Debug, Clone, Default)]
pub struct Settings {
    /// Most members at once; as many as there are cores for, if not given. Never more than fit into memory.
    pub jobs: Option<usize>,
    /// Bytes that all members together may take; most of what is free, if not given.
    pub memory: Option<u64>,
    /// Whether members that failed are run again.
    pub retry_failed: bool,
    /// Whether an earlier study in the directory is replaced.
    pub force: bool,
    /// Slurm runs them, if given.
    pub slurm: Option<SlurmSettings>,
}

/// How Slurm runs members.
#[derive(Debug, Clone)]
pub struct SlurmSettings {
    /// This program, its full path.
    pub program: PathBuf,
    /// More options of sbatch.
    pub options: Vec<String>,
    /// Whether the job script is submitted.
    pub submit: bool,
}

/// Runs of many members, and what is made of them.
pub struct Runs<'a> {
    /// The command that makes them.
    pub command: &'a str,
    /// How.
    pub settings: Settings,
    /// Command of a member in a process of its own ([`member`](fn@super::member)), to which the directory of the
    /// study and the number of the member are appended.
    pub member: Vec<OsString>,
    /// Refuses a plan before anything is written.
    pub check: &'a dyn Fn(&Plan) -> Result<()>,
    /// Prepares the directory before any is run.
    pub prepare: &'a dyn Fn(&Path) -> Result<()>,
    /// Gathers what there is of a plan in a directory; says how it stands.
    pub gather: &'a dyn Fn(&Plan, &Path) -> Result<String>,
    /// Called with a line of text for everything that happens.
    pub happens: &'a dyn Fn(&str),
    /// Called with the text on an array job.
    pub submitted: &'a dyn Fn(&str),
}

impl Runs<'_> {
    /// Checks `plan`, which is to be run in `root`, and takes its fingerprints; the scene of its first member.
    ///
    /// # Errors
    /// Whatever the first member cannot be set up for; inputs that lie in `root`.
    pub fn seal(&self, plan: &mut Plan, root: &Path) -> Result<Scene> {
        // What is wrong with every member is wrong with the first.
        let first = plan.scene(0)?;
        let simulation = Simulation::new(&first, &plan.search())?;
        provenance::inputs(&first, simulation.plugins()).outside(root)?;
        simulation.notes().iter().for_each(|note| (self.happens)(note));
        drop(simulation);
        plan.seal()?;
        (self.check)(plan)?;
        Ok(first)
    }

    /// Makes room in `root` for `plan`, and the directory where there is none. A study that is there is resumed if
    /// it is the same, and is removed if settings say so; anything else that is there is refused.
    ///
    /// # Errors
    /// A directory that is refused, and why; from the operating system.
    pub fn open(&self, plan: &Plan, root: &Path) -> Result<Claim> {
        let force = self.settings.force;
        let (claim, found) = claim(root, || check(root, plan, force))?;
        if found && force {
            clear(root)?;
        }
        plan.write(root)?;
        claim.begin()?;
        Ok(claim)
    }

    /// Begins `plan` in `root`, which `claim` has [opened](Self::open), or resumes it.
    ///
    /// # Errors
    /// Members that do not come to their end, as the command has it; an interruption.
    pub fn on(
        &self,
        plan: &Plan,
        (root, claim): (&Path, &Claim),
        interrupt: Interrupt,
    ) -> Result<()> {
        let outcome = (self.prepare)(root).and_then(|()| match &self.settings.slurm {
            Some(slurm) => self.submit(plan, root, slurm),
            None => self.here(plan, root, interrupt),
        });
        end(claim, outcome)
    }

    /// The members that are to be run: those that are not complete; those that failed only if asked for, or
    /// given up for a time limit that is longer now.
    fn left(&self, plan: &Plan, root: &Path) -> Vec<usize> {
        let longer = |number: usize, reason: &str| {
            let now = plan.members[number].limit;
            limit_of(reason).is_some_and(|then| now.is_none_or(|now| now > then))
        };
        let is_open = |number: &usize| match status(plan, &plan.directory(root, *number)) {
            (MemberStatus::Complete, _) => false,
            (MemberStatus::Failed, why) => self.settings.retry_failed || longer(*number, &why),
            _ => true,
        };
        (0..plan.members.len()).filter(is_open).collect()
    }

    /// Submits the members as an array job; says what was done.
    fn submit(&self, plan: &Plan, root: &Path, slurm: &SlurmSettings) -> Result<String> {
        let members = self.left(plan, root);
        if members.is_empty() {
            return (self.gather)(plan, root);
        }
        let SlurmSettings { program, options, submit } = slurm;
        let array =
            Array { plan, root, program: program.clone(), jobs: self.settings.jobs, options };
        let script = array.write(&members)?;
        let command = if self.command == "sweep" { "sweep collect" } else { self.command };
        let (collect, tasks) = (format!("rumple {command} {}", root.display()), members.len());
        let (text, done) = if *submit {
            let job = array.submit(&script)?;
            let text = format!("job {job}: {tasks} tasks; gather what there is with {collect}");
            (text, format!("submitted to Slurm as job {job}"))
        } else {
            let script = script.display();
            let text = format!("{script}: {tasks} tasks; submit it with sbatch, then {collect}");
            (text, "the job script is written".to_owned())
        };
        (self.submitted)(&text);
        Ok(done)
    }

    /// Runs the members as child processes; says how many came to their end.
    fn here(&self, plan: &Plan, root: &Path, interrupt: Interrupt) -> Result<String> {
        let members = self.left(plan, root);
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let usual = (cores / usize::from(plan.threads.max(1))).max(1);
        let jobs = self.settings.jobs.unwrap_or(usual);
        let memory = self.settings.memory.or_else(available);
        if !members.is_empty() {
            let all = gather(plan, root);
            let count = members.len();
            // Of those that have not begun it says nothing more.
            let standing =
                if count == all.len() { String::new() } else { format!("{}; ", counts(&all)) };
            let (jobs, noun) = (jobs.min(count), if count == 1 { "member" } else { "members" });
            (self.happens)(&format!("{standing}running {count} {noun}, at most {jobs} at a time"));
        }
        let (mut written, mut took, mut broken) = (Instant::now(), Duration::ZERO, None);
        let mut happens = |text: String, ended: bool| {
            // The tables of thousands of members take a while.
            if ended && written.elapsed() >= TABLE_INTERVAL_FACTOR * took {
                let began = Instant::now();
                let outcome = write_tables(plan, &gather(plan, root), root);
                // The first failure to write is the one to report, when all has ended.
                broken = broken.take().or(outcome.err());
                (written, took) = (Instant::now(), began.elapsed());
            }
            (self.happens)(&text);
        };
        let command = &self.member;
        let mut pool = Pool { plan, root, command, jobs, memory, happens: &mut happens };
        pool.run(&members, interrupt)?;
        match broken {
            Some(error) => Err(error),
            None if interrupt.requested() => {
                let _ = (self.gather)(plan, root);
                Err(Error::Solve(SolveError::Interrupted))
            }
            None => (self.gather)(plan, root),
        }
    }
}

/// Tables are written after so many times the time that it takes, at the earliest.
const TABLE_INTERVAL_FACTOR: u32 = 20;

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
    match slurm::active_job(root) {
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
    let ours = [Plan::FILE, TABLE, STATISTICS, PAGE, ResultDirectory::PLOTS, slurm::SCRIPT];
    let old = ["pictures.png", "accuracy.html"];
    let ours = [&ours[..], &old, &[ResultDirectory::REPORT], &Study::FILES[..]].concat();
    for name in names(root)? {
        // Of earlier versions.
        let plot = name.starts_with("plot-") && (name.ends_with(".svg") || name.ends_with(".png"));
        if plot || ours.contains(&name.as_str()) {
            remove_file(&root.join(name))?;
        }
    }
    Ok(())
}
