//! What a run leaves that failed: a folder that says why, and a checkpoint from which it fails again.

use std::fs;
use std::path::Path;

use super::program::{folder, passes_with, rumple, text};

use crate::common::path;

/// A small sheet with a law as text, which has no value from t = 0.2 on.
pub const LATE_FAILURE: &str = r#"
[sheet]
shape = "disc"
radius = 5.0
vertices = 100
bump = { amplitude = 0.3, width = 2.0 }

[material]
young = 1e3
poisson = 0.3333333333333333
thickness = 0.5
drag = 10.0

[[effect]]
kind = "stretching"
[[effect]]
kind = "bending"
[[effect]]
kind = "pin"
where = "rim"
axes = "z"
[[effect]]
kind = "diffusion"
species = "c"
coefficient = 0.5

[kinetics]
species.c = { typical = 1.0 }
rates.c = "-c + 1e-9*sqrt(0.2 - t)"
length_factor = "1 + 0.05*c"
initial.c = { gaussian = { width = 2.0, amplitude = 0.8 } }

[time]
until = 1.0
"#;

const FILES: [&str; 2] = ["report.md", "state.vtu"];

/// Runs what fails; the message.
pub fn failing(folder: &Path, args: &[&str]) -> String {
    let done = rumple(folder, &[&["run"][..], args].concat());
    let message = text(&done.stderr);
    assert_eq!(done.status.code(), Some(1), "{args:?}: {}\n{message}", text(&done.stdout));
    message
}

/// The first line of the reason.
fn reason(message: &str) -> &str {
    let line = message.lines().find(|line| line.starts_with("error: "));
    line.unwrap_or_else(|| panic!("no reason in {message}"))
}

/// The same without values, which differ in the last digits where a library restarts.
fn roughly(message: &str) -> &str {
    reason(message).split(" (").next().unwrap_or_default()
}

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap().flatten();
    let mut names: Vec<_> =
        entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_run_that_fails_leaves_a_folder_that_says_why() {
    let folder = folder(LATE_FAILURE);
    let message = failing(folder.path(), &["scene.toml", "--out", "result"]);
    let failure = folder.path().join("result/failure");
    assert!(message.trim_end().ends_with(failure.to_str().unwrap()), "{message}");
    assert_eq!(names(&failure), FILES);

    let report = read(&failure, "report.md");
    let state = failure.join("state.vtu");
    let resolved = folder.path().join("result/resolved.toml");
    let parts = ["rate of species c", "vertex ", "stretching", "bending", "diffusion", "| law |"];
    let paths = [state.to_str().unwrap(), resolved.to_str().unwrap()];
    for part in parts.iter().chain(&paths) {
        assert!(report.contains(part), "no {part} in {report}");
    }

    let look = ["inspect", paths[1], "--state", paths[0], "--json", "-"];
    let out = passes_with(folder.path(), &look);
    let seen: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert!((seen["time"].as_f64().unwrap() - 0.2).abs() < 0.01, "{}", seen["time"]);
    let frame = fs::read_to_string(&state).unwrap();
    for field in ["force of stretching", "force left", "rate of c", "\"c\""] {
        assert!(frame.contains(field), "{field}");
    }
}

/// Under every policy, by every integrator: fixed and controlled steps, own methods and those of a library.
#[test]
fn a_resumed_failure_fails_again_for_the_same_reason() {
    let cases: [&[&str]; 7] = [
        &[],
        &[r#"time.integrator={ kind = "staggered", method = "euler", step = 0.05 }"#],
        &[r#"time.integrator={ kind = "staggered", chemistry = "bdf" }"#],
        &[r#"time.policy="simultaneous""#],
        &[r#"time.policy="simultaneous""#, r#"time.integrator="monolithic""#],
        &[r#"time.policy="simultaneous""#, r#"time.integrator={ kind = "explicit", step = 1e-3 }"#],
        &[r#"time.policy="chemistry-fast""#, r#"time.integrator="staggered""#],
    ];
    let folder = folder(LATE_FAILURE);
    for keys in cases {
        let set: Vec<&str> = keys.iter().flat_map(|key| ["--set", *key]).collect();
        let args = [&["scene.toml", "--out", "a", "--force", "--quiet"], &set[..]].concat();
        let first = failing(folder.path(), &args);
        let ledger = read(&folder.path().join("a"), "ledger.csv");
        let done = rumple(folder.path(), &["resume", "a", "--quiet"]);
        let again = text(&done.stderr);
        assert_eq!(done.status.code(), Some(1), "{keys:?}: {again}");
        assert_eq!(roughly(&first), roughly(&again), "{keys:?}");
        // Nothing is lost, and but for what a library remembers no step is repeated.
        let resumed = read(&folder.path().join("a"), "ledger.csv");
        let steps = |ledger: &str| -> Vec<String> {
            ledger.lines().map(|row| row.split(',').take(2).collect()).collect()
        };
        assert_eq!(steps(&ledger)[..2], steps(&resumed)[..2], "{keys:?}");
        assert!(resumed.lines().count() >= ledger.lines().count() - 1, "{keys:?}: {resumed}");
        // What helps can be tried out from the last good state.
        let state = "a/failure/state.vtu";
        let mended = ["run", "a/resolved.toml", "--from", state, "--out", "b", "--force"];
        let mended = [&mended[..], &["--quiet", "--set", "kinetics.rates.c=-c"]].concat();
        passes_with(folder.path(), &mended);
    }
}

#[test]
fn the_key_of_replays_is_refused_with_what_to_do() {
    let folder = folder(LATE_FAILURE);
    let out = rumple(folder.path(), &["check", "scene.toml", "--set", "time.from=start.bin"]);
    let message = text(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{message}");
    for part in ["time.from", "--from STATE", "rumple resume DIR"] {
        assert!(message.contains(part), "no {part} in {message}");
    }
}

#[test]
fn a_start_that_finds_no_rest_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let scene = &path("models/hard/spot.toml");
    let keys = [
        "--set",
        "kinetics.initial.c.gaussian.amplitude=10",
        "--set",
        "kinetics.parameters.lambda_min=0.3",
    ];
    let args = [&[scene, "--out", "a", "--quiet"], &keys[..]].concat();
    let first = failing(folder.path(), &args);
    assert!(first.contains("collapse"), "{first}");
    let failure = folder.path().join("a/failure");
    assert_eq!(names(&failure), FILES);
    let report = read(&failure, "report.md");
    for part in ["triangle", "vertices", "where the last try stuck"] {
        assert!(report.contains(part), "no {part} in {report}");
    }
}
