//! Hostile inputs for everything that reads: the table of `docs/notebook/hostile-files.md`.
//!
//! ```sh
//! cargo run --release --example 05_fuzz                            # 10 000 inputs for every reader
//! cargo run --release --example 05_fuzz -- vtu obj --inputs 1000   # fewer, for these
//! cargo run --release --example 05_fuzz -- --seed 7                # others
//! cargo run --release --example 05_fuzz -- vtu --file PATH         # one input, unchanged
//! ```
//!
//! An input is a mutation of a valid one, and the same for the same seed and number. Each is read in a process
//! that may fail: a panic, a crash, more than 10 s or more memory than the reader's bound is a fault, whose
//! input is kept in `results/fuzz`. The exit code is 1 if there is any.

#[allow(dead_code, reason = "the suite uses the rest")]
#[path = "../tests/common/counting.rs"]
mod counting;
mod fuzz;
#[path = "../tests/fuzz/readers/mod.rs"]
mod readers;

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

/// What the command line asks for.
struct Options {
    inputs: u64,
    seed: u64,
    readers: Vec<&'static readers::Reader>,
    file: Option<PathBuf>,
    /// Of a process that reads: the first input, and where valid inputs are.
    child: Option<(u64, PathBuf)>,
}

/// Tries the readers.
///
/// # Errors
/// A word of the command line that means nothing; a process that cannot be started.
fn main() -> Result<ExitCode, Box<dyn Error>> {
    let mut options =
        Options { inputs: 10_000, seed: 1, readers: Vec::new(), file: None, child: None };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--inputs" => options.inputs = value()?.parse()?,
            "--seed" => options.seed = value()?.parse()?,
            "--file" => options.file = Some(value()?.into()),
            "--child" => options.child = Some((value()?.parse()?, value()?.into())),
            name => {
                let known: Vec<_> = readers::ALL.iter().map(|reader| reader.name).collect();
                let unknown = || format!("no reader {name}; there are {}", known.join(", "));
                options.readers.push(readers::named(name).ok_or_else(unknown)?);
            }
        }
    }
    if options.readers.is_empty() {
        options.readers = readers::ALL.iter().filter_map(|r| readers::named(r.name)).collect();
    }
    match (&options.file, &options.child) {
        (Some(path), _) => fuzz::trial::one(&options, path),
        (None, Some((from, seeds))) => fuzz::trial::all(&options, *from, seeds),
        (None, None) => fuzz::watch::table(&options),
    }
}
