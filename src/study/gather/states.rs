//! States of a run at its output times: exact, with all species.
//!
//! ```text
//! header   16 bytes of text
//! state    length and time, of 64 bits each, little-endian; then the state, a record of that length
//! ```
//!
//! A file is appended to; a last state that is cut short is none.

use std::fs::{self, File};
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::model::State;
use crate::output::OutputError;
use crate::record::Record;

const HEADER: &[u8; 16] = b"rumple states 2\n";

/// Writes states one after the other.
pub struct StateFile {
    file: File,
    path: PathBuf,
}

impl StateFile {
    /// Opens the file at `path`; of an earlier one the states at the times `kept` remain.
    ///
    /// # Errors
    /// From the operating system.
    pub fn reopen(path: &Path, kept: &[f64]) -> Result<Self, OutputError> {
        let states = read(path);
        let mut file = File::create(path).map_err(OutputError::write(path))?;
        file.write_all(HEADER).map_err(OutputError::write(path))?;
        let mut file = Self { file, path: path.to_owned() };
        let mut kept = states.iter().filter(|state| kept.contains(&state.time));
        kept.try_for_each(|state| file.append(state))?;
        Ok(file)
    }

    /// Appends a state.
    ///
    /// # Errors
    /// From the operating system.
    pub fn append(&mut self, state: &State) -> Result<(), OutputError> {
        let record = Record::of(state);
        let record = record.as_bytes();
        let head = [(record.len() as u64).to_le_bytes(), state.time.to_le_bytes()];
        let bytes = [&head[0], &head[1], record].concat();
        self.file.write_all(&bytes).map_err(OutputError::write(&self.path))
    }
}

/// The states in a file, as far as they are complete; none where there is no such file.
#[must_use]
pub fn read(path: &Path) -> Vec<State> {
    let bytes = fs::read(path).unwrap_or_default();
    let mut rest = bytes.strip_prefix(HEADER).unwrap_or_default();
    std::iter::from_fn(|| state(&mut rest)).collect()
}

/// The times of the states in a file, as far as they are complete, without reading these.
pub(crate) fn times(path: &Path) -> Vec<f64> {
    let Ok(file) = File::open(path) else { return Vec::new() };
    let length = file.metadata().map_or(0, |data| data.len());
    let mut reader = BufReader::new(file);
    let mut header = [0; HEADER.len()];
    if reader.read_exact(&mut header).is_err() || header != *HEADER {
        return Vec::new();
    }
    let next = || {
        let (bytes, time) = head(&mut reader)?;
        let end = reader.stream_position().ok()?.checked_add(bytes)?;
        reader.seek(SeekFrom::Start(end)).ok().filter(|_| end <= length)?;
        Some(time)
    };
    std::iter::from_fn(next).collect()
}

/// Length and time of the state that begins here.
fn head(reader: &mut impl Read) -> Option<(u64, f64)> {
    let mut word = || {
        let mut word = [0; 8];
        reader.read_exact(&mut word).ok().map(|()| word)
    };
    Some((u64::from_le_bytes(word()?), f64::from_le_bytes(word()?)))
}

fn state(rest: &mut &[u8]) -> Option<State> {
    let (bytes, _) = head(rest)?;
    let (record, after) = rest.split_at_checked(usize::try_from(bytes).ok()?)?;
    *rest = after;
    Record::from(record.to_vec()).read().ok()
}
