//! A sweep in numbers: one row a member, its keys first.

use super::axis::plain;
use super::member::{Found, MemberStatus};
use super::plan::Plan;
use crate::num::real;
use crate::output::SelfIntersection;
use crate::output::plot::label;
use crate::study::measures::Measures;
use crate::study::tables::{csv_table, markdown_table};
use crate::tally::Work;

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
    Column { title: "memory [MB]", of: |f| Some(real(usize::try_from(f.memory?).ok()?) / 1e6) },
    Column { title: "steps", of: |f| Some(real(usize::try_from(f.work?.steps).ok()?)) },
];

/// The table as CSV: `member`, the keys, `status`, the measures, all counts of work but `steps`, which is one of
/// these, `reason`. What has no value is empty.
#[must_use]
pub fn csv(plan: &Plan, members: &[Found]) -> String {
    let mut rows = vec![head(plan).map(|cell| cell.to_owned()).collect::<Vec<_>>()];
    let counts = &Work::NAMES[1..];
    rows[0].extend(counts.iter().map(|(name, _)| name.replace('_', " ")));
    rows[0].push("reason".into());
    for (number, found) in members.iter().enumerate() {
        let folder = plan.members.get(number).map_or("", |point| &point.folder);
        let mut row = vec![folder.to_owned()];
        row.extend(values(plan, found).map(str::to_owned));
        row.push(found.status.to_string());
        row.extend(COLUMNS.iter().map(|c| (c.of)(found).map_or(String::new(), |v| v.to_string())));
        let work = found.work.map(|work| work.values());
        let count = |k: usize| work.map_or(String::new(), |work| work[k].to_string());
        row.extend((1..Work::NAMES.len()).map(count));
        row.push(said(found).to_owned());
        rows.push(row);
    }
    csv_table(&rows)
}

/// The same for people, in Markdown: without folders, numbers in few digits, and only columns that have
/// numbers.
#[must_use]
pub fn markdown(plan: &Plan, members: &[Found]) -> String {
    let columns: Vec<&Column> =
        COLUMNS.iter().filter(|c| members.iter().any(|f| (c.of)(f).is_some())).collect();
    let keys = plan.axes.iter().map(|axis| axis.title().to_owned());
    let mut rows: Vec<Vec<String>> = vec![
        keys.chain(["status".to_owned()]).chain(columns.iter().map(|c| c.title.into())).collect(),
    ];
    for found in members {
        let mut row: Vec<String> = values(plan, found).map(str::to_owned).collect();
        row.push(found.status.to_string());
        row.extend(columns.iter().map(|c| (c.of)(found).map_or("-".into(), label)));
        rows.push(row);
    }
    let mut text = markdown_table(&rows);
    let ended = members.iter().filter(|f| !said(f).is_empty());
    let mut notes: Vec<String> =
        ended.map(|f| format!("* {}: {}: {}\n", f.name, f.status, said(f))).collect();
    for found in members {
        if let Some(words) = found.intersection.and_then(SelfIntersection::words) {
            notes.push(format!("* {}: {words}\n", found.name));
        }
    }
    if !notes.is_empty() {
        text += "\n";
        text += &notes.concat();
    }
    text
}

fn head(plan: &Plan) -> impl Iterator<Item = &str> {
    let keys = plan.axes.iter().map(|axis| axis.key.as_str());
    ["member"].into_iter().chain(keys).chain(["status"]).chain(COLUMNS.iter().map(|c| c.title))
}

/// The values of a member's keys.
fn values<'a>(plan: &'a Plan, found: &'a Found) -> impl Iterator<Item = &'a str> {
    let value = |(axis, k): (&'a super::Axis, &usize)| -> &'a str {
        plain(axis.values.get(*k).map_or("", String::as_str))
    };
    plan.axes.iter().zip(&found.at).map(value)
}

/// Why a member did not complete; that it did says the status.
fn said(found: &Found) -> &str {
    if found.status == MemberStatus::Complete { "" } else { &found.reason }
}
