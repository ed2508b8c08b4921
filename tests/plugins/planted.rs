//! Planted faults: `plugin validate` finds every one, and a run ends with a message about it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use super::build::{c_library, library, rust_library};
use crate::run::program;

fn rumple(folder: &Path, args: &[&str]) -> Output {
    Command::new(program()).current_dir(folder).args(args).output().unwrap()
}

fn planted(fault: &str) -> PathBuf {
    let definition = format!("FAULT={fault}");
    c_library("tests/faulty/planted.c", &format!("planted_{fault}"), &[&definition])
}

fn table(name: &str, definition: &str) -> PathBuf {
    c_library("tests/faulty/table.c", &format!("planted_table_{name}"), &[definition])
}

/// What `validate` prints, and its exit code.
fn validate(library: &Path, seed: &str) -> (String, i32) {
    let library = library.to_str().unwrap();
    let place = tempfile::tempdir().unwrap();
    let arguments = ["plugin", "validate", library, "--seed", seed];
    let out = rumple(place.path(), &arguments);
    let text =
        format!("{}{}", String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
    assert!(text.contains(&format!("--seed {seed}")), "{text}");
    (text, out.status.code().unwrap_or(-1))
}

#[test]
fn validate_finds_every_planted_fault() {
    let (text, code) = validate(&planted("NONE"), "7");
    assert!(code == 0 && text.contains("no faults found") && !text.contains("FAULT"), "{text}");

    let panics = rust_library("tests/faulty/misbehaving.rs", "panicking", &["panics"]);
    let unsteady = "must not keep internal state";
    let cases: &[(PathBuf, &str, &str)] = &[
        (planted("NOT_FINITE"), "finite rates", "NaN in rates for the rate of species c at vertex"),
        (planted("WRONG_DERIVATIVE"), "derivatives", "gives -2 in rate_partials"),
        (planted("WRONG_FACTOR_DERIVATIVE"), "derivatives", "gives 0.2 in length_factor_partials"),
        (planted("NEGATIVE_FACTOR"), "positive length factor", "returned -1 in length_factor"),
        (planted("HIDDEN_STATE"), "same inputs, same outputs", unsteady),
        (planted("MUTATED_INPUT"), "same inputs, same outputs", unsteady),
        (planted("NOT_THREAD_SAFE"), "", unsteady),
        (planted("BEYOND"), "writes only", "writes beyond the 256 points"),
        (planted("UNWRITTEN"), "writes only", "unwritten"),
        (planted("FACTOR_UNWRITTEN"), "writes only", "output 1 of 1 of length_factor unwritten"),
        (planted("EVERY_NTH"), "", unsteady),
        (planted("MAXIMUM_KEPT"), "same inputs, same outputs", unsteady),
        (panics, "finite rates", "failed in rates at vertex"),
    ];
    for (library, check, message) in cases {
        for seed in ["7", "1", "2", "3"] {
            let (text, code) = validate(library, seed);
            assert_eq!(code, 2, "{text}");
            let found = |l: &str| l.contains("FAULT") && l.contains(check) && l.contains(message);
            assert!(text.lines().any(found), "{}, seed {seed}: {text}", library.display());
        }
    }
}

#[test]
fn validate_says_why_a_library_is_refused_and_in_which_check_a_law_ends_the_process() {
    for (library, message) in [
        (table("version", "MAJOR=2"), "built for version 2.1"),
        (table("truncated", "TABLE_SIZE=40"), "truncated table: 40 bytes"),
        (table("metadata", "TYPICAL=-1.0"), "typical magnitude is -1"),
    ] {
        let (text, code) = validate(&library, "7");
        assert!(code == 2 && text.contains(message), "{text}");
    }
    let (text, code) = validate(&planted("ABORTS"), "7");
    assert_eq!(code, -1, "{text}");
    assert!(text.trim_end().ends_with("same inputs, same outputs"), "{text}");
}

#[test]
fn validate_finds_nothing_in_what_is_shipped() {
    for name in super::build::SHIPPED {
        let (text, code) = validate(library(name).path(), "7");
        assert_eq!(code, 0, "{text}");
    }
}

const SCENE: &str = r#"
[sheet]
shape = "disc"
radius = 40.0
vertices = 3000

[kinetics]
plugin = "PLUGIN"
initial.c = { gaussian = { width = 8.0, amplitude = 0.8 } }

[time]
policy = "quasi-static"
integrator = { kind = "staggered", method = "euler", step = 0.1 }
until = 0.3

[output]
every = 0.1
"#;

fn scene_of(library: &Path) -> String {
    SCENE.replace("PLUGIN", library.to_str().unwrap())
}

/// With an effect that needs the length factor.
fn scene_that_pulls(library: &Path) -> String {
    let elastic = "[material]\nyoung = 1e6\npoisson = 0.3333333333333333\nthickness = 0.5\n\n\
                   [[effect]]\nkind = \"stretching\"\n\n[kinetics]";
    scene_of(library).replace("[kinetics]", elastic)
}

#[test]
fn a_run_survives_every_planted_fault() {
    let panics = rust_library("tests/faulty/misbehaving.rs", "panicking", &["panics"]);
    let named = "plugin `planted`";
    let cases: &[(PathBuf, i32, &[&str])] = &[
        (table("version", "MAJOR=2"), 2, &["built for version 2.1", "kinetics.plugin"]),
        (table("truncated", "TABLE_SIZE=40"), 2, &["truncated table"]),
        (table("metadata", "TYPICAL=-1.0"), 2, &["typical magnitude is -1"]),
        (
            planted("NOT_FINITE"),
            2,
            &[named, "NaN in rates for the rate of species c at vertex", "(c = 0.", "position ("],
        ),
        (planted("HIDDEN_STATE"), 2, &[named, "for the rate of species c at vertex", "gave"]),
        (planted("MUTATED_INPUT"), 2, &[named, "for the rate of species c at vertex", "gave"]),
        (planted("NOT_THREAD_SAFE"), 2, &[named, "for the rate of species c at vertex"]),
        (
            planted("NEGATIVE_FACTOR"),
            2,
            &[named, "returned -1 in length_factor for the length factor at edge", "(c = 0."],
        ),
        (
            planted("UNWRITTEN"),
            2,
            &[named, "leaves the rate of species c unwritten in rates at vertex"],
        ),
        (planted("FACTOR_UNWRITTEN"), 2, &[named, "leaves the length factor unwritten"]),
        (panics, 2, &["plugin `misbehaving` failed in rates at vertex", "no luck with c = 0."]),
    ];
    for (library, code, messages) in cases {
        let folder = tempfile::tempdir().unwrap();
        let pulls = library.to_str().unwrap().contains("FACTOR");
        let scene = if pulls { scene_that_pulls(library) } else { scene_of(library) };
        fs::write(folder.path().join("scene.toml"), scene).unwrap();
        let arguments = ["run", "scene.toml", "--out", "result", "--threads", "2"];
        let out = rumple(folder.path(), &arguments);
        let text = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(*code), "{}: {text}", library.display());
        for message in *messages {
            // Messages in scenes are wrapped and framed.
            let plain: String = text.replace(['│', '\n'], " ");
            let plain = plain.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(plain.contains(message), "{}: no {message:?} in {text}", library.display());
        }
    }
}

