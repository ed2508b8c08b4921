//! Begins a study or resumes it.

use std::ffi::OsString;
use std::fs;
use std::path::Path;

use super::{Pool, exceeded_time_limit};
use crate::output::{Claim, Interrupt, OutputError, ResultDirectory};
use crate::run::run::end;
use crate::run::{Error, Result, Simulation, provenance};
use crate::scene::Scene;
use crate::solve::SolveError;
use crate::study::directory::{names, refuse, remove_run};
use crate::study::gather::{MemberStatus, counted, counts, gather, status};
use crate::study::plan::Plan;
use crate::study::{Purpose, accuracy, compare, sweep};

/// How members are run.
#[derive(Debug, Clone, Default)]
pub struct Settings {
    /// Most members at once; as many as there are cores for, if not given.
    pub jobs: Option<usize>,
    /// Whether members that failed are run again.
    pub retry_failed: bool,
    /// Whether an earlier study in the directory is replaced.
    pub force: bool,
    /// Whether the plan is written and nothing is run: members are run by themselves, as tasks of an array job.
    pub plan_only: bool,
}

/// Runs of many members, and what is made of them.
pub struct Runs<'a> {
    /// What for.
    pub purpose: Purpose,
    /// How.
    pub settings: Settings,
    /// Command of a member in a process of its own ([`member`](fn@super::member)), to which the directory of the
    /// study and the number of the member are appended.
    pub member: Vec<OsString>,
    /// Called with a line of text for everything that happens.
    pub happens: &'a dyn Fn(&str),
    /// Called with lines of results.
    pub say: &'a dyn Fn(&str),
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
        Ok(first)
    }

    /// Makes room in `root` for `plan`, and the directory where there is none. A study that is there is resumed if
    /// it is the same, and is removed if settings say so; anything else that is there is refused.
    ///
    /// # Errors
    /// A directory that is refused, and why; from the operating system.
    pub fn open(&self, plan: &Plan, root: &Path) -> Result<Claim> {
        let force = self.settings.force;
        check(root, plan, force)?;
        fs::create_dir_all(root).map_err(OutputError::write(root))?;
        let claim = Claim::take(root)?;
        // Another study may have been there until just now.
        if check(root, plan, force)? && force {
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
        let prepared = self.purpose.prepare((plan, root), self.say, interrupt);
        let outcome = prepared.and_then(|()| match self.settings.plan_only {
            true => Ok(self.planned(plan, root)),
            false => self.here(plan, root, interrupt),
        });
        end(claim, outcome)
    }

    fn show(&self, plan: &Plan, root: &Path) -> Result<String> {
        self.purpose.show(plan, root, self.say, true)
    }

    /// The members that are to be run: those that are not complete; those that failed only if asked for, or
    /// given up for a time limit that is longer now.
    fn left(&self, plan: &Plan, root: &Path) -> Vec<usize> {
        let longer = |number: usize, reason: &str| {
            let now = plan.members[number].limit;
            exceeded_time_limit(reason).is_some_and(|then| now.is_none_or(|now| now > then))
        };
        let is_open = |number: &usize| match status(plan, &plan.directory(root, *number)) {
            (MemberStatus::Complete, _) => false,
            (MemberStatus::Failed, why) => self.settings.retry_failed || longer(*number, &why),
            _ => true,
        };
        (0..plan.members.len()).filter(is_open).collect()
    }

    /// Says how the members are run by themselves.
    fn planned(&self, plan: &Plan, root: &Path) -> String {
        let (count, root) = (plan.members.len(), root.display());
        let numbers = match count {
            1 => "member 0".to_owned(),
            _ => format!("members 0 to {}", count.saturating_sub(1)),
        };
        (self.say)(&format!("{numbers}: rumple sweep member {root} NUMBER runs one"));
        format!("planned: {}", counted(count))
    }

    /// Runs the members as child processes; says how many came to their end.
    fn here(&self, plan: &Plan, root: &Path, interrupt: Interrupt) -> Result<String> {
        let members = self.left(plan, root);
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let usual = (cores / usize::from(plan.threads.max(1))).max(1);
        let jobs = self.settings.jobs.unwrap_or(usual);
        if !members.is_empty() {
            let all = gather(plan, root);
            let count = members.len();
            // Of those that have not begun it says nothing more.
            let standing =
                if count == all.len() { String::new() } else { format!("{}; ", counts(&all)) };
            let (jobs, members) = (jobs.min(count), counted(count));
            (self.happens)(&format!("{standing}running {members}, at most {jobs} at a time"));
        }
        let mut pool = Pool { plan, root, command: &self.member, jobs, happens: self.happens };
        pool.run(&members, interrupt)?;
        if interrupt.requested() {
            let _ = self.show(plan, root);
            return Err(Error::Solve(SolveError::Interrupted));
        }
        self.show(plan, root)
    }
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
    Ok(true)
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
    let _ = fs::remove_dir(members);
    let ours = [Plan::FILE, ResultDirectory::PLOTS, ResultDirectory::REPORT];
    let tables = [sweep::FILES, &accuracy::Study::FILES, &[compare::TABLE, compare::PAGE]].concat();
    // Of earlier versions.
    let ours = [&ours[..], &tables, &["pictures.png", "accuracy.html", "sweep.sbatch"]].concat();
    for name in names(root)? {
        let plot = name.starts_with("plot-") && (name.ends_with(".svg") || name.ends_with(".png"));
        if plot || ours.contains(&name.as_str()) {
            let path = root.join(name);
            fs::remove_file(&path).map_err(OutputError::write(&path))?;
        }
    }
    Ok(())
}
