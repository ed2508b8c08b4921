//! Columns of a ledger, in single precision and with few rows.

use std::path::Path;

use serde::Serialize;

use super::blocks::Blocks;
use super::record::text_of;
use crate::num::single;
use crate::output::ledger::{titles, value};
use crate::output::{OutputError, ResultDirectory};
use crate::run::Result;

/// Most rows: about as many as a plot has pixels across.
const MAX_ROWS: usize = 1000;

/// A ledger as the page has it.
#[derive(Debug, Serialize)]
pub(super) struct Columns {
    /// Their titles.
    columns: Vec<String>,
    /// Rows that are kept.
    rows: usize,
    /// Rows that there are.
    of: usize,
    /// Block of the columns one after another, 32-bit floats.
    block: usize,
}

/// Reads the ledger of the run in `root`: every k-th row and the last one. None without a ledger or a row, which `warnings`
/// then have, as they have an unfinished last row, which a killed run may leave and which is dropped.
///
/// # Errors
/// A row that is none, with its line.
pub(super) fn read(
    root: &Path,
    blocks: &mut Blocks,
    warnings: &mut Vec<String>,
) -> Result<Option<Columns>> {
    let path = root.join(ResultDirectory::LEDGER);
    let Some(text) = text_of(&path)? else {
        warnings.push(format!("no {}", ResultDirectory::LEDGER));
        return Ok(None);
    };
    let (complete, unfinished) = text.rsplit_once('\n').unwrap_or(("", &text));
    if !unfinished.is_empty() || complete.is_empty() {
        let name = ResultDirectory::LEDGER;
        warnings.push(format!("{name} ends within a line: the run was killed, or the file is cut"));
    }
    let mut lines = complete.lines();
    let columns = titles(lines.next().unwrap_or_default());
    let body: Vec<&str> = lines.collect();
    let (of, every) = (body.len(), body.len().div_ceil(MAX_ROWS).max(1));
    let mut rows = Vec::new();
    for (k, line) in body.iter().enumerate().filter(|(k, _)| k % every == 0 || k + 1 == of) {
        let numbers: Option<Vec<f64>> = line.split(',').map(value).collect();
        match numbers.filter(|numbers| numbers.len() == columns.len()) {
            Some(numbers) => rows.push(numbers),
            None => {
                let message = format!("expected {} numbers, found `{line}`", columns.len());
                return Err(OutputError::Ledger { path, line: k + 2, message }.into());
            }
        }
    }
    if rows.is_empty() {
        return Ok(None);
    }
    let cells = (0..columns.len()).flat_map(|c| rows.iter().map(move |row| single(row[c])));
    let block = blocks.add(cells.flat_map(f32::to_le_bytes).collect());
    Ok(Some(Columns { columns, rows: rows.len(), of, block }))
}
