//! The reader that `RUMPLE_READER` names, for libFuzzer; readers with checksums get inputs with right ones.

#![no_main]

#[allow(dead_code, reason = "the command uses the rest")]
#[path = "../readers/mod.rs"]
mod readers;

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use readers::Reader;

static READER: LazyLock<&Reader> = LazyLock::new(|| {
    let name = std::env::var("RUMPLE_READER").unwrap_or_default();
    readers::named(&name).unwrap_or_else(|| {
        let known: Vec<&str> = readers::ALL.iter().map(|reader| reader.name).collect();
        panic!("RUMPLE_READER is one of {}", known.join(", "))
    })
});

fuzz_target!(|input: &[u8]| {
    match READER.repair {
        Some(repair) => {
            let mut input = input.to_vec();
            repair(&mut input);
            (READER.read)(&input);
        }
        None => {
            (READER.read)(input);
        }
    }
});
