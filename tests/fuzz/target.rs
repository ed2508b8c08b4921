//! A target of `cargo fuzz`: the reader of its name.

#![no_main]

use libfuzzer_sys::fuzz_target;

const NAME: &str = env!("CARGO_BIN_NAME");

fuzz_target!(init: rumple_fuzz::prepare(NAME), |input: &[u8]| rumple_fuzz::read(NAME, input));
