//! `plugin new`: what it writes builds unchanged, passes `validate`, and runs.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use super::build;
use crate::common::root;
use crate::run::program;

fn rumple(folder: &Path, args: &[&str]) -> String {
    said(Command::new(program()).current_dir(folder).args(args))
}

fn said(command: &mut Command) -> String {
    let out: Output = command.output().unwrap();
    let text = String::from_utf8_lossy(&out.stdout) + String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{command:?}: {text}");
    text.into_owned()
}

/// The last line of the ledger of a short run.
fn run(folder: &Path, settings: &[&str]) -> String {
    let mut args = vec!["run", "scene.toml", "--out", "result", "--force", "--quiet"];
    for setting in ["sheet.vertices=300", "time.until=0.5"].iter().chain(settings) {
        args.extend(["--set", setting]);
    }
    rumple(folder, &args);
    assert!(folder.join("result/sheet.pvd").is_file());
    let ledger = fs::read_to_string(folder.join("result/ledger.csv")).unwrap();
    let (head, last) = (ledger.lines().next().unwrap(), ledger.lines().last().unwrap());
    let total = head.split(',').position(|column| column == "total g").unwrap();
    last.split(',').nth(total).unwrap().to_owned()
}

#[test]
fn the_c_and_the_rust_template_build_validate_and_agree() {
    let place = tempfile::tempdir().unwrap();
    let c = place.path().join("c-growth");
    let text = rumple(place.path(), &["plugin", "new", "c-growth", "--lang", "c"]);
    assert!(text.contains("make") && text.contains("plugin validate"), "{text}");
    said(Command::new("make").current_dir(&c).arg("EXTRA=-Werror"));
    let library = rumple::kinetics::search::file_name("c-growth");
    assert!(rumple(&c, &["plugin", "validate", &format!("./{library}")]).contains("no faults"));
    let with_partials: f64 = run(&c, &[]).parse().unwrap();

    // Differences in place of its own derivatives, also where they are used.
    let bdf = "time.integrator={ kind = \"monolithic\", method = \"bdf\", rtol = 1e-6 }";
    let exact: f64 = run(&c, &[bdf]).parse().unwrap();
    fs::remove_file(c.join(&library)).unwrap();
    said(Command::new("make").current_dir(&c).arg("EXTRA=-DWITHOUT_PARTIALS"));
    let text = rumple(&c, &["plugin", "describe", &format!("./{library}")]);
    assert!(text.contains("rates, derivatives by differences"), "{text}");
    let by_differences: f64 = run(&c, &[bdf]).parse().unwrap();
    assert!((exact / by_differences - 1.0).abs() < 1e-6, "{exact} {by_differences}");

    let rust = place.path().join("rust-growth");
    rumple(place.path(), &["plugin", "new", "rust-growth"]);
    let target = build::directory().parent().unwrap().join("made");
    let mut cargo = Command::new(env!("CARGO"));
    cargo.current_dir(&rust).args(["build", "--release", "--quiet"]);
    said(cargo.arg("--target-dir").arg(&target));
    let library = target.join("release").join(rumple::kinetics::search::file_name("rust-growth"));
    let library = library.to_str().unwrap();
    assert!(rumple(&rust, &["plugin", "validate", library]).contains("no faults"));
    let rust: f64 = run(&rust, &[&format!("kinetics.plugin=\"{library}\"")]).parse().unwrap();
    assert!((rust / with_partials - 1.0).abs() < 1e-9, "{rust} {with_partials}");
}

#[test]
fn bad_names_and_taken_folders_are_refused_and_nothing_is_written() {
    let place = tempfile::tempdir().unwrap();
    let refusal = |args: &[&str]| {
        let out = Command::new(program()).current_dir(place.path()).args(args).output().unwrap();
        assert_eq!(out.status.code(), Some(2));
        String::from_utf8_lossy(&out.stderr).into_owned()
    };
    let text = refusal(&["plugin", "new", "My Law"]);
    assert!(text.contains("for example `my-law`"), "{text}");
    fs::create_dir(place.path().join("taken")).unwrap();
    let text = refusal(&["plugin", "new", "taken"]);
    assert!(text.contains("exists already"), "{text}");
    let text = refusal(&["plugin", "new", "law", "--sdk", "nowhere"]);
    assert!(text.contains("no SDK at nowhere") && text.contains("--sdk"), "{text}");
    let left: Vec<_> = fs::read_dir(place.path()).unwrap().collect();
    assert_eq!(left.len(), 1, "{left:?}");
}

#[test]
fn list_and_describe_say_what_there_is() {
    let place = tempfile::tempdir().unwrap();
    let plugins = build::directory().to_str().unwrap();
    let text = rumple(place.path(), &["plugin", "list", "--plugin-path", plugins]);
    assert!(text.contains("curvature-feedback") && text.contains("oregonator"), "{text}");
    let of =
        |law: &str| rumple(place.path(), &["plugin", "describe", law, "--plugin-path", plugins]);
    let text = of("curvature-feedback");
    for part in ["c [1] morphogen", "w = 15 [length/time]", "reads       mean_curvature [1/length]"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(text.contains("lambda_0 = lambda_max") && text.contains("observable production"));
    let scene = root().join("models/model-ii/formula.toml");
    let text = of(scene.to_str().unwrap());
    assert!(text.contains("reads       tension"), "{text}");
}
