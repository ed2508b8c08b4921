//! A Rust program that embeds the library: its signal handlers and its end are its own.

use std::collections::BTreeMap;
use std::fs;
use std::process::{Command, Stdio};

use rumple::kinetics::{Batch, Column, Location, call_under_way, field};

use super::build::library;

const CHILD: &str = "RUMPLE_TEST_EMBEDDING";

/// Masks of caught and of ignored signals of this process.
fn signal_masks() -> Vec<String> {
    let text = fs::read_to_string("/proc/self/status").unwrap();
    let is_mask = |line: &&str| ["SigCgt:", "SigIgn:"].iter().any(|key| line.starts_with(key));
    text.lines().filter(is_mask).map(str::to_owned).collect()
}

/// The other half of the test below, in a process where no other test changes anything.
#[test]
fn child_evaluates_a_plugin() {
    if std::env::var_os(CHILD).is_none() {
        return;
    }
    let before = signal_masks();
    assert_eq!(before.len(), 2, "{before:?}");
    let law = library("curvature-feedback").instantiate(&BTreeMap::new()).unwrap();
    let c = [0.25; 2];
    let batch = Batch {
        location: Location::Vertex,
        first: 0,
        count: 2,
        species: &[(&c[..]).into()],
        signals: &[Column::uniform(&0.125)],
        parameters: &[],
    };
    field::rates(&law, &batch, &mut [&mut [0.0; 2]]).unwrap();
    drop(law);
    assert_eq!(signal_masks(), before);
    assert!(call_under_way(|_, _| ()).is_none());
}

#[test]
fn the_library_installs_no_signal_handler() {
    let out = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "plugins::embedding::child_evaluates_a_plugin", "--nocapture"])
        .env(CHILD, "1")
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&out.stdout) + String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success() && text.contains("1 passed"), "{text}");
}
