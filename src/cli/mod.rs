//! Commands: each parses its arguments, calls the library and prints.

pub mod mesh;

/// Runs the command line and returns the exit code (0 done, 2 bad input, 1 anything else).
#[must_use]
pub fn main() -> std::process::ExitCode {
    std::process::ExitCode::SUCCESS
}
