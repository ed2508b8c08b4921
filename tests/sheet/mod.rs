//! Sheets: generators, checks, readers.

mod check;
mod command;
mod formats;
mod generate;
mod legacy;
mod polygon;
pub(crate) mod read;
mod vtkio_faults;
mod write;

/// Random cases that are the same in every run.
fn fixed(cases: u32) -> proptest::test_runner::Config {
    proptest::test_runner::Config {
        cases,
        rng_seed: proptest::test_runner::RngSeed::Fixed(20_261_121),
        failure_persistence: None,
        ..Default::default()
    }
}
