//! The last rows of the ledger, with the rejected step attempts between them.

use std::fs;
use std::path::Path;

use crate::run::{Error, Simulation};
use crate::solve::rejections::Rejection;

/// Rows that are shown.
const MAX_ROWS: usize = 50;
/// What is added to the columns of the ledger.
const ADDED_COLUMNS: &str = "rejected because,message";

/// The table: rows as in the ledger at `path`; those of rejected attempts have their step, where they began, their length and
/// error estimate, the cause and its words. The last one is what the run ended with.
pub(super) fn last(path: &Path, simulation: &Simulation, error: &Error) -> String {
    let text = fs::read_to_string(path).unwrap_or_default();
    let (header, body) = text.split_once('\n').unwrap_or_default();
    let columns = fields(header);
    let rows: Vec<&str> = body.split_inclusive('\n').filter(|row| row.ends_with('\n')).collect();
    let rows = &rows[rows.len().saturating_sub(MAX_ROWS)..];
    let number = |row: &str| row.split(',').next().and_then(|step| step.parse::<u64>().ok());
    let first = rows.first().and_then(|row| number(row)).unwrap_or(0);
    let mut attempts =
        simulation.stepper.workspace.rejections().last().filter(|t| t.step > first).peekable();
    let mut table = format!("{header},{ADDED_COLUMNS}\n");
    let mut add = |table: &mut String, until: Option<u64>| {
        while let Some(rejected) = attempts.next_if(|t| until.is_none_or(|until| t.step <= until)) {
            *table += &row_of(rejected, columns);
        }
    };
    for row in rows {
        add(&mut table, number(row));
        table += &format!("{},,\n", row.trim_end());
    }
    add(&mut table, None);
    let state = simulation.state();
    let start = format!("{},{}", state.step + 1, state.time);
    let blank = ",".repeat(columns.saturating_sub(1));
    table += &format!("{start}{blank}the run ended,{}\n", quoted(&error.to_string()));
    table
}

/// The row of a try, in a table with so many columns besides.
fn row_of(rejected: &Rejection, columns: usize) -> String {
    let Rejection { step, time, length, error, cause, message } = rejected;
    let error = if error.is_nan() { String::new() } else { error.to_string() };
    let blank = ",".repeat(columns.saturating_sub(3));
    format!("{step},{time},{length},{error}{blank}{},{}\n", cause.name(), quoted(message))
}

/// How many fields a line has.
fn fields(line: &str) -> usize {
    let mut quoted = false;
    let commas = line.chars().filter(|c| {
        quoted ^= *c == '"';
        *c == ',' && !quoted
    });
    commas.count() + 1
}

/// A text as one field.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\"").replace(['\n', '\r'], " "))
}
