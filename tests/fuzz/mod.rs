//! No input makes a reader panic, or take more memory than is stated; formulas mean what they say.
//!
//! `05_fuzz` tries many more inputs, also for crashes and for those that take too long.

mod built;
mod formulas;
mod limits;
#[allow(dead_code, reason = "the command uses the rest")]
mod readers;

use std::panic::{AssertUnwindSafe, catch_unwind};

use readers::{ALL, Reader};

use crate::common::peak_of;

/// Inputs that every reader is given, besides those of the corpus.
const INPUTS: u64 = 100;

fn survives(reader: &Reader, input: &[u8], what: &str) -> bool {
    let read = || catch_unwind(AssertUnwindSafe(|| (reader.read)(input)));
    let (result, peak) = peak_of(read);
    let Ok(accepted) = result else { panic!("{}: {what} makes it panic", reader.name) };
    let bound = reader.bound.of(input.len());
    assert!(peak <= bound, "{}: {what} takes {peak} bytes of at most {bound}", reader.name);
    accepted
}

#[test]
fn no_input_makes_a_reader_panic_or_greedy() {
    let (mut accepted, mut refused) = (0, 0);
    for reader in &ALL {
        let seeds = (reader.seeds)();
        // One-time set-up is excluded.
        let valid = seeds.iter().filter(|seed| (reader.read)(seed)).count();
        assert!(valid > 0, "{} accepts none of its valid inputs", reader.name);
        for (path, input) in reader.corpus() {
            survives(reader, &input, &path.display().to_string());
        }
        let number = |k: u64| k + seeds.len() as u64;
        for number in (0..INPUTS).map(number) {
            let input = reader.input(&seeds, 1, number);
            match survives(reader, &input, &format!("input {number} of seed 1")) {
                true => accepted += 1,
                false => refused += 1,
            }
        }
    }
    // Mutations are neither all harmless nor all alike.
    assert!(accepted > INPUTS && refused > 5 * INPUTS, "{accepted} accepted, {refused} refused");
}

#[test]
fn inputs_are_the_same_wherever_they_are_made() {
    let reader = readers::named("obj").unwrap();
    let seeds = (reader.seeds)();
    let inputs = |seed| (2..50).map(move |k| reader.input(&seeds, seed, k)).collect::<Vec<_>>();
    let (one, other) = (inputs(1), (reader.seeds)());
    assert!((2..50).all(|k| one[k - 2] == reader.input(&other, 1, k as u64)));
    assert!(one != (2..50).map(|k| reader.input(&other, 2, k)).collect::<Vec<_>>());
}

#[test]
fn every_reader_has_a_target() {
    let path = readers::root().join("tests/fuzz/Cargo.toml");
    let text = std::fs::read_to_string(path).unwrap();
    let names: Vec<&str> =
        text.lines().filter_map(|line| line.strip_prefix("name = \"")?.strip_suffix('"')).collect();
    // The first is that of the crate.
    assert!(names[1..].iter().eq(ALL.iter().map(|reader| &reader.name)), "{names:?}");
}
