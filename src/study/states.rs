//! States of a run at its output times, to the last bit and with all species, whatever its frames hold.
//!
//! ```text
//! header   16 bytes of text
//! state    time, step, count of vertices, count of species, count of points of every species
//!          positions, then values of every species
//! ```
//!
//! Numbers are little-endian, of 64 bits. A file is appended to; a last state that is cut short is none.

use std::fs::{self, File};
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
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
    /// Begins a file.
    ///
    /// # Errors
    /// From the operating system.
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let failed = |source| OutputError::Write { path: path.to_owned(), source };
        let mut file = File::create(path).map_err(failed)?;
        file.write_all(HEADER).map_err(failed)?;
        Ok(Self { file, path: path.to_owned() })
    }

    /// Opens the file of an earlier run to go on after the states at `times`; others are dropped.
    ///
    /// # Errors
    /// From the operating system.
    pub fn reopen(path: &Path, times: &[f64]) -> Result<Self, OutputError> {
        let states = read(path);
        let mut file = Self::create(path)?;
        states
            .iter()
            .filter(|state| times.contains(&state.time))
            .try_for_each(|s| file.append(s))?;
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
        let failed = |source| OutputError::Write { path: self.path.clone(), source };
        self.file.write_all(&bytes).map_err(failed)
    }
}

/// The states in a file, as far as they are whole; none where there is no such file.
#[must_use]
pub fn read(path: &Path) -> Vec<State> {
    let bytes = fs::read(path).unwrap_or_default();
    let Some(mut rest) = bytes.strip_prefix(HEADER) else { return Vec::new() };
    let mut states = Vec::new();
    while let Some(state) = next(&mut rest) {
        states.push(state);
    }
    states
}

/// The times of the states in a file, as far as they are whole, without reading these.
#[must_use]
pub fn times(path: &Path) -> Vec<f64> {
    let Ok(file) = File::open(path) else { return Vec::new() };
    let length = file.metadata().map_or(0, |data| data.len());
    let mut reader = BufReader::new(file);
    let mut header = [0; HEADER.len()];
    if reader.read_exact(&mut header).is_err() || header != *HEADER {
        return Vec::new();
    }
    let mut times = Vec::new();
    let mut at = HEADER.len() as u64;
    while let Some((time, size)) = head(&mut reader) {
        at = at.saturating_add(size);
        if at > length || reader.seek(SeekFrom::Start(at)).is_err() {
            break;
        }
        times.push(time);
    }
    times
}

/// Time and length in bytes of the state that begins here.
fn head(reader: &mut impl Read) -> Option<(f64, u64)> {
    let mut word = || {
        let mut word = [0; 8];
        reader.read_exact(&mut word).ok().map(|()| word)
    };
    let time = f64::from_le_bytes(word()?);
    let mut count = || word().map(u64::from_le_bytes);
    let (_, vertices, species) = (count()?, count()?, count()?);
    // Ends with the bytes, however many there are said to be.
    let points = (0..species).try_fold(0u64, |sum, _| sum.checked_add(count()?))?;
    let numbers = vertices.checked_mul(3)?.checked_add(points)?;
    let words = numbers.checked_add(species)?.checked_add(4)?;
    Some((time, words.checked_mul(8)?))
}

fn next(rest: &mut &[u8]) -> Option<State> {
    let mut word = || -> Option<[u8; 8]> {
        let (word, after) = rest.split_first_chunk::<8>()?;
        *rest = after;
        Some(*word)
    };
    let (time, step) = (f64::from_le_bytes(word()?), u64::from_le_bytes(word()?));
    let mut count = || word().and_then(|word| usize::try_from(u64::from_le_bytes(word)).ok());
    let (vertices, species) = (count()?, count()?);
    // Ends with the bytes, however many there are said to be.
    let points: Vec<usize> = (0..species).map(|_| count()).collect::<Option<_>>()?;
    let mut numbers = |count: usize| -> Option<Vec<f64>> {
        let (bytes, after) = rest.split_at_checked(count.checked_mul(8)?)?;
        *rest = after;
        let number = |word: &[u8]| word.try_into().map_or(f64::NAN, f64::from_le_bytes);
        Some(bytes.chunks_exact(8).map(number).collect())
    };
    let x = numbers(vertices.checked_mul(3)?)?;
    let x: Vec<_> = x.chunks_exact(3).map(|x| Vec3::new(x[0], x[1], x[2])).collect();
    let species = points.into_iter().map(numbers).collect::<Option<_>>()?;
    Some(State { time, step, x: x.into(), species })
}
