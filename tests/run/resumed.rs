//! Runs that go on from a checkpoint are those that were never stopped, bit by bit.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::program::{folder, passes, passes_with, rumple, text};
use super::{SMALL, program};
use crate::common::Noise;
use crate::plugins::build;

/// One of every kind of thing that is remembered: a factor, velocities, a library's, nothing.
const CASES: [(&str, &[&str]); 6] = [
    ("quasi-static", &["time.until=0.3"]),
    ("simultaneous", &["time.policy=\"simultaneous\"", "material.drag=10", "time.until=0.3"]),
    (
        "internal variables",
        &[
            "effect=[{ kind = \"stretching\" }, { kind = \"bending\", model = \"hinge\", remodelling = { time = 0.1 } }, \
             { kind = \"pin\", where = \"rim\", axes = \"z\" }, { kind = \"remodelling\", time = 0.2 }]",
            "output.fields=[\"length_remodelling\", \"angle_remodelling\"]",
            "time.until=0.3",
        ],
    ),
    (
        "tension by a species",
        &[
            "effect=[{ kind = \"stretching\" }, { kind = \"bending\" }, { kind = \"pin\", where = \"rim\", axes = \"z\" }, \
             { kind = \"active-tension\", value = \"2e4*c\" }]",
            "invariants.energy=1.0",
            "time.until=0.3",
        ],
    ),
    ("library within a step", &["time.integrator.chemistry=\"bdf\"", "time.until=0.2"]),
    (
        "library",
        &[
            "time.policy=\"simultaneous\"",
            "material={ young = 1e3, poisson = 0.3, thickness = 2.0, drag = 10.0 }",
            "time.integrator={ kind = \"monolithic\", rtol = 1e-3 }",
            "time.until=0.2",
        ],
    ),
];

fn args<'a>(command: &[&'a str], keys: &[&'a str]) -> Vec<&'a str> {
    let mut all = command.to_vec();
    all.extend(keys.iter().flat_map(|key| ["--set", *key]));
    all
}

/// Every file that a run without a clock would write again, and the ledger without its wall time.
fn results(directory: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut all = Vec::new();
    for folder in ["", "frames", "modes"] {
        for entry in fs::read_dir(directory.join(folder)).into_iter().flatten().flatten() {
            let path = entry.path();
            let name = path.strip_prefix(directory).unwrap().to_owned();
            if path.extension().is_some_and(|e| ["vtu", "pvd"].contains(&e.to_str().unwrap())) {
                all.push((name, fs::read(path).unwrap()));
            }
        }
    }
    all.sort();
    let ledger = fs::read_to_string(directory.join("ledger.csv")).unwrap();
    let rows = ledger.lines().map(|row| row.rsplit_once(',').unwrap().0);
    all.push(("ledger.csv".into(), rows.collect::<Vec<_>>().join("\n").into_bytes()));
    all
}

pub fn assert_same(a: &Path, b: &Path, what: &str) {
    let (a, b) = (results(a), results(b));
    let names = |all: &[(PathBuf, Vec<u8>)]| all.iter().map(|f| f.0.clone()).collect::<Vec<_>>();
    assert_eq!(names(&a), names(&b), "{what}");
    for ((name, a), (_, b)) in a.iter().zip(&b) {
        assert!(a == b, "{what}: {} differs", name.display());
    }
}

pub fn checkpoints(directory: &Path) -> Vec<PathBuf> {
    let all = fs::read_dir(directory.join("checkpoints")).into_iter().flatten();
    let mut all: Vec<PathBuf> = all.map(|entry| entry.unwrap().path()).collect();
    all.retain(|path| path.extension().is_some_and(|e| e == "bin"));
    all.sort();
    all
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let to = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &to);
        } else {
            fs::copy(entry.path(), to).unwrap();
        }
    }
}

/// A copy of a whole run as it was when its checkpoint number `kept` was the last.
pub fn stopped(whole: &Path, to: &Path, kept: usize) {
    copy(whole, to);
    checkpoints(to)[kept + 1..].iter().for_each(|later| fs::remove_file(later).unwrap());
    let status = fs::read_to_string(to.join("status.json")).unwrap();
    fs::write(to.join("status.json"), status.replace("\"complete\"", "\"running\"")).unwrap();
}

const FREQUENT_CHECKPOINTS: [&str; 2] = ["checkpoint.every=1e-9", "checkpoint.keep=1000000"];

