//! One scene over lists and ranges of its keys.
//!
//! ```text
//! DIR/sweep.json              the plan: keys, values, members with their fingerprints
//! DIR/members/h=0.5,D=0/      the run of one member, with measures.csv and shown.vtu
//! DIR/sweep.csv, sweep.md     a row of measures and costs a member
//! DIR/statistics.csv          mean and standard deviation over the seeds
//! DIR/pictures.png            pictures of all members, arranged by the keys
//! DIR/plot-h.svg, plot-h.png  the measures against a key
//! DIR/sweep.sbatch, slurm/    an array job and what its tasks print
//! ```
//!
//! The members are planned, run and gathered as those of any [study](super); here are the table with one row a
//! member, the plots and the contact sheet.

use std::collections::{BTreeMap, BTreeSet};
use std::iter::once;
use std::path::Path;

use super::draw::contact_sheet::{ACROSS, ContactSheet, GAP, LINE, Shape, TILE};
use super::draw::plot::StudyPlot;
use super::draw::selected;
use super::draw::table::{csv_table, markdown_table, number, work_cells, work_titles};
use super::gather::{Measures, MemberResults, MemberStatus, ShownState, Statistics, counts};
use super::plan::{Axis, Plan};
use super::{draw, extent, write_files};
use crate::num::real;
use crate::output::SelfIntersection;
use crate::output::picture::Picture;
use crate::output::plot::{Figure, Panel, label};
use crate::run::pattern::resolution_words;
use crate::run::{Error, Result};

/// Names of the files that gather a sweep.
pub const TABLE: &str = "sweep.csv";
/// Statistics over the seeds.
pub const STATISTICS: &str = "statistics.csv";
/// The table for people.
pub const PAGE: &str = "sweep.md";
/// The pictures.
pub const PICTURES: &str = "pictures.png";
/// Prefix of the names of plots.
pub const PLOT: &str = "plot-";

/// Writes the tables of `members` into `root`.
///
/// # Errors
/// A file that cannot be written.
pub fn write_tables(plan: &Plan, members: &[MemberResults], root: &Path) -> Result<()> {
    let mut files = vec![(TABLE, csv(plan, members)), (PAGE, markdown(plan, members))];
    files.extend(statistics_csv(plan, members).map(|text| (STATISTICS, text)));
    let file = |(name, text): (&str, String)| (name.to_owned(), text.into_bytes());
    write_files(root, files.into_iter().map(file).collect())
}

/// Writes tables, pictures and plots of `members` into `root`.
///
/// # Errors
/// A picture that cannot be drawn, a file that cannot be written.
pub fn write(plan: &Plan, members: &[MemberResults], root: &Path) -> Result<()> {
    write_tables(plan, members, root)?;
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    if let Some(pictures) = contact_sheet(plan, members)? {
        files.push((PICTURES.to_owned(), pictures.png()?));
    }
    for key in drawn_keys(plan) {
        let drawn = figure(plan, members, key);
        if !drawn.panels.is_empty() {
            files.extend(draw::svg_and_png(&format!("{PLOT}{}", plan.plot_name(key)), &drawn)?);
        }
    }
    write_files(root, files)
}

/// Says how many of `members` have which status.
///
/// # Errors
/// [`Error::Incomplete`] if members failed or were killed; if `all` have to be complete, also if some are not.
pub fn standing(members: &[MemberResults], all: bool) -> Result<String> {
    let lost = |found: &&MemberResults| match all {
        true => found.status != MemberStatus::Complete,
        false => found.status.is_lost(),
    };
    let Some(first) = members.iter().find(lost) else { return Ok(counts(members)) };
    Err(Error::Incomplete(format!(
        "{} of {} members did not come to their end; the first: {}: {}: {}",
        members.iter().filter(lost).count(),
        members.len(),
        first.name,
        first.status,
        first.reason
    )))
}

/// A number of a member; none where there is none.
type NumberOf = fn(&MemberResults) -> Option<f64>;
/// The same, of a column that the species name.
type BoxedNumberOf<'a> = Box<dyn Fn(&MemberResults) -> Option<f64> + 'a>;

