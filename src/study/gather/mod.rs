//! Results of the members of a study, read back from their directories.

mod distance;
mod measures;
pub mod states;
mod statistics;
mod totals;

use std::fs;
use std::path::Path;

pub(super) use self::distance::largest;
pub use self::distance::{
    DIVERGED, Deviations, Difference, Distance, Norm, REFERENCES_DIVERGED, first_beyond,
};
pub use self::measures::{Measures, measure};
pub use self::statistics::Statistics;
use super::plan::Plan;
use crate::model::State;
use crate::num::{plural, real};
use crate::output::ledger::value;
use crate::output::{Ledger, ResultDirectory, RunStatus, SelfIntersection, Standing};
use crate::run::Result;
use crate::run::run::Ending;
use crate::tally::Work;

/// Status of a member.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum MemberStatus {
    /// It completed.
    Complete,
    /// It could not be continued.
    Failed,
    /// Its process ended without a status.
    Killed,
    /// Complete, with a file of its results missing or truncated since: to be rerun.
    Damaged,
    /// It was asked to end before.
    Interrupted,
    /// A process works on it.
    Running,
    /// It has not begun.
    #[default]
    NotBegun,
}

impl MemberStatus {
    /// All with their names, those that ended first.
    pub const ALL: [(Self, &'static str); 7] = [
        (Self::Complete, "complete"),
        (Self::Failed, "failed"),
        (Self::Killed, "killed"),
        (Self::Damaged, "damaged"),
        (Self::Interrupted, "interrupted"),
        (Self::Running, "running"),
        (Self::NotBegun, "not begun"),
    ];

    /// Whether it ended without results.
    pub(crate) fn is_lost(self) -> bool {
        matches!(self, Self::Failed | Self::Killed | Self::Damaged)
    }
}

impl std::fmt::Display for MemberStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(Self::ALL[*self as usize].1)
    }
}

/// Returns the status of the member in `directory` of a study, and the reason.
pub(crate) fn status(plan: &Plan, directory: &Path) -> (MemberStatus, String) {
    let Some(standing) = Standing::read(directory) else { return Default::default() };
    let status = match standing.status {
        RunStatus::Running if standing.in_use => MemberStatus::Running,
        RunStatus::Running => MemberStatus::Killed,
        RunStatus::Complete => match damaged_file(plan, directory) {
            Some(file) => {
                let reason = format!("{file} is missing or truncated: the member has to be rerun");
                return (MemberStatus::Damaged, reason);
            }
            None => MemberStatus::Complete,
        },
        RunStatus::Interrupted => MemberStatus::Interrupted,
        RunStatus::Failed => MemberStatus::Failed,
    };
    (status, standing.reason)
}

/// The first file of a complete member that is missing or cut short.
fn damaged_file(plan: &Plan, directory: &Path) -> Option<&'static str> {
    let times: Vec<f64> = read_measures(directory).iter().map(|m| m.time).collect();
    let states = || {
        let states = states::read(&directory.join(ResultDirectory::STATES));
        states.iter().map(|state| state.time).collect::<Vec<f64>>()
    };
    if times.is_empty() {
        return Some(ResultDirectory::MEASURES);
    }
    (plan.states && states() != times).then_some(ResultDirectory::STATES)
}

/// Results of a member, read from its directory.
#[derive(Debug, Clone, Default)]
pub struct MemberResults {
    /// Its keys and values.
    pub name: String,
    /// Which value of every axis it has.
    pub at: Vec<usize>,
    /// Its status.
    pub status: MemberStatus,
    /// Why; the first line.
    pub reason: String,
    /// Measures at the output times, as far as it came.
    pub measures: Vec<Measures>,
    /// Totals of the species at the last output time, with the titles that they have in the ledger.
    pub totals: Vec<(String, f64)>,
    /// The time at which no species changed any more, if the run ended for that.
    pub steady: Option<f64>,
    /// Processor time of relaxing the start and of all steps, s.
    pub seconds: Option<f64>,
    /// Of that the start, s.
    pub start_seconds: Option<f64>,
    /// Largest resident memory, bytes.
    pub memory: Option<u64>,
    /// The work of that.
    pub work: Option<Work>,
    /// Work of relaxing the start.
    pub start: Option<Work>,
    /// Whether its sheet passes through itself in its last state, where its shape moves.
    pub intersection: Option<SelfIntersection>,
}

impl MemberResults {
    /// Whether it completed.
    pub(crate) fn is_complete(&self) -> bool {
        self.status == MemberStatus::Complete
    }

    /// Why it did not complete; empty if it did.
    pub(crate) fn why_incomplete(&self) -> &str {
        if self.is_complete() { "" } else { &self.reason }
    }

