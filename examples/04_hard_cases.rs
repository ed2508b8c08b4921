//! The table of hard cases, as it stands in `docs/hard-cases.md`: every case of `models/hard/cases.toml` is run
//! and held against what is expected of it.
//!
//! ```sh
//! cargo build --release --workspace
//! cargo run --release --example 04_hard_cases             # all but the slow ones, some minutes
//! cargo run --release --example 04_hard_cases steep flat  # these cases
//! cargo run --release --example 04_hard_cases --slow      # all; an hour
//! ```
//!
//! The exit code is 1 if a case does not do what is expected.

mod hard_cases;

use std::process::ExitCode;

use hard_cases::{Options, Outcome, run};

/// Runs the cases and prints their table.
///
/// # Errors
/// A file of cases that cannot be read, a program that cannot be started.
fn main() -> Outcome<ExitCode> {
    let mut options = Options::default();
    for argument in std::env::args().skip(1) {
        match argument.as_str() {
            "--slow" => options.slow = true,
            name => options.only.push(name.to_owned()),
        }
    }
    let failed = run(&options)?;
    Ok(if failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
