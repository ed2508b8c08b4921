//! The table that `docs/notebook/hard-cases.md` sums up: every case of `models/hard/cases.toml` is run
//! and compared with the expected outcome.
//!
//! ```sh
//! cargo build --release
//! cargo run --release --example 04_hard_cases             # all but the slow ones, some minutes
//! cargo run --release --example 04_hard_cases steep flat  # these cases
//! cargo run --release --example 04_hard_cases --slow      # all; some minutes more
//! ```
//!
//! `RUMPLE` may say which program is tried, and `BENCH` where the source of the paper's scheme is, for rows beside some
//! cases. Results are in `results/hard`. The exit code is 1 if a case does not do what is expected.

mod hard_cases;

use std::path::PathBuf;
use std::process::ExitCode;

use hard_cases::{Options, Outcome, run};

/// Runs the cases and prints their table.
///
/// # Errors
/// A file of cases that cannot be read, a program that cannot be started.
fn main() -> Outcome<ExitCode> {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let program = std::env::var_os("RUMPLE")
        .map_or_else(|| root.join("target/release/rumple"), PathBuf::from);
    let results = root.join("results/hard");
    let mut options = Options {
        slow: false,
        beside: true,
        patience: 1.0,
        only: Vec::new(),
        root,
        program,
        results,
    };
    for argument in std::env::args().skip(1) {
        match argument.as_str() {
            "--slow" => options.slow = true,
            name => options.only.push(name.to_owned()),
        }
    }
    let failed = run(&options)?;
    Ok(if failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
