//! A sweep in numbers: one row a member, its keys first.

use std::iter::once;

use crate::num::real;
use crate::output::SelfIntersection;
use crate::output::plot::label;
use crate::study::draw::table::{csv_table, markdown_table, number, work_cells, work_titles};
use crate::study::gather::{Found, Measures};
use crate::study::plan::Plan;

/// A number of a member.
pub struct Column {
    /// Its title, with the unit.
    pub title: &'static str,
    /// The number; none where there is none.
    pub of: fn(&Found) -> Option<f64>,
}

fn last(found: &Found) -> Option<&Measures> {
    found.measures.last()
}

/// What is known of every member.
pub const COLUMNS: [Column; 11] = [
    Column { title: "time", of: |f| Some(last(f)?.time) },
    Column { title: "spots", of: |f| Some(real(last(f)?.spots)) },
    Column { title: "separation d [length]", of: |f| last(f)?.separation },
    Column { title: "nearest centres [length]", of: |f| last(f)?.nearest },
    Column { title: "share", of: |f| Some(last(f)?.share) },
    Column { title: "amplitude [length]", of: |f| Some(last(f)?.amplitude) },
    Column { title: "energy [energy]", of: |f| Some(last(f)?.energy) },
    Column { title: "time to steady", of: |f| f.steady },
    Column { title: "CPU [s]", of: |f| f.seconds },
    Column { title: "memory [MB]", of: |f| f.megabytes() },
    Column { title: "steps", of: |f| Some(real(usize::try_from(f.work?.steps).ok()?)) },
];

/// The table as CSV: `member`, the keys, `status`, the measures, all counts of work but `steps`, which is one of
/// these, `reason`. What has no value is empty.
#[must_use]
pub fn csv(plan: &Plan, members: &[Found]) -> String {
    let keys = plan.axes.iter().map(|axis| axis.key.as_str());
    let titles = once("member").chain(keys).chain(once("status"));
    let titles = titles.chain(COLUMNS.iter().map(|c| c.title)).map(str::to_owned);
    let mut rows = vec![titles.chain(work_titles(&["steps"])).chain(["reason".into()]).collect()];
    for (found, point) in members.iter().zip(&plan.members) {
        let row = once(point.folder.clone()).chain(values(plan, found));
        let row = row.chain(COLUMNS.iter().map(|c| number((c.of)(found))));
        let row = row.chain(work_cells(found.work, &["steps"]));
        rows.push(row.chain(once(found.why_incomplete().to_owned())).collect());
    }
    csv_table(&rows)
}

/// The same for people, in Markdown: without folders, numbers in few digits, and only columns that have
/// numbers.
#[must_use]
pub fn markdown(plan: &Plan, members: &[Found]) -> String {
    let known = |c: &&Column| members.iter().any(|f| (c.of)(f).is_some());
    let columns: Vec<&Column> = COLUMNS.iter().filter(known).collect();
    let keys = plan.axes.iter().map(|axis| axis.title()).chain(once("status"));
    let head = keys.chain(columns.iter().map(|c| c.title)).map(str::to_owned);
    let mut rows: Vec<Vec<String>> = vec![head.collect()];
    let mut notes = String::new();
    for found in members {
        let numbers = columns.iter().map(|c| (c.of)(found).map_or("-".into(), label));
        rows.push(values(plan, found).chain(numbers).collect());
        if !found.why_incomplete().is_empty() {
            notes += &format!("* {}: {}: {}\n", found.name, found.status, found.why_incomplete());
        }
    }
    for found in members {
        if let Some(words) = found.intersection.and_then(SelfIntersection::words) {
            notes += &format!("* {}: {words}\n", found.name);
        }
    }
    let between = if notes.is_empty() { "" } else { "\n" };
    markdown_table(&rows) + between + &notes
}

/// The values of a member's keys, and its status.
fn values(plan: &Plan, found: &Found) -> impl Iterator<Item = String> {
    let values = plan.axes.iter().zip(&found.at).map(|(axis, k)| axis.value(*k).to_owned());
    values.chain(once(found.status.to_string()))
}
