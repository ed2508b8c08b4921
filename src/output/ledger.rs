//! The ledger: one row of numbers for every accepted step, as CSV.
//!
//! The first column is the number of the step; the others are named by the creator of the
//! ledger, with units in the names. Numbers are the shortest decimals that read back exactly; the cell of one that is
//! not finite, as the gap where nothing is near, is empty.

use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::encode::decimal;
use super::{OutputError, atomic};

/// An open ledger; rows go to the disk as they are appended.
#[derive(Debug)]
pub struct Ledger {
    path: PathBuf,
    file: File,
    columns: usize,
    rows: usize,
    /// Length of the file up to the last whole row.
    whole: u64,
}

impl Ledger {
    /// Creates the file `path` (replacing one that is there) with the header `columns`.
    ///
    /// # Errors
    /// [`OutputError::Write`] if the file cannot be written.
    pub fn create(path: &Path, columns: &[String]) -> Result<Self, OutputError> {
        let file = File::create(path).map_err(OutputError::write(path))?;
        let mut ledger =
            Self { path: path.to_owned(), file, columns: columns.len(), rows: 0, whole: 0 };
        ledger.write(&header(columns))?;
        Ok(ledger)
    }

    /// Opens the ledger of an earlier run to continue after `last_step`: later rows are dropped.
    ///
    /// A last row without its line end, which a killed run can leave, is dropped as well.
    ///
    /// # Errors
    /// [`OutputError::Read`] and [`OutputError::Write`] from the operating system;
    /// [`OutputError::Ledger`] with the line if the columns are not `columns` or a row does not
    /// have as many numbers, beginning with a step.
    pub fn reopen(path: &Path, columns: &[String], last_step: u64) -> Result<Self, OutputError> {
        let text = fs::read_to_string(path).map_err(OutputError::read(path))?;
        let refuse =
            |line, message| Err(OutputError::Ledger { path: path.to_owned(), line, message });
        let expected = header(columns);
        let Some(body) = text.strip_prefix(&expected) else {
            let found = text.lines().next().unwrap_or_default();
            return refuse(
                1,
                format!("expected the columns `{}`, found `{found}`", expected.trim_end()),
            );
        };
        let mut kept = expected.clone();
        let mut rows = 0;
        for (i, row) in body.split_inclusive('\n').enumerate() {
            let line = i + 2;
            if !row.ends_with('\n') {
                break;
            }
            let fields = row.trim_end().split(',').collect::<Vec<_>>();
            if fields.len() != columns.len() {
                return refuse(
                    line,
                    format!("expected {} numbers, found {}", columns.len(), fields.len()),
                );
            }
            let Ok(step) = fields[0].parse::<u64>() else {
                return refuse(line, format!("expected a step number, found `{}`", fields[0]));
            };
            if step <= last_step {
                kept += row;
                rows += 1;
            }
        }
        atomic::replace(path, |writer| writer.write_all(kept.as_bytes()))?;
        let file = OpenOptions::new().append(true).open(path).map_err(OutputError::write(path))?;
        let whole = kept.len() as u64;
        Ok(Self { path: path.to_owned(), file, columns: columns.len(), rows, whole })
    }

    /// Appends one row; cells of values that are not finite are empty.
    ///
    /// # Errors
    /// [`OutputError::Ledger`] if `values` has not one number for every column;
    /// [`OutputError::Write`] if the disk is full or refuses: the file then ends with the row
    /// before.
    pub fn append(&mut self, values: &[f64]) -> Result<(), OutputError> {
        if values.len() != self.columns {
            return Err(OutputError::Ledger {
                path: self.path.clone(),
                line: self.rows + 2,
                message: format!("expected {} numbers, got {}", self.columns, values.len()),
            });
        }
        let row = values.iter().map(|&x| cell(x)).collect::<Vec<_>>().join(",") + "\n";
        self.write(&row)?;
        self.rows += 1;
        Ok(())
    }

    /// Number of rows so far, without the header.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    fn write(&mut self, text: &str) -> Result<(), OutputError> {
        let written = self.file.write_all(text.as_bytes()).and_then(|()| self.file.flush());
        match written {
            Ok(()) => {
                self.whole += text.len() as u64;
                Ok(())
            }
            Err(source) => {
                // Takes back the half of a row that a full disk may have let through.
                let _ = self.file.set_len(self.whole);
                Err(OutputError::Write { path: self.path.clone(), source })
            }
        }
    }
}

/// The header line; names with commas, quotes or line ends are quoted as RFC 4180 says.
fn header(columns: &[String]) -> String {
    let quoted = columns.iter().map(|name| {
        if name.contains([',', '"', '\n', '\r']) {
            format!("\"{}\"", name.replace('"', "\"\"").replace(['\n', '\r'], " "))
        } else {
            name.clone()
        }
    });
    quoted.collect::<Vec<_>>().join(",") + "\n"
}

/// The cell of a value, which is empty where that is not finite.
pub(super) fn cell(value: f64) -> String {
    if value.is_finite() { decimal(value) } else { String::new() }
}

/// Returns the value of a cell, NaN for an empty one; none for text that is not a number.
#[must_use]
pub fn value(cell: &str) -> Option<f64> {
    if cell.is_empty() { Some(f64::NAN) } else { cell.parse().ok() }
}

/// Returns the titles of a header line, quoted as RFC 4180 says or not.
#[must_use]
pub fn titles(header: &str) -> Vec<String> {
    let mut titles = vec![String::new()];
    let (mut quoted, mut letters) = (false, header.chars().peekable());
    while let Some(letter) = letters.next() {
        match letter {
            '"' if quoted && letters.peek() == Some(&'"') => {
                letters.next();
                titles.last_mut().into_iter().for_each(|title| title.push('"'));
            }
            '"' => quoted = !quoted,
            ',' if !quoted => titles.push(String::new()),
            other => titles.last_mut().into_iter().for_each(|title| title.push(other)),
        }
    }
    titles
}
