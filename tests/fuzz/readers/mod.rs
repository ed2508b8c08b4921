//! All readers of untrusted input, each with valid inputs and the memory
//! that it may take; and mutations of those inputs.
//!
//! One list for all who try them: `05_fuzz` and the suite.

pub mod built;
mod formulas;
pub mod mutate;
mod results;
mod scenes;
mod studies;
mod surfaces;

use std::fs;
use std::path::{Path, PathBuf};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

pub use formulas::LAW;

/// A reader of the program.
pub struct Reader {
    /// Name.
    pub name: &'static str,
    /// What it may take.
    pub bound: Bound,
    /// Valid inputs that mutations begin with; those of the corpus are added.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Reads an input by way of the library; whether it was accepted. May not panic.
    pub read: fn(&[u8]) -> bool,
    /// Makes checksums of a mutated input right, so that what is behind them is tried too.
    pub repair: Option<fn(&mut [u8])>,
}

/// The most memory that reading may take besides the input: `fixed + per_byte * bytes of the input`.
#[derive(Clone, Copy)]
pub struct Bound {
    /// MiB whatever the input.
    pub fixed: usize,
    /// Bytes for each byte of the input.
    pub per_byte: usize,
}

impl Bound {
    /// In bytes, for an input of `size` bytes.
    pub fn of(self, size: usize) -> usize {
        (self.fixed << 20) + self.per_byte * size
    }
}

const fn bound(fixed: usize, per_byte: usize) -> Bound {
    Bound { fixed, per_byte }
}

/// All of them.
pub const ALL: [Reader; 24] = [
    scenes::SCENE,
    built::BUILT,
    scenes::OVERRIDE,
    scenes::AXIS,
    formulas::FORMULA,
    LAW,
    surfaces::OBJ,
    surfaces::PLY,
    surfaces::STL,
    surfaces::MSH,
    surfaces::VTU,
    surfaces::VTP,
    surfaces::VTK,
    surfaces::STATE,
    results::CHECKPOINT,
    results::LEDGER,
    results::EVENTS,
    results::STATUS,
    results::PROVENANCE,
    results::COSTS,
    studies::STATES,
    studies::SWEEP,
    studies::MEASURES,
    studies::ACCURACY,
];

/// The reader of this name.
pub fn named(name: &str) -> Option<&'static Reader> {
    static READERS: [Reader; ALL.len()] = ALL;
    READERS.iter().find(|reader| reader.name == name)
}

impl Reader {
    /// Valid inputs, and those of the corpus.
    pub fn all_seeds(&self) -> Vec<Vec<u8>> {
        let mut seeds = (self.seeds)();
        seeds.extend(self.corpus().into_iter().map(|(_, bytes)| bytes));
        seeds
    }

    /// The inputs of the corpus with their names: those that once broke something, and hostile ones made by
    /// hand.
    pub fn corpus(&self) -> Vec<(PathBuf, Vec<u8>)> {
        let folder = root().join("tests/fuzz/corpus").join(self.name);
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        let mut files: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
        files.sort();
        files
            .into_iter()
            .filter_map(|path| fs::read(&path).ok().map(|bytes| (path, bytes)))
            .collect()
    }

    /// Input number `number` of those that `seed` gives; the same wherever and whenever it is made.
    /// The first are the valid ones themselves.
    pub fn input(&self, seeds: &[Vec<u8>], seed: u64, number: u64) -> Vec<u8> {
        if let Some(seed) = usize::try_from(number).ok().and_then(|number| seeds.get(number)) {
            return seed.clone();
        }
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&number.to_le_bytes());
        self.name.bytes().zip(&mut key[16..]).for_each(|(byte, place)| *place = byte);
        let mut random = ChaCha8Rng::from_seed(key);
        let mut input = mutate::input(&mut random, seeds);
        // Most of them: a wrong checksum hides all that follows.
        if let Some(repair) = self.repair.filter(|_| !number.is_multiple_of(8)) {
            repair(&mut input);
        }
        input
    }
}

/// The root of the repository.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    // That of the suite, of an example or of the targets.
    let root = here.ancestors().find(|folder| folder.join("tests/fuzz").is_dir());
    root.unwrap_or(here).to_owned()
}

thread_local! {
    static ROOM: Option<TempDir> = tempfile::tempdir().ok();
}

/// A folder of this thread (`TMPDIR` says where).
fn room() -> PathBuf {
    ROOM.with(|room| room.as_ref().map_or_else(std::env::temp_dir, |room| room.path().to_owned()))
}

/// A file of this thread that holds these bytes.
fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = room().join(name);
    fs::write(&path, bytes).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    path
}

/// The files in `tests/data` that end so.
fn data(ending: &str) -> Vec<Vec<u8>> {
    let entries = fs::read_dir(root().join("tests/data")).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == ending));
    files.sort();
    files.into_iter().filter_map(|path| fs::read(path).ok()).collect()
}
