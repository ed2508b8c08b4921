//! One scene over lists and ranges of its keys.
//!
//! ```text
//! DIR/sweep.json              the plan: keys, values, members with their fingerprints
//! DIR/members/h=0.5,D=0/      the run of one member, with measures.csv
//! DIR/sweep.csv, sweep.md     a row of measures and costs a member
//! DIR/statistics.csv          mean and standard deviation over the seeds
//! DIR/refinement.csv          measures on ever finer meshes
//! DIR/plots.json              the tables, and plots of the measures against each key, for the viewer
//! ```
//!
//! The members are planned, run and gathered as those of any [study](super); here are the table with one row a
//! member and the plots.

use std::collections::{BTreeMap, BTreeSet};
use std::iter::once;
use std::path::Path;

use super::draw::plot::curves;
use super::draw::table;
use super::draw::table::{csv_table, number, work_cells, work_titles};
use super::gather::{Measures, MemberResults, MemberStatus, Statistics};
use super::plan::{Axis, Plan};
use super::refinement::{Column, selected};
use super::{Page, extent, refinement, write_files};
use crate::num::real;
use crate::output::SelfIntersection;
use crate::output::plot::{Block, Figure, Panel, Plot, label};
use crate::run::Result;
use crate::run::pattern::resolution_words;

/// Names of the files that gather a sweep.
pub const TABLE: &str = "sweep.csv";
/// Statistics over the seeds.
pub const STATISTICS: &str = "statistics.csv";
/// Measures on ever finer meshes.
pub const REFINEMENT: &str = "refinement.csv";
/// The table for people.
pub const PAGE: &str = "sweep.md";

/// All of them.
pub(super) const FILES: &[&str] = &[TABLE, STATISTICS, REFINEMENT, PAGE];

/// Writes the tables of `members` into `root`.
///
/// # Errors
/// A file that cannot be written.
pub fn write_tables(plan: &Plan, members: &[MemberResults], root: &Path) -> Result<()> {
    let mut files = vec![(TABLE, csv(plan, members)), (PAGE, markdown(plan, members))];
    files.extend(statistics_csv(plan, members).map(|text| (STATISTICS, text)));
    let measures = &measures(members);
    let refined = refinement::rows(plan, members, measures, |axis| &axis.key, number);
    files.extend(refined.map(|rows| (REFINEMENT, csv_table(&rows))));
    write_files(root, &files)
}

/// The tables and plots of `members`.
pub(super) fn page(plan: &Plan, members: &[MemberResults]) -> Page {
    let mut blocks = blocks(plan, members);
    let said = table::markdown(&blocks);
    for key in drawn_keys(plan) {
        let (name, figure) = (plan.plot_name(key), figure(plan, members, key));
        let caption = format!(
            "Measures against {}. Seeds are marks around the curve of their means.",
            plan.axes[key].key
        );
        if !figure.panels.is_empty() {
            blocks.push(Block::Plot(Plot { name, caption, figure }));
        }
    }
    Page { blocks, files: Vec::new(), said }
}

/// A number of a member; none where there is none.
type NumberOf = fn(&MemberResults) -> Option<f64>;
fn last(found: &MemberResults) -> Option<&Measures> {
    found.measures.last()
}

/// The column of the connected regions above the level in files; people read "regions above the level".
const SPOTS: &str = "spots";

/// Results of a member: titles with units, and numbers.
const RESULTS: [(&str, NumberOf); 10] = [
    ("time", |f| Some(last(f)?.time)),
    (SPOTS, |f| Some(real(last(f)?.spots))),
    ("separation d [length]", |f| last(f)?.separation),
    ("nearest centres [length]", |f| last(f)?.nearest),
    ("pattern width [edges]", |f| last(f)?.width),
    ("wrinkle width [edges]", |f| last(f)?.wrinkle_width),
    ("share", |f| Some(last(f)?.share)),
    ("amplitude [length]", |f| Some(last(f)?.amplitude)),
    ("energy [energy]", |f| Some(last(f)?.energy)),
    ("time to steady", |f| f.steady),
];
/// Costs of a member.
const COSTS: [(&str, NumberOf); 3] = [
    ("CPU [s]", |f| f.seconds),
    ("memory [MB]", |f| f.peak_resident_megabytes()),
    ("steps", |f| Some(real(usize::try_from(f.work?.steps).ok()?))),
];