fn last(found: &MemberResults) -> Option<&Measures> {
    found.measures.last()
}

/// The column of the connected regions above the level, in files and in tables and plots for people.
const SPOTS: &str = "spots";
const REGIONS: &str = "regions above the level";

/// Results of a member: titles with units, and numbers.
const RESULTS: [(&str, NumberOf); 9] = [
    ("time", |f| Some(last(f)?.time)),
    (SPOTS, |f| Some(real(last(f)?.spots))),
    ("separation d [length]", |f| last(f)?.separation),
    ("nearest centres [length]", |f| last(f)?.nearest),
    ("pattern width [edges]", |f| last(f)?.width),
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

/// A column of numbers.
struct Column<'a> {
    /// Its title, with the unit.
    title: &'a str,
    /// The number of a member.
    of: BoxedNumberOf<'a>,
}

/// The same with titles for people: a labyrinth, or a wavy edge, is one region.
fn labelled_columns(members: &[MemberResults]) -> Vec<Column<'_>> {
    let mut columns = columns(members);
    columns.iter_mut().filter(|c| c.title == SPOTS).for_each(|c| c.title = REGIONS);
    columns
}

/// Columns of the tables: results, with the totals of all species that a member has, and costs.
fn columns(members: &[MemberResults]) -> Vec<Column<'_>> {
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
        let found: Vec<_> = columns.iter().map(|c| Statistics::of(&values(c))).collect();
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