#[test]
fn every_kind_of_solver_goes_on_with_the_same_bits() {
    for (name, keys) in CASES {
        let folder = folder(SMALL);
        let whole = folder.path().join("whole");
        let mut keys = [keys, &FREQUENT_CHECKPOINTS].concat();
        if name == "library" {
            // Where a new start is a part of what is computed, some steps lie between two of them.
            let every = keys.len() - 2;
            keys[every] = "checkpoint.every=0.03";
        }
        let out = rumple(folder.path(), &args(&["run", "scene.toml", "--out", "whole"], &keys));
        assert!(out.status.success(), "{name}: {}", text(&out.stderr));
        let count = checkpoints(&whole).len();
        assert!(count > 4, "{name}: {count} checkpoints");
        for (number, kept) in [1, count / 2, count - 2].into_iter().enumerate() {
            let other = folder.path().join(format!("other{number}"));
            stopped(&whole, &other, kept);
            let out = rumple(folder.path(), &["resume", other.to_str().unwrap(), "--quiet"]);
            assert!(out.status.success(), "{name}, {kept}: {}", text(&out.stderr));
            assert_same(&whole, &other, &format!("{name}, from checkpoint {kept} of {count}"));
        }
        // Nor does it matter for the results that checkpoints were written, but to a library.
        if !name.starts_with("library") {
            let plain = args(&["run", "scene.toml", "--out", "plain"], &keys[..keys.len() - 2]);
            assert!(rumple(folder.path(), &plain).status.success());
            assert_same(&whole, &folder.path().join("plain"), name);
            assert_eq!(checkpoints(&folder.path().join("plain")).len(), 0);
        }
    }
}