/// Those that converge as a mesh is refined: results but for the time reached and widths in edges.
fn measures(members: &[MemberResults]) -> Vec<Column<'_>> {
    let mut columns = labelled_columns(members);
    columns.truncate(columns.len() - COSTS.len());
    columns.retain(|c| c.title != "time" && !c.title.ends_with("[edges]"));
    columns
}

/// The same with titles for people: a labyrinth, or a wavy edge, is one region.
fn labelled_columns(members: &[MemberResults]) -> Vec<Column<'_>> {
    let mut columns = columns(members);
    columns
        .iter_mut()
        .filter(|c| c.title == SPOTS)
        .for_each(|c| c.title = "regions above the level");
    columns
}

/// Columns of the tables: results, with the totals of all species that a member has, and costs.
pub(super) fn columns(members: &[MemberResults]) -> Vec<Column<'_>> {
    let fixed = |(title, of): (&'static str, NumberOf)| Column { title, of: Box::new(of) };
    let titles = members.iter().flat_map(|found| found.totals.iter().map(|(title, _)| &**title));
    let mut seen = BTreeSet::new();
    let totals = titles.filter(|title| seen.insert(*title)).map(|title| {
        let own = move |(own, total): &(String, f64)| (own == title).then_some(*total);
        Column { title, of: Box::new(move |found| found.totals.iter().find_map(own)) }
    });
    let totals: Vec<Column<'_>> = totals.collect();
    RESULTS.into_iter().map(fixed).chain(totals).chain(COSTS.into_iter().map(fixed)).collect()
}

/// The table as CSV: `member`, the keys, `status`, the measures, all counts of work but `steps`, which is one of
/// these, `reason`. Cells without a value are empty.
#[must_use]
pub fn csv(plan: &Plan, members: &[MemberResults]) -> String {
    let keys = plan.axes.iter().map(|axis| axis.key.as_str());
    let columns = columns(members);
    let titles = once("member").chain(keys).chain(once("status"));
    let titles = titles.chain(columns.iter().map(|c| c.title)).map(str::to_owned);
    let mut rows = vec![titles.chain(work_titles(&["steps"])).chain(["reason".into()]).collect()];
    for (found, point) in members.iter().zip(&plan.members) {
        let row = once(point.folder.clone()).chain(values(plan, found));
        let row = row.chain(columns.iter().map(|c| number((c.of)(found))));
        let row = row.chain(work_cells(found.work, &["steps"]));
        rows.push(row.chain(once(found.why_incomplete().to_owned())).collect());
    }
    csv_table(&rows)
}

/// The statistics over the seeds as CSV; none without an axis of several seeds.
#[must_use]
pub fn statistics_csv(plan: &Plan, members: &[MemberResults]) -> Option<String> {
    let rows = statistics_rows(plan, members, &columns(members), |axis| &axis.key, number);
    rows.map(|rows| csv_table(&rows))
}

