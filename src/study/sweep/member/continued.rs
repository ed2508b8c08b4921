//! A member that is resumed from its checkpoint.

use std::fs;
use std::path::Path;

use super::{COLUMNS, MemberStatus, Plan, status};
use crate::kinetics::Search;
use crate::output::{Ledger, ResultDirectory};
use crate::run::Result;
use crate::run::resume::{Resumed, resume};

/// The member in `path` set up to continue, if it was interrupted or killed and has a checkpoint that serves.
pub(super) fn continued(
    plan: &Plan,
    path: &Path,
    search: &Search,
) -> Option<(ResultDirectory, Resumed)> {
    if !matches!(status(plan, path).0, MemberStatus::Interrupted | MemberStatus::Killed) {
        return None;
    }
    let directory = ResultDirectory::reopen(path).ok()?;
    let resumed = resume(&directory, None, search).ok()?;
    // Its measures are known by the times of frames; a point has none.
    if resumed.checkpoint.frames().is_empty() {
        return None;
    }
    directory.claim().begin().ok()?;
    Some((directory, resumed))
}

/// The measures, begun or, where a member goes on, after those at `times`.
pub(super) fn open_measures(path: &Path, times: Option<&[f64]>) -> Result<Ledger> {
    let columns = COLUMNS.map(str::to_owned);
    let Some(times) = times else { return Ok(Ledger::create(path, &columns)?) };
    let text = fs::read_to_string(path).unwrap_or_default();
    let mut measures = Ledger::create(path, &columns)?;
    let rows = text.split_inclusive('\n').skip(1).filter(|row| row.ends_with('\n'));
    for row in rows {
        let row: Vec<f64> = row.trim_end().split(',').filter_map(|n| n.parse().ok()).collect();
        if row.get(1).is_some_and(|time| times.contains(time)) {
            measures.append(&row)?;
        }
    }
    Ok(measures)
}
