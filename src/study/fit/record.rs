//! What is known already: residuals by parameters, in a file that a fit continues from.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::output::OutputError;
use crate::run::Result;
use crate::solve::replay::Schedule;

/// An evaluation.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Entry {
    /// p.
    pub(super) values: Vec<f64>,
    /// Values of the model beside the data; none where the run failed.
    pub(super) model: Option<Vec<f64>>,
    /// The steps of the replays from here on, where they were chosen again.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) schedule: Option<(Schedule, Vec<f64>)>,
}

/// All evaluations, by p.
#[derive(Debug)]
pub(super) struct Record {
    path: PathBuf,
    file: File,
    known: HashMap<Vec<u64>, Entry>,
}

impl Record {
    /// Those of the file at `path`, to which others are added. A last line that was cut off is removed.
    ///
    /// # Errors
    /// What cannot be read or written.
    pub(super) fn open(path: &Path) -> Result<Self> {
        let mut file = OpenOptions::new()
            .read(true)
            .append(true)
            .create(true)
            .open(path)
            .map_err(OutputError::write(path))?;
        let text = std::fs::read_to_string(path).map_err(OutputError::read(path))?;
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let lines = text[..whole].lines();
        let entries: Vec<Entry> = lines.map_while(|line| serde_json::from_str(line).ok()).collect();
        // What follows a damaged line is dropped.
        let kept: usize = text.lines().take(entries.len()).map(|line| line.len() + 1).sum();
        file.set_len(u64::try_from(kept).unwrap_or_default()).map_err(OutputError::write(path))?;
        file.flush().map_err(OutputError::write(path))?;
        let known = entries.into_iter().map(|entry| (key(&entry.values), entry)).collect();
        Ok(Self { path: path.to_owned(), file, known })
    }

    /// The evaluation at `values`.
    pub(super) fn find(&self, values: &[f64]) -> Option<&Entry> {
        self.known.get(&key(values))
    }

    /// Adds one.
    pub(super) fn add(&mut self, entry: Entry) -> Result<()> {
        let line = serde_json::to_string(&entry).unwrap_or_default();
        writeln!(self.file, "{line}").map_err(OutputError::write(&self.path))?;
        self.known.insert(key(&entry.values), entry);
        Ok(())
    }
}

fn key(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}
