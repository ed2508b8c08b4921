//! Totals of species, from the ledger of a member.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use crate::output::ResultDirectory;
use crate::output::ledger::{titles, value};
use crate::run::ledger_row::is_species_total;

/// Bytes at the end of a ledger that are searched: thousands of rows.
const TAIL: u64 = 1 << 20;

/// Titles and values of the totals of all species at `time` in the ledger of the run in `directory`; empty if the end
/// of the ledger has no row of that time.
pub(super) fn totals(directory: &Path, time: f64) -> Vec<(String, f64)> {
    let row = titled_row(&directory.join(ResultDirectory::LEDGER), time).unwrap_or_default();
    row.into_iter().filter(|(title, _)| is_species_total(title)).collect()
}

fn titled_row(path: &Path, time: f64) -> Option<Vec<(String, f64)>> {
    let mut file = BufReader::new(File::open(path).ok()?);
    let mut header = String::new();
    let header_length = file.read_line(&mut header).ok()? as u64;
    let length = file.get_ref().metadata().ok()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(TAIL).max(header_length))).ok()?;
    let mut tail = Vec::new();
    file.read_to_end(&mut tail).ok()?;
    let (tail, titles) = (String::from_utf8_lossy(&tail), titles(header.trim_end()));
    let numbers = |row: &str| -> Option<Vec<f64>> { row.split(',').map(value).collect() };
    // After the last line end is nothing, or a row under construction; the first row may lack its beginning.
    let mut rows = tail.rsplit('\n').skip(1).filter_map(numbers);
    let row = rows.find(|row| row.len() == titles.len() && row.get(1) == Some(&time))?;
    Some(titles.into_iter().zip(row).collect())
}
