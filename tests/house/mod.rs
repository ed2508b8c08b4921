//! The house rules that can be read off the `use` lines.

use std::fs;
use std::path::{Path, PathBuf};

fn sources(directory: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// Files below `src/<room>` that contain one of `words` outside comments.
fn offenders(room: &str, words: &[&str], except: &[&str]) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root.join(room), &mut files);
    assert!(!files.is_empty(), "{room}");
    let mut found = Vec::new();
    for file in files {
        let name = file.strip_prefix(&root).unwrap().display().to_string();
        if except.iter().any(|e| name.starts_with(e)) {
            continue;
        }
        for line in fs::read_to_string(&file).unwrap().lines() {
            let code = line.trim_start();
            if !code.starts_with("//") && words.iter().any(|w| code.contains(w)) {
                found.push(format!("{name}: {code}"));
            }
        }
    }
    found
}

#[test]
fn effects_know_no_policy_no_system_no_output_and_no_scene() {
    let words =
        ["crate::scene::S", "crate::system", "crate::output", "crate::timescale", "crate::cli"];
    assert_eq!(offenders("effects", &words, &[]), Vec::<String>::new());
}

#[test]
fn the_sheet_knows_no_field_and_no_physics() {
    let words =
        ["crate::effects", "crate::kinetics", "crate::state", "crate::system", "crate::solve"];
    assert_eq!(offenders("sheet", &words, &[]), Vec::<String>::new());
}

#[test]
fn geometry_knows_no_energy() {
    let words = ["crate::effects", "crate::kinetics", "crate::solve", "crate::system"];
    assert_eq!(offenders("geometry", &words, &[]), Vec::<String>::new());
}

#[test]
fn one_place_loads_libraries_and_holds_what_is_unsafe() {
    let loader = ["kinetics/library"];
    assert_eq!(offenders(".", &["libloading", "unsafe "], &loader), Vec::<String>::new());
}

#[test]
fn observers_change_nothing() {
    let words = ["crate::system", "crate::solve", "crate::effects", "&mut State"];
    assert_eq!(offenders("output", &words, &[]), Vec::<String>::new());
}