fn start(folder: &Path, args: &[&str]) -> Child {
    let mut command = Command::new(program());
    command.current_dir(folder).env("RUMPLE_PLUGIN_PATH", build::directory()).args(args);
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

#[test]
fn a_run_survives_kills_at_any_instant() {
    let mut noise = Noise::new(11);
    for (name, keys) in &CASES[..3] {
        let folder = folder(SMALL);
        let keys = [*keys, &["checkpoint.wall=0.01"]].concat();
        let began = Instant::now();
        let out = rumple(folder.path(), &args(&["run", "scene.toml", "--out", "whole"], &keys));
        assert!(out.status.success(), "{name}: {}", text(&out.stderr));
        let took = began.elapsed();
        let killed = folder.path().join("killed");
        for _ in 0..4 {
            let command: Vec<&str> = match checkpoints(&killed).is_empty() {
                true => args(&["run", "scene.toml", "--out", "killed", "--force"], &keys),
                false => vec!["resume", "killed"],
            };
            let mut child = start(folder.path(), &command);
            std::thread::sleep(took.mul_f64(0.5 * (noise.number() + 1.0)));
            let _ = child.kill();
            child.wait().unwrap();
        }
        let command: Vec<&str> = match checkpoints(&killed).is_empty() {
            true => args(&["run", "scene.toml", "--out", "killed", "--force"], &keys),
            false => vec!["resume", "killed"],
        };
        let out = rumple(folder.path(), &command);
        let complete = text(&out.stderr).contains("the run is complete");
        assert!(out.status.success() || complete, "{name}: {}", text(&out.stderr));
        assert_same(&folder.path().join("whole"), &killed, name);
    }
}

#[cfg(unix)]
#[test]
fn an_interruption_writes_a_checkpoint() {
    let folder = folder(SMALL);
    let keys = ["time.until=0.6"];
    let out = rumple(folder.path(), &args(&["run", "scene.toml", "--out", "whole"], &keys));
    assert!(out.status.success(), "{}", text(&out.stderr));
    for signal in ["-INT", "-TERM"] {
        let other = folder.path().join(signal.trim_start_matches('-'));
        let out = other.to_str().unwrap();
        let mut child = start(folder.path(), &args(&["run", "scene.toml", "--out", out], &keys));
        let until = Instant::now() + Duration::from_secs(60);
        let rows = || fs::read_to_string(other.join("ledger.csv")).map_or(0, |t| t.lines().count());
        while rows() < 4 {
            assert!(Instant::now() < until);
            std::thread::sleep(Duration::from_millis(2));
        }
        Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        child.wait().unwrap();
        let status = fs::read_to_string(other.join("status.json")).unwrap();
        assert!(status.contains("\"interrupted\""), "{status}");
        assert!(!checkpoints(&other).is_empty());
        let done = passes_with(folder.path(), &["resume", out]);
        assert!(text(&done.stderr).contains("going on from"), "{}", text(&done.stderr));
        let provenance = fs::read_to_string(other.join("provenance.json")).unwrap();
        assert!(provenance.contains("\"resumed\""), "{status}");
        assert_same(&folder.path().join("whole"), &other, signal);
    }
}

#[test]
fn what_cannot_go_on_says_why_and_what_can() {
    let folder = folder(SMALL);
    let keys = [&["time.until=0.2"][..], &FREQUENT_CHECKPOINTS].concat();
    let run = |out: &str| rumple(folder.path(), &args(&["run", "scene.toml", "--out", out], &keys));
    assert!(run("whole").status.success());
    let whole = folder.path().join("whole");
    let count = checkpoints(&whole).len();
    let refused = |directory: &str, expected: &str| {
        let out = rumple(folder.path(), &["resume", directory]);
        assert_eq!(out.status.code(), Some(2), "{directory}");
        let said = text(&out.stderr);
        assert!(said.contains(expected), "expected `{expected}` in: {said}");
    };
    let other = |name: &str| {
        let other = folder.path().join(name);
        stopped(&whole, &other, count / 2);
        other
    };
    let change = |path: &Path, from: &str, to: &str| {
        let text = fs::read_to_string(path).unwrap();
        assert!(text.contains(from), "{from} in {text}");
        fs::write(path, text.replace(from, to)).unwrap();
    };
    refused("nowhere", "no such directory");
    refused(".", "it holds no run");
    refused("whole", "`--until T` lets it go further");

    let scene = other("scene");
    change(&scene.join("resolved.toml"), "poisson = 0.3333333333333333", "poisson = 0.3");
    refused("scene", "material.poisson was 0.3333333333333333 and is 0.3");
    let mesh = other("mesh");
    change(&mesh.join("resolved.toml"), "seed = 7", "seed = 8");
    refused("mesh", "seed was 7 and is 8");

    let empty = other("empty");
    fs::remove_dir_all(empty.join("checkpoints")).unwrap();
    refused("empty", "it has no checkpoint");
    let cut = other("cut");
    fs::write(cut.join("ledger.csv"), "step\n").unwrap();
    refused("cut", "ledger.csv ends before");

    let frame = other("frame");
    let first = frame.join("frames/frame_000000.vtu");
    let bytes = fs::read(&first).unwrap();
    fs::write(&first, &bytes[..bytes.len() - 20]).unwrap();
    refused("frame", "frame_000000.vtu is not as the run wrote it");
    // As long as before, and another one.
    let retouched = other("retouched");
    let first = retouched.join("frames/frame_000000.vtu");
    let mut bytes = fs::read(&first).unwrap();
    let place = bytes.windows(9).position(|w| w == b"TimeValue").unwrap();
    bytes[place] = b't';
    fs::write(&first, bytes).unwrap();
    refused("retouched", "frame_000000.vtu is not as the run wrote it: its bytes have changed");

    // Of another version, cut short, changed: none is misread.
    let last = |directory: &Path| checkpoints(directory).pop().unwrap();
    let version = other("version");
    for path in checkpoints(&version) {
        let mut bytes = fs::read(&path).unwrap();
        let place = bytes.windows(12).position(|w| w == b"checkpoint 8").unwrap();
        bytes[place + 11] = b'0';
        fs::write(&path, bytes).unwrap();
    }
    refused("version", "is of another version");
    let damaged = other("damaged");
    let path = last(&damaged);
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&path, &bytes).unwrap();
    let out = passes(folder.path(), "resume damaged");
    assert!(
        text(&out.stderr).contains("is damaged: its checksum is wrong"),
        "{}",
        text(&out.stderr)
    );
    assert_same(&whole, &damaged, "from the checkpoint before the damaged one");
    let short = other("short");
    for path in checkpoints(&short) {
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, &bytes[..bytes.len() / 3]).unwrap();
    }
    refused("short", "is damaged");

    // Further than it was to go.
    passes(folder.path(), "resume whole --until 0.25");
    let ledger = fs::read_to_string(whole.join("ledger.csv")).unwrap();
    assert!(ledger.lines().last().unwrap().split(',').nth(1) == Some("0.25"), "{ledger}");
    refused("whole", "the run is complete, at time 0.25");
    // Nor back to where its results would be cut off.
    let all = checkpoints(&whole);
    all[1..].iter().for_each(|path| fs::remove_file(path).unwrap());
    let out = rumple(folder.path(), &["resume", "whole", "--until", "0.24"]);
    let said = text(&out.stderr);
    assert!(out.status.code() == Some(2) && said.contains("would be lost"), "{said}");
    assert_eq!(fs::read_to_string(whole.join("ledger.csv")).unwrap(), ledger);
}

