//! Quasi-static shapes: references differ in the stabilisation as well.

use std::fs;

use super::{GROWING, study, table, text};

/// Options of a study of one integrator.
const FEW: [&str; 6] =
    ["--integrator", "staggered", "--tolerances", "1e-1,1e-2,1e-3", "--seeds", "0"];

#[test]
fn references_have_stabilisations_ten_times_apart_below_all_others() {
    let (folder, out) = study(GROWING, &FEW);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let said = text(&out.stdout);
    for expected in [
        "1e-4, stabilisation 1e-5",
        "2e-4, stabilisation 1e-4",
        "of one method at two stabilisations",
    ] {
        assert!(said.contains(expected), "{expected}: {said}");
    }
    let page = fs::read_to_string(folder.path().join("out/accuracy.md")).unwrap();
    assert!(page.contains("reference uncertainty: species"), "{page}");
    // A smaller one that the scene gives is that of its runs.
    let (_folder, out) =
        study(GROWING, &[&FEW[..], &["--set", "time.stabilisation=1e-4"]].concat());
    assert!(text(&out.stdout).contains("stabilisation 1e-6"), "{}", text(&out.stdout));
}

#[test]
fn stabilisations_that_are_varied_are_cases_with_references_of_their_own() {
    let over = ["--over", "time.stabilisation=1e-1,1e-3"];
    let (folder, out) = study(GROWING, &[&FEW[..], &over].concat());
    assert!(out.status.success(), "{}", text(&out.stderr));
    let rows = table(folder.path());
    for case in ["stabilisation = 1e-1", "stabilisation = 1e-3"] {
        assert_eq!(rows.iter().filter(|row| row["case"] == case).count(), 3, "{rows:?}");
    }
    let (_folder, out) = study(GROWING, &["--over", "time.stabilisation=small"]);
    assert_eq!(out.status.code(), Some(2), "{}", text(&out.stderr));
}