/// The tables for people, in Markdown: without folders, numbers in few digits, and only columns that have
/// numbers.
#[must_use]
pub fn markdown(plan: &Plan, members: &[MemberResults]) -> String {
    let mut columns = labelled_columns(members);
    columns.retain(|c| members.iter().any(|f| (c.of)(f).is_some()));
    let cell = |value: Option<f64>| value.map_or("-".into(), label);
    let keys = plan.axes.iter().map(|axis| axis.title()).chain(once("status"));
    let head = keys.chain(columns.iter().map(|c| c.title)).map(str::to_owned);
    let mut rows: Vec<Vec<String>> = vec![head.collect()];
    let mut notes = String::new();
    for found in members {
        let numbers = columns.iter().map(|c| cell((c.of)(found)));
        rows.push(values(plan, found).chain(numbers).collect());
        if !found.why_incomplete().is_empty() {
            notes += &format!("* {}: {}: {}\n", found.name, found.status, found.why_incomplete());
        }
    }
    for found in members {
        if let Some(words) = found.intersection.and_then(SelfIntersection::words) {
            notes += &format!("* {}: {words}\n", found.name);
        }
        if let Some(words) = last(found).and_then(|m| m.width).and_then(resolution_words) {
            notes += &format!("* {}: {words}\n", found.name);
        }
    }
    let between = if notes.is_empty() { "" } else { "\n" };
    let mut page = markdown_table(&rows) + between + &notes;
    if let Some(rows) = statistics_rows(plan, members, &columns, Axis::title, cell) {
        let seeds = plan.axes.iter().filter(|axis| axis.is_seed());
        let seeds: Vec<&str> = seeds.map(|axis| axis.key.as_str()).collect();
        page += &format!("\nOver {}, complete members:\n\n", seeds.join(" and "));
        page += &markdown_table(&rows);
    }
    page
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
    let plot = StudyPlot::new(plan, across, |k| {
        k != across && plan.axes.get(k).is_some_and(|axis| !axis.is_seed())
    });
    let wide = axis.logarithmic || is_wide(plot.places.iter().copied(), WIDE_KEY);
    let positive = plot.places.iter().all(|x| *x > 0.0) && axis.numbers().is_some();
    let lost = members.iter().filter(|f| f.status.is_lost());
    let failed: Vec<(usize, f64)> = lost.filter_map(|found| plot.curve_and_x(&found.at)).collect();
    let complete = || members.iter().filter(|f| f.status == MemberStatus::Complete);
    let panel = |column: &Column<'_>| -> Option<Panel> {
        let values = complete().filter_map(|f| Some((&f.at[..], (column.of)(f)?)));
        let curves = plot.curves(values);
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
    plot.figure("all members", panels)
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

/// Pictures in a row from which on they are smaller, and how small.
const SMALL_TILE_COUNT: usize = 8;
const SMALL_TILE: usize = 180;
/// Width of a letter, about; texts are cut off where a tile ends.
const LETTER_WIDTH: usize = 9;
/// Colour of a box in place of a picture.
const FAILED_COLOUR: [u8; 3] = [255, 214, 214];
const ABSENT_COLOUR: [u8; 3] = [232, 232, 232];
/// Height of the bar below the last picture of one that failed.
const BAR_HEIGHT: usize = 6;
/// Most pixels of a contact sheet across or down.
const MAX_PIXELS: usize = 30_000;

/// Pictures of `members`, coloured by the first species, all on one scale and seen from one place; `None`
/// without a sheet.
///
/// # Errors
/// If a picture cannot be drawn.
pub fn contact_sheet(plan: &Plan, members: &[MemberResults]) -> Result<Option<Picture>> {
    let shown: Vec<&ShownState> = members.iter().filter_map(|f| f.shown.as_ref()).collect();
    let shapes: Vec<Shape<'_>> = shown.iter().map(|shown| shape(shown)).collect();
    let across = match &plan.axes[..] {
        [_] => members.len().clamp(1, ACROSS),
        axes => axes.last().map_or(1, |axis| axis.values.len().max(1)),
    };
    let tile = if across > SMALL_TILE_COUNT { SMALL_TILE } else { TILE };
    let mut sheet = ContactSheet::new(&shapes, tile);
    // Room for a word.
    let height = sheet.height().max(LINE);
    let row = 2 * LINE + height + GAP;
    let bottom = GAP + row * members.len().div_ceil(across);
    let size = ((tile * across).max(2 * TILE), bottom + LINE + GAP);
    if shapes.is_empty() || size.0.max(size.1) > MAX_PIXELS {
        return Ok(None);
    }
    sheet.resize(size.0, size.1);
    let cut = |text: String| -> String { text.chars().take((tile - GAP) / LETTER_WIDTH).collect() };
    let last = plan.axes.len().saturating_sub(1);
    for (number, found) in members.iter().enumerate() {
        let (left, top) = (number % across * tile, GAP + number / across * row);
        let tile_label = plan.label(&found.at, |k| k == last);
        let below = if last > 0 {
            if number % across == 0 {
                sheet.write(plan.label(&found.at, |k| k != last), left + GAP, top);
            }
            format!("{tile_label}, {}", caption(found))
        } else {
            sheet.write(cut(tile_label), left + GAP, top);
            caption(found)
        };
        sheet.write(cut(below), left + GAP, top + LINE);
        let (width, left_of_box, top) = (tile - GAP, left + GAP / 2, top + 2 * LINE);
        let failed = matches!(found.status, MemberStatus::Failed | MemberStatus::Killed);
        if let Some(shown) = &found.shown {
            sheet.draw(&shape(shown), left, top);
            if failed {
                sheet.fill((width, BAR_HEIGHT), FAILED_COLOUR, left_of_box, top + height);
            }
        } else {
            let size = (width, height.saturating_sub(GAP).max(1));
            sheet.fill(
                size,
                if failed { FAILED_COLOUR } else { ABSENT_COLOUR },
                left_of_box,
                top + GAP / 2,
            );
        }
    }
    let name = shown.iter().find_map(|s| s.species.as_ref()).map_or("", |(name, _)| name);
    sheet.finish(name, bottom).map(Some)
}

fn shape(shown: &ShownState) -> Shape<'_> {
    let values = shown.species.as_ref().map(|(_, values)| values);
    Shape { x: &shown.x, triangles: &shown.triangles, values }
}

/// Time that a member has reached, and how it stands unless it is complete.
fn caption(found: &MemberResults) -> String {
    let time = found.measures.last().map(|m| format!("t = {}", label(m.time)));
    match (found.status, time) {
        (MemberStatus::Complete, Some(time)) => time,
        (status, Some(time)) => format!("{time}, {status}"),
        (status, None) => status.to_string(),
    }
}