/// A complete run names the options without which it would end again at once, and runs on with them.
#[test]
fn a_complete_run_names_what_extends_it() {
    const POINT: &str = "sheet = { shape = 'point' }
        time = { until = 1.0, integrator = { kind = 'staggered', method = 'euler', step = 0.125 } }
        kinetics = { rates.c = '-c', initial.c = 1.0 }";
    let (until, rate) = ("`--until T` lets", "`--set time.stop_when_steady=RATE`");
    let (steps, both) = ("`--set time.max_steps=N`", "`--until T` together with `--set time.max");
    let longer = "time.until=2";
    let cases = [
        ("time.until=0.5", [("", until), ("time.max_steps=9", until)], "time.until=1"),
        ("time.max_steps=2", [("", steps), (longer, steps)], "time.max_steps=8"),
        ("time.max_steps=8", [("", both), (longer, steps)], ""),
        ("time.stop_when_steady=0.8", [("", rate), (longer, rate)], "time.stop_when_steady=0.1"),
    ];
    for (end, refused, further) in cases {
        let folder = folder(POINT);
        let keys = [&[end][..], &FREQUENT_CHECKPOINTS].concat();
        let run = args(&["run", "scene.toml", "--out", "out", "--quiet"], &keys);
        assert!(rumple(folder.path(), &run).status.success());
        let resume =
            |set: &[&str]| rumple(folder.path(), &args(&["resume", "out", "--quiet"], set));
        for (set, named) in refused {
            let out = if set.is_empty() { resume(&[]) } else { resume(&[set]) };
            let said = text(&out.stderr);
            assert!(out.status.code() == Some(2) && said.contains(named), "{end}, {set}: {said}");
        }
        if further.is_empty() {
            continue;
        }
        let said = text(&resume(&[further, "kinetics.rates.c=\"-2*c\""]).stderr);
        assert!(said.contains("kinetics.rates.c was \"-c\" and is \"-2*c\""), "{said}");
        let out = resume(&[further]);
        assert!(out.status.success(), "{end}, {further}: {}", text(&out.stderr));
        let ledger = fs::read_to_string(folder.path().join("out/ledger.csv")).unwrap();
        assert!(ledger.lines().last().unwrap().starts_with("8,1,"), "{end}, {further}: {ledger}");
    }
}

/// An end before the results that there are would cut them off.
#[test]
fn an_end_before_the_last_result_is_refused() {
    const POINT: &str = "sheet = { shape = 'point' }
        time = { until = 2.0, integrator = { kind = 'staggered', method = 'euler', step = 0.125 } }
        kinetics = { rates.c = '-c', initial.c = 1.0 }";
    let folder = folder(POINT);
    let run = args(&["run", "scene.toml", "--out", "whole", "--quiet"], &FREQUENT_CHECKPOINTS);
    assert!(rumple(folder.path(), &run).status.success());
    let whole = folder.path().join("whole");
    let all = checkpoints(&whole);
    // As if killed at its end, with the first checkpoint alone.
    all[1..].iter().for_each(|path| fs::remove_file(path).unwrap());
    let status = whole.join("status.json");
    let killed = fs::read_to_string(&status).unwrap().replace("complete", "running");
    fs::write(&status, killed).unwrap();
    let ledger = fs::read(whole.join("ledger.csv")).unwrap();
    let cuts = ["time.max_steps=15", "time.until=1.5", "time.stop_when_steady=0.5"];
    for set in cuts {
        let out = rumple(folder.path(), &args(&["resume", "whole", "--quiet"], &[set]));
        let said = text(&out.stderr);
        assert!(out.status.code() == Some(2) && said.contains("would be lost"), "{set}: {said}");
        assert_eq!(fs::read(whole.join("ledger.csv")).unwrap(), ledger, "{set}");
    }
    // The same in its scene.
    let path = whole.join("resolved.toml");
    let scene = fs::read_to_string(&path).unwrap();
    fs::write(&path, scene.replace("until = 2.0", "until = 2.0\nmax_steps = 15")).unwrap();
    let out = rumple(folder.path(), &["resume", "whole", "--quiet"]);
    assert!(text(&out.stderr).contains("step 15 would be lost"), "{}", text(&out.stderr));
    let out = rumple(folder.path(), &args(&["resume", "whole", "--quiet"], &["time.max_steps=17"]));
    assert!(out.status.success(), "{}", text(&out.stderr));
    let last = fs::read_to_string(whole.join("ledger.csv")).unwrap();
    assert!(last.lines().last().unwrap().starts_with("16,2,"), "{last}");
}

#[test]
fn nobody_goes_on_with_a_run_at_work() {
    let folder = folder(SMALL);
    let keys = ["time.until=1000", "checkpoint.wall=0.01"];
    let mut child = start(folder.path(), &args(&["run", "scene.toml", "--out", "busy"], &keys));
    let until = Instant::now() + Duration::from_secs(60);
    while checkpoints(&folder.path().join("busy")).is_empty() {
        assert!(Instant::now() < until);
        std::thread::sleep(Duration::from_millis(5));
    }
    let out = rumple(folder.path(), &["resume", "busy"]);
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(out.status.code(), Some(2));
    assert!(text(&out.stderr).contains("a run is still writing to it"), "{}", text(&out.stderr));
}