    /// Processor time of its steps, s.
    pub(crate) fn step_seconds(&self) -> Option<f64> {
        Some(self.seconds? - self.start_seconds?)
    }

    /// The work of its steps.
    pub(crate) fn step_work(&self) -> Option<Work> {
        Some(self.work? - self.start?)
    }

    /// Largest resident memory, MB.
    pub(crate) fn peak_resident_megabytes(&self) -> Option<f64> {
        Some(real(usize::try_from(self.memory?).ok()?) / 1e6)
    }
}

/// A member with its states at the output times, as far as it came.
#[derive(Debug, Clone, Default)]
pub struct Run {
    /// Its results.
    pub found: MemberResults,
    /// Its states.
    pub states: Vec<State>,
}

impl Run {
    /// Reads member `number` of the study in `root`.
    pub(super) fn read(plan: &Plan, root: &Path, number: usize) -> Self {
        let states = plan.directory(root, number).join(ResultDirectory::STATES);
        Self { found: read(plan, root, number), states: states::read(&states) }
    }
}

/// Reads what there is of all members of the study in `root`.
#[must_use]
pub fn gather(plan: &Plan, root: &Path) -> Vec<MemberResults> {
    (0..plan.members.len()).map(|number| read(plan, root, number)).collect()
}

/// Reads what there is of member `number` of the study in `root`.
pub(crate) fn read(plan: &Plan, root: &Path, number: usize) -> MemberResults {
    let directory = plan.directory(root, number);
    let (status, reason) = status(plan, &directory);
    // The status of a run that continues, or was killed, has no costs.
    let ended = Standing::read(&directory).filter(|s| s.status != RunStatus::Running);
    let measures = read_measures(&directory);
    let steady = status == MemberStatus::Complete && reason == Ending::Steady.to_string();
    let mut found = MemberResults {
        name: plan.name(number),
        at: plan.members.get(number).map(|point| point.at.clone()).unwrap_or_default(),
        status,
        reason: reason.lines().next().unwrap_or_default().to_owned(),
        totals: measures.last().map(|m| totals::totals(&directory, m.time)).unwrap_or_default(),
        steady: measures.last().map(|m| m.time).filter(|_| steady),
        measures,
        ..MemberResults::default()
    };
    if let Some(ended) = ended {
        (found.seconds, found.memory) = (ended.cpu_seconds, ended.peak_resident_bytes);
        (found.work, found.start) = (ended.work, ended.start);
        found.start_seconds = ended.start_seconds;
        found.intersection = ended.intersection;
    }
    found
}

/// Returns the number of members, as in `4 members`.
pub(super) fn counted(members: usize) -> String {
    plural(members, "member", "members")
}

/// Returns how many members have which status, as in `4 members: 3 complete, 1 failed`.
#[must_use]
pub fn counts(members: &[MemberResults]) -> String {
    let count = |status| members.iter().filter(|f| f.status == status).count();
    let all = MemberStatus::ALL.into_iter().map(|(status, name)| (count(status), name));
    let texts: Vec<String> =
        all.filter(|c| c.0 > 0).map(|(n, name)| format!("{n} {name}")).collect();
    format!("{}: {}", counted(members.len()), texts.join(", "))
}

/// Time of the last output of the member in `directory`.
pub(super) fn last_time(directory: &Path) -> Option<f64> {
    read_measures(directory).last().map(|m| m.time)
}

fn read_measures(directory: &Path) -> Vec<Measures> {
    let rows = read_rows(&directory.join(ResultDirectory::MEASURES));
    rows.iter().filter_map(|row| Measures::from_row(row)).collect()
}

/// The numbers of every complete row below the head of a CSV file; none if the file does not exist.
fn read_rows(path: &Path) -> Vec<Vec<f64>> {
    let text = fs::read_to_string(path).unwrap_or_default();
    let rows = text.split_inclusive('\n').skip(1).filter(|row| row.ends_with('\n'));
    let numbers = |row: &str| row.trim_end().split(',').filter_map(value).collect();
    rows.map(numbers).collect()
}

/// Opens the table of measures at `path`; of an earlier one the rows of the output times `kept` remain.
pub(super) fn open_measures(path: &Path, kept: &[f64]) -> Result<Ledger> {
    let mut rows = read_rows(path);
    rows.retain(|row| row.get(1).is_some_and(|time| kept.contains(time)));
    let columns: Vec<String> = Measures::COLUMNS.split(',').map(str::to_owned).collect();
    let mut measures = Ledger::create(path, &columns)?;
    rows.iter_mut().for_each(|row| row.resize(columns.len(), f64::NAN));
    rows.iter().try_for_each(|row| measures.append(row))?;
    Ok(measures)
}
