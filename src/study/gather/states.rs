//! States of a run at its output times: exact, with all species; without internal variables.
//!
//! ```text
//! header   16 bytes of text
//! state    time, step, count of vertices, count of species, count of points of every species
//!          positions, then values of every species
//! ```
//!
//! Numbers are little-endian, of 64 bits. A file is appended to; a last state that is cut short is none.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use crate::Vec3;
use crate::model::State;
use crate::output::OutputError;

const HEADER: &[u8; 16] = b"rumple states 1\n";

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
        let mut bytes = state.time.to_le_bytes().to_vec();
        let counts = [state.x.len(), state.species.len()];
        let counts = counts.into_iter().chain(state.species.iter().map(Vec::len));
        bytes.extend(state.step.to_le_bytes());
        bytes.extend(counts.flat_map(|count| (count as u64).to_le_bytes()));
        bytes.extend(state.x.iter().flat_map(|x| x.iter()).flat_map(|x| x.to_le_bytes()));
        bytes.extend(state.species.iter().flatten().flat_map(|c| c.to_le_bytes()));
        self.file.write_all(&bytes).map_err(OutputError::write(&self.path))
    }
}

/// The complete states in a file; none if it does not exist.
#[must_use]
pub fn read(path: &Path) -> Vec<State> {
    let bytes = fs::read(path).unwrap_or_default();
    let mut rest = bytes.strip_prefix(HEADER).unwrap_or_default();
    std::iter::from_fn(|| state(&mut rest)).collect()
}

/// The state that begins here, if it is complete.
fn state(rest: &mut &[u8]) -> Option<State> {
    let mut word = || {
        let (word, after) = rest.split_first_chunk::<8>()?;
        *rest = after;
        Some(u64::from_le_bytes(*word))
    };
    let (time, step) = (f64::from_bits(word()?), word()?);
    let mut count = || usize::try_from(word()?).ok();
    let (vertices, species) = (count()?, count()?);
    // Ends with the bytes, whatever the count of species.
    let points = (0..species).map(|_| count()).collect::<Option<Vec<usize>>>()?;
    let mut numbers = |count: usize| -> Option<Vec<f64>> {
        let (bytes, after) = rest.split_at_checked(count.checked_mul(8)?)?;
        *rest = after;
        Some(bytes.as_chunks().0.iter().map(|word| f64::from_le_bytes(*word)).collect())
    };
    let x = numbers(vertices.checked_mul(3)?)?;
    let x: Vec<Vec3> = x.as_chunks().0.iter().map(|x: &[f64; 3]| Vec3::from(*x)).collect();
    let species = points.into_iter().map(numbers).collect::<Option<_>>()?;
    Some(State { time, step, x: x.into(), species, ..State::default() })
}
