//! Hard cases of `models/hard/cases.toml` that take seconds; `04_hard_cases` runs all.

#[path = "../../examples/hard_cases/mod.rs"]
mod hard_cases;

use hard_cases::{Options, run};

use crate::common::{root, shipped};
use crate::run::program;

fn all_as_expected(names: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let options = Options {
        slow: false,
        beside: false,
        patience: 10.0,
        only: names.iter().map(|&name| name.to_owned()).collect(),
        root: root(),
        program: program(),
        results: folder.path().to_owned(),
    };
    assert_eq!(run(&options).unwrap(), 0);
}

#[test]
fn hard_chemistry_is_as_expected() {
    all_as_expected(&["diffusion", "catch-bond"]);
}

#[test]
fn steep_switches_are_as_expected() {
    all_as_expected(&["steep"]);
}

/// The first of its starts is the run of `at-once`.
#[test]
fn far_starts_are_as_expected() {
    all_as_expected(&["far"]);
}

#[test]
fn hard_mechanics_is_as_expected() {
    all_as_expected(&["flat", "flat-left", "snap-pressure", "no-equilibrium"]);
}

#[test]
fn hard_meshes_and_contacts_are_as_expected() {
    all_as_expected(&["needles-long", "obtuse-more", "crossing", "snap-lost"]);
}

#[test]
fn laws_that_are_not_finite_are_as_expected() {
    all_as_expected(&["law-nan", "law-infinite", "law-blows-up", "law-jumps", "factor-negative"]);
}

#[test]
fn hostile_files_are_as_expected() {
    all_as_expected(&["mesh-cut", "mesh-empty", "scene-hostile", "checkpoint-damaged"]);
}

#[test]
fn units_do_not_matter() {
    all_as_expected(&["scales-drag", "scales-spot"]);
}

#[test]
fn the_table_of_the_documentation_leaves_no_case_out() {
    let cases = shipped("models/hard/cases.toml");
    let page = shipped("docs/notebook/hard-cases.md");
    let names = cases.lines().filter_map(|line| line.strip_prefix("name = \""));
    let names: Vec<&str> = names.map(|name| name.trim_end_matches('"')).collect();
    assert!(names.len() > 40, "{names:?}");
    for name in names {
        assert!(
            page.contains(&format!("`{name}`")),
            "{name} is not in docs/notebook/hard-cases.md"
        );
    }
}
