//! Quasi-static shapes: the stabilisation is a setting of accuracy beside the tolerance.

use std::fs;

use super::{GROWING, number, study, table, text};
use crate::common::plots;

/// Options of a study of one integrator.
const FEW: [&str; 6] =
    ["--integrator", "staggered", "--tolerances", "1e-1,1e-2,1e-3", "--seeds", "0"];

#[test]
fn stabilisations_are_varied_against_references_ten_times_apart_in_them() {
    let (folder, out) = study(GROWING, &FEW);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let rows = table(folder.path());
    let varied = |row: &&std::collections::BTreeMap<String, String>| {
        row["integrator"].ends_with("stabilisation varied")
    };
    for (tolerance, expected) in [(1e-2, [1e-3, 1e-4, 1e-5]), (1e-3, [1e-2, 1e-4, 1e-5])] {
        let rows = rows.iter().filter(varied).filter(|r| number(r, "tolerance") == tolerance);
        let found: Vec<f64> = rows.map(|row| number(row, "stabilisation")).collect();
        assert_eq!(found, expected);
    }
    // By default it is the tolerance.
    for row in rows.iter().filter(|row| !varied(row)) {
        assert_eq!(row["stabilisation"], row["tolerance"]);
    }
    let said = text(&out.stdout);
    for expected in [
        "1e-4, stabilisation 1e-7",
        "2e-4, stabilisation 1e-6",
        "of one method at two stabilisations",
    ] {
        assert!(said.contains(expected), "{expected}: {said}");
    }
    // The recommendation names that of its run.
    let advice = said.split_once(": ").unwrap().1;
    assert!(advice.split_once(" (").unwrap().0.contains(", stabilisation 1e-"), "{said}");
    let root = folder.path().join("out");
    let page = fs::read_to_string(root.join("accuracy.md")).unwrap();
    assert!(page.contains("reference uncertainty: species"), "{page}");
    for plot in ["work-precision", "stabilisation"] {
        let names = plots(&root)[plot]["names"].to_string();
        assert!(names.contains("rtol 1e-3, stabilisation varied"), "{plot}: {names}");
    }
}

#[test]
fn stabilisations_that_are_asked_for_replace_the_default_ones() {
    let over = ["--over", "time.stabilisation=1e-1,1e-3,0"];
    let (folder, out) = study(GROWING, &[&FEW[..], &over].concat());
    assert!(out.status.success(), "{}", text(&out.stderr));
    let rows = table(folder.path());
    let tight = rows.iter().skip(3).filter(|row| number(row, "tolerance") == 1e-3);
    let found: Vec<f64> = tight.map(|row| number(row, "stabilisation")).collect();
    assert_eq!(found, [1e-1, 0.0], "{rows:?}");
    assert!(rows.iter().all(|row| row["case"].is_empty()), "{rows:?}");
    let (_folder, out) = study(GROWING, &["--over", "time.stabilisation=small"]);
    assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
}
