//! The readers, for targets of `cargo fuzz`.

#[allow(dead_code, reason = "the suite uses the rest")]
#[path = "../common/counting.rs"]
mod counting;
#[allow(dead_code, reason = "the suite and `05_fuzz` use the rest")]
mod readers;

use std::fs;
use std::path::PathBuf;

use readers::{Reader, named};

/// In this folder valid inputs are written, for the fuzzer to begin with.
const SEEDS: &str = "RUMPLE_FUZZ_SEEDS";

fn reader(name: &str) -> &'static Reader {
    named(name).unwrap_or_else(|| panic!("no reader {name}"))
}

/// One-time set-up of a reader, excluded from its cost; writes its valid inputs.
///
/// # Panics
/// Where they cannot be written.
pub fn prepare(name: &str) {
    let seeds = (reader(name).seeds)();
    seeds.first().map(|first| (reader(name).read)(first));
    let Some(folder) = std::env::var_os(SEEDS).map(PathBuf::from) else { return };
    for (number, seed) in seeds.iter().enumerate() {
        let path = folder.join(number.to_string());
        fs::write(&path, seed).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    }
}

/// Reads an input unchanged, and with corrected checksums where it has any.
///
/// # Panics
/// Where the reader does, or takes more memory than it may.
pub fn read(name: &str, input: &[u8]) {
    let reader = reader(name);
    bounded(reader, input);
    if let Some(repair) = reader.repair {
        let mut repaired = input.to_vec();
        repair(&mut repaired);
        bounded(reader, &repaired);
    }
}

fn bounded(reader: &Reader, input: &[u8]) {
    let (_, peak) = counting::peak_of(|| (reader.read)(input));
    let bound = reader.bound.of(input.len());
    assert!(peak <= bound, "{peak} bytes of at most {bound} for {}", input.len());
}
