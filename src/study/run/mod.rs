//! Runs of the members of a study: each in a process of its own, several at a time.

mod begin;
mod member;
mod pool;
mod time_limit;

use std::collections::BTreeMap;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

pub use self::begin::{Runs, Settings};
pub use self::member::member;
pub use self::pool::Pool;
use self::time_limit::{TimeLimit, exceeded_time_limit};
use super::gather::states::StateFile;
use super::gather::{MemberStatus, measure, open_measures, status};
use super::plan::Plan;
use crate::kinetics::PluginSearch;
use crate::model::Evaluation;
use crate::output::{Claim, Interrupt, Ledger, Progress, ResultDirectory};
use crate::run::resume::{Resumed, resume};
use crate::run::run::{self, Summary};
use crate::run::{Error, Observer, Result, Simulation, StepInfo};

/// Observer that writes what a study keeps of a member at every output time: its state where the study
/// compares fields, a row of measures.
struct MemberRecord {
    level: Option<f64>,
    measures: Ledger,
    states: Option<StateFile>,
}

impl Observer for MemberRecord {
    fn observe(&mut self, at: &mut Evaluation<'_>, info: &StepInfo<'_>) -> Result<()> {
        if !info.frame {
            return Ok(());
        }
        if let Some(states) = &mut self.states {
            states.append(at.state())?;
        }
        let measures = measure(at, self.level)?;
        Ok(self.measures.append(&measures.row(at.state().step))?)
    }
}

impl MemberRecord {
    /// Of a member in `directory`, of whose results those of the times `kept` stay.
    fn open(plan: &Plan, directory: &ResultDirectory, kept: &[f64]) -> Result<Self> {
        let file = |name: &str| directory.root().join(name);
        let states = match plan.states {
            true => Some(StateFile::reopen(&file(ResultDirectory::STATES), kept)?),
            false => None,
        };
        let measures = open_measures(&file(ResultDirectory::MEASURES), kept)?;
        Ok(Self { level: plan.level, measures, states })
    }
}

/// Longest time that a member waits for another process that writes to its directory.
const MAX_CLAIM_WAIT: Duration = Duration::from_secs(20);

/// Runs member `number` of the study in `root`. One that is complete is not
/// run; one that was interrupted or killed is resumed from its checkpoint. Any other results are replaced.
///
/// # Errors
/// A scene or a file that is not the one that was planned; an error of the run.
pub fn run(
    plan: &Plan,
    root: &Path,
    number: usize,
    progress: &mut Progress,
    interrupt: Interrupt,
) -> Result<Option<Summary>> {
    let Some(point) = plan.members.get(number) else {
        let message = format!("no member {number}: there are {}, from 0", plan.members.len());
        return Err(Error::Refused(message));
    };
    let path = plan.directory(root, number);
    wait_for_others(&path, interrupt);
    if status(plan, &path).0 == MemberStatus::Complete {
        return Ok(None);
    }
    if plan.fingerprint(number, &mut BTreeMap::new())? != point.fingerprint {
        return Err(Error::Refused(plan.difference(number, root)?));
    }
    let search = plan.search();
    let mut limit = TimeLimit::watch(point.limit, interrupt);
    if let Some((directory, mut resumed)) = continued(plan, &path, &search) {
        // Results up to the checkpoint are kept.
        let mut record = MemberRecord::open(plan, &directory, resumed.checkpoint.frame_times())?;
        let others: &mut [&mut dyn Observer] = &mut [&mut limit, &mut record];
        return run::continued(&mut resumed, &directory, progress, interrupt, others).map(Some);
    }
    let scene = plan.scene(number)?;
    let directory = ResultDirectory::prepare(&path, true)?;
    let summary = run::with_status(&directory, || {
        let mut simulation = Simulation::new(&scene, &search)?;
        let mut record = MemberRecord::open(plan, &directory, &[])?;
        let others: &mut [&mut dyn Observer] = &mut [&mut limit, &mut record];
        let from = (&scene, None);
        run::recorded(from, &mut simulation, &directory, progress, interrupt, others)
    })?;
    Ok(Some(summary))
}

/// The member in `path` set up to continue, if it was interrupted or killed and has a checkpoint that serves.
fn continued(
    plan: &Plan,
    path: &Path,
    search: &PluginSearch,
) -> Option<(ResultDirectory, Resumed)> {
    if !matches!(status(plan, path).0, MemberStatus::Interrupted | MemberStatus::Killed) {
        return None;
    }
    let directory = ResultDirectory::reopen(path).ok()?;
    let resumed = resume(&directory, &[], search).ok()?;
    // Its measures are known by the times of frames; a point has none.
    if resumed.checkpoint.frame_times().is_empty() {
        return None;
    }
    Some((directory, resumed))
}

/// Waits while another process writes to the directory: a member of a study that was killed ends by itself,
/// and may even be complete then.
fn wait_for_others(path: &Path, interrupt: Interrupt) {
    let since = Instant::now();
    while Claim::in_use(path) && since.elapsed() < MAX_CLAIM_WAIT && !interrupt.requested() {
        thread::sleep(Duration::from_millis(50));
    }
}
