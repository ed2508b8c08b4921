//! `models/paper/figures.sh` runs again what has changed, and nothing else.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::process::Command;

use crate::common::root;

/// Stands for the program: notes that it ran, and leaves what a complete run leaves.
const STANDIN: &str = r#"#!/bin/sh
here=$(dirname "$0")
case $1 in
check) cat "$here/resolved" ;;
run)
    echo run >>"$here/runs"
    while [ "$1" != --out ]; do shift; done
    mkdir -p "$2"
    echo '{ "status": "complete" }' >"$2/status.json"
    cp "$here/resolved" "$2/resolved.toml" ;;
esac
"#;

#[test]
fn a_figure_is_made_again_when_its_scene_has_changed() {
    let folder = tempfile::tempdir().unwrap();
    let [program, resolved, runs] = ["program", "resolved", "runs"].map(|n| folder.path().join(n));
    fs::write(&program, STANDIN).unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    let runs_after = |scene: &str| {
        fs::write(&resolved, scene).unwrap();
        // It ends where frames would be measured.
        Command::new(root().join("models/paper/figures.sh"))
            .arg("loosely")
            .env("RUMPLE", &program)
            .env("RUMPLE_PYTHON", "false")
            .env("FIGURES", folder.path().join("figures"))
            .env_remove("CHECK")
            .output()
            .unwrap();
        fs::read_to_string(&runs).unwrap().lines().count()
    };
    assert_eq!(runs_after("h = 1\n"), 1);
    assert_eq!(runs_after("h = 1\n"), 1);
    assert_eq!(runs_after("h = 2\n"), 2);
    assert_eq!(runs_after("h = 2\n"), 2);
}