/// Statistics of `columns` over the complete members of every combination of the axes that are no seeds, in a row each:
/// `mean`, `standard deviation`, and the number of values `n`; with the count of failed members. None without an axis
/// of several seeds.
fn statistics_rows(
    plan: &Plan,
    members: &[MemberResults],
    columns: &[Column<'_>],
    title: fn(&Axis) -> &str,
    cell: fn(Option<f64>) -> String,
) -> Option<Vec<Vec<String>>> {
    plan.axes.iter().find(|axis| axis.is_seed() && axis.values.len() > 1)?;
    let kept = |k: usize| !plan.axes[k].is_seed();
    let mut groups: BTreeMap<Vec<usize>, Vec<&MemberResults>> = BTreeMap::new();
    for found in members {
        groups.entry(selected(&found.at, kept)).or_default().push(found);
    }
    let axes = || plan.axes.iter().filter(|axis| !axis.is_seed());
    let head = axes().map(title).chain(["statistic", "failed"]);
    let head = head.chain(columns.iter().map(|c| c.title)).map(str::to_owned);
    let mut rows = vec![head.collect()];
    for (at, group) in groups {
        let failed = group.iter().filter(|f| f.status.is_lost()).count().to_string();
        let complete = || group.iter().filter(|f| f.status == MemberStatus::Complete);
        let values = |c: &Column<'_>| complete().filter_map(|f| (c.of)(f)).collect::<Vec<f64>>();
        let found: Vec<_> = columns.iter().map(|c| Statistics::new(&values(c))).collect();
        let mut row = |name: &str, of: fn(&Statistics) -> Option<f64>| {
            let keys = axes().zip(&at).map(|(axis, k)| axis.value(*k).to_owned());
            let keys = keys.chain([name.to_owned(), failed.clone()]);
            rows.push(keys.chain(found.iter().map(|s| cell(of(s)))).collect());
        };
        row("mean", |s| s.mean);
        row("standard deviation", |s| s.deviation);
        row("n", |s| Some(real(s.count)));
    }
    Some(rows)
}

/// The tables for people, in Markdown.
#[must_use]
pub fn markdown(plan: &Plan, members: &[MemberResults]) -> String {
    table::markdown(&blocks(plan, members))
}

/// The tables for people: without folders, numbers in few digits, and only columns that have numbers.
fn blocks(plan: &Plan, members: &[MemberResults]) -> Vec<Block> {
    let mut columns = labelled_columns(members);
    columns.retain(|c| members.iter().any(|f| (c.of)(f).is_some()));
    let cell = |value: Option<f64>| value.map_or("-".into(), label);
    let keys = plan.axes.iter().map(|axis| axis.title()).chain(once("status"));
    let head = keys.chain(columns.iter().map(|c| c.title)).map(str::to_owned);
    let mut rows: Vec<Vec<String>> = vec![head.collect()];
    for found in members {
        let numbers = columns.iter().map(|c| cell((c.of)(found)));
        rows.push(values(plan, found).chain(numbers).collect());
    }
    let mut notes = notes(members);
    notes.extend(members.iter().flat_map(resolution_notes));
    let mut blocks = vec![Block::Table(rows)];
    if !notes.is_empty() {
        blocks.push(Block::List(notes));
    }
    if let Some(rows) = refinement::rows(plan, members, &measures(members), Axis::title, cell) {
        let text = "On ever finer meshes, with the order of convergence and the limit of the three finest for edges as \
                    long as N^(-1/2):";
        blocks.push(Block::Text(text.into()));
        blocks.push(Block::Table(rows));
    }
    if let Some(rows) = statistics_rows(plan, members, &columns, Axis::title, cell) {
        let seeds = plan.axes.iter().filter(|axis| axis.is_seed());
        let seeds: Vec<&str> = seeds.map(|axis| axis.key.as_str()).collect();
        blocks.push(Block::Text(format!("Over {}, complete members:", seeds.join(" and "))));
        blocks.push(Block::Table(rows));
    }
    blocks
}

/// Notes on `members`: why they are not complete, sheets that pass through themselves.
pub(super) fn notes(members: &[MemberResults]) -> Vec<String> {
    let lost = members.iter().filter(|found| !found.why_incomplete().is_empty());
    let lost = lost.map(|f| format!("{}: {}: {}", f.name, f.status, f.why_incomplete()));
    let crossed = members.iter().filter_map(|found| {
        let words = found.intersection.and_then(SelfIntersection::words)?;
        Some(format!("{}: {words}", found.name))
    });
    lost.chain(crossed).collect()
}

/// Notes on patterns and wrinkles of a member that are not resolved.
fn resolution_notes(found: &MemberResults) -> impl Iterator<Item = String> {
    let of = |width: fn(&Measures) -> Option<f64>| last(found).and_then(width);
    let words = resolution_words(of(|m| m.width), of(|m| m.wrinkle_width));
    words.map(|words| format!("{}: {words}", found.name))
}

/// The values of a member's keys, and its status.
fn values(plan: &Plan, found: &MemberResults) -> impl Iterator<Item = String> {
    let values = plan.axes.iter().zip(&found.at).map(|(axis, k)| axis.value(*k).to_owned());
    values.chain(once(found.status.to_string()))
}

/// Largest over least value of a measure from which on its axis is logarithmic.
const LOG_AXIS_RATIO: f64 = 100.0;
/// The same of a key whose values are a list.
const WIDE_KEY: f64 = 30.0;

/// The measures against key `across`, a number of `plan.axes`; members that failed are crosses at the upper edge.
#[must_use]
pub fn figure(plan: &Plan, members: &[MemberResults], across: usize) -> Figure {
    let axis = &plan.axes[across];
    let others = |k: usize| k != across && plan.axes.get(k).is_some_and(|axis| !axis.is_seed());
    let (mut names, mut numbers) = (Vec::new(), BTreeMap::new());
    for point in &plan.members {
        numbers.entry(selected(&point.at, others)).or_insert_with(|| {
            names.push(plan.label(&point.at, others));
            names.len() - 1
        });
    }
    // What is not a number has a place of its own.
    let places = axis.numbers().unwrap_or_else(|| (1..=axis.values.len()).map(real).collect());
    let place = |found: &MemberResults| {
        let name = numbers.get(&selected(&found.at, others))?;
        Some((*name, *places.get(*found.at.get(across)?)?))
    };
    let wide = axis.logarithmic || is_wide(places.iter().copied(), WIDE_KEY);
    let positive = places.iter().all(|x| *x > 0.0) && axis.numbers().is_some();
    let failed: Vec<(usize, f64)> =
        members.iter().filter(|f| f.status.is_lost()).filter_map(place).collect();
    let complete = || members.iter().filter(|f| f.status == MemberStatus::Complete);
    let panel = |column: &Column<'_>| -> Option<Panel> {
        let curves = curves(complete().filter_map(|found| {
            let (name, place) = place(found)?;
            Some((name, place, (column.of)(found)?))
        }));
        // A measure that no member has is not drawn, unless all failed.
        if curves.is_empty() && (failed.is_empty() || complete().next().is_some()) {
            return None;
        }
        let values = curves.iter().flat_map(|c| c.points.iter().map(|p| p.1));
        Some(Panel {
            title: column.title.to_owned(),
            across: across_text(axis, !failed.is_empty()),
            logarithmic: (positive && wide, is_wide(values, LOG_AXIS_RATIO)),
            curves,
            failed: failed.clone(),
            zeros: Vec::new(),
        })
    };
    // The time reached does not count as a result.
    let panels = labelled_columns(members)[1..].iter().filter_map(panel).collect();
    names.iter_mut().filter(|n| n.is_empty()).for_each(|name| *name = "all members".to_owned());
    Figure { names, panels, ..Figure::default() }
}

/// Which keys are drawn: those with several values, seeds only where there is nothing else.
#[must_use]
pub fn drawn_keys(plan: &Plan) -> Vec<usize> {
    let all = (0..plan.axes.len()).filter(|k| plan.axes[*k].values.len() > 1);
    let (seeds, keys): (Vec<usize>, Vec<usize>) = all.partition(|k| plan.axes[*k].is_seed());
    if keys.is_empty() { seeds } else { keys }
}

/// Whether values are positive, and the largest more than `ratio` times the least.
fn is_wide(values: impl Iterator<Item = f64>, ratio: f64) -> bool {
    let (least, most) = extent(values);
    least > 0.0 && most.is_finite() && most > ratio * least
}

fn across_text(axis: &Axis, crosses: bool) -> String {
    let mut text = axis.key.clone();
    if axis.numbers().is_none() {
        let names = (0..axis.values.len()).map(|k| format!("{} {}", k + 1, axis.value(k)));
        text = format!("{} ({})", axis.title(), names.collect::<Vec<_>>().join(", "));
    }
    if crosses { text + "   × failed" } else { text }
}