/// What a run says of faults in the results of a law.
const BAD_RESULTS: [(&str, &str); 3] = [
    ("BEYOND", "writes beyond the"),
    ("NARROW_NAN", "returned NaN in rates for the rate of species c at vertex"),
    ("UNWRITTEN", "unwritten"),
];

#[test]
fn a_run_names_bad_results_of_a_plugin() {
    for (fault, message) in BAD_RESULTS {
        run_says(fault, message);
    }
}

fn run_says(fault: &str, message: &str) {
    let library = planted(fault);
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), scene_of(&library)).unwrap();
    let out = rumple(folder.path(), &["run", "scene.toml", "--out", "out", "--threads", "2"]);
    let text = String::from_utf8_lossy(&out.stderr).replace(['│', '\n'], " ");
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(out.status.code(), Some(2), "{fault}: {text}");
    for part in ["plugin `planted`", message] {
        assert!(text.contains(part), "{fault}: no {part:?} in {text}");
    }
    whole(&folder.path().join("out"));
}

/// Every frame in the folder is listed, and ends as it should.
fn whole(results: &Path) {
    let Ok(frames) = fs::read_dir(results.join("frames")) else { return };
    let list = fs::read_to_string(results.join("sheet.pvd")).unwrap_or_default();
    for frame in frames {
        let path = frame.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        assert!(list.contains(name), "{name} is not in {list}");
        assert!(fs::read(&path).unwrap().trim_ascii_end().ends_with(b"</VTKFile>"), "{name}");
    }
}

#[test]
fn a_run_tells_of_results_that_the_law_itself_flags_as_unreliable() {
    let folder = tempfile::tempdir().unwrap();
    let library = rust_library("tests/faulty/misbehaving.rs", "misbehaving", &[]);
    let scene = scene_of(&library).replace("initial.c", "parameters.fault = 17\ninitial.c");
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let out = rumple(folder.path(), &["run", "scene.toml"]);
    let text = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{text}");
    let reported =
        text.lines().filter(|line| line.contains("flags its result as unreliable at vertex"));
    assert_eq!(reported.filter(|line| line.contains("extrapolated")).count(), 1, "{text}");
}

#[test]
fn a_run_says_which_derivative_is_wrong_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene_of(&planted("WRONG_DERIVATIVE"));
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let out = rumple(folder.path(), &["run", "scene.toml", "--out", "result"]);
    let text = String::from_utf8_lossy(&out.stderr) + String::from_utf8_lossy(&out.stdout);
    assert!(out.status.success(), "{text}");
    assert!(
        text.contains("plugin `planted` gives -2 in rate_partials for the derivative"),
        "{text}"
    );
    assert!(text.contains("where differences give -1.0000000"), "{text}");

    let scene = scene_that_pulls(&planted("WRONG_FACTOR_DERIVATIVE"));
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let out = rumple(folder.path(), &["run", "scene.toml", "--out", "other"]);
    let text = String::from_utf8_lossy(&out.stderr) + String::from_utf8_lossy(&out.stdout);
    assert!(out.status.success(), "{text}");
    let wrong = "plugin `planted` gives 0.2 in length_factor_partials for the derivative";
    assert!(text.contains(wrong), "{text}");
    let out = rumple(folder.path(), &["run", "scene.toml", "--out", "third", "--quiet"]);
    assert!(String::from_utf8_lossy(&out.stderr).contains(wrong));
}
