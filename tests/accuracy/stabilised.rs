//! Quasi-static shapes: references differ in the stabilisation as well.

use std::fs;

use super::{GROWING, study, text};

/// Options of a study of one integrator.
const FEW: [&str; 6] =
    ["--integrator", "staggered", "--tolerances", "1e-1,1e-2,1e-3", "--seeds", "0"];

#[test]
fn references_have_stabilisations_ten_times_apart_below_all_others() {
    let (folder, out) = study(GROWING, &FEW);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let said = text(&out.stdout);
    assert!(!said.contains("unreliable"), "{said}");
    let page = fs::read_to_string(folder.path().join("out/accuracy.md")).unwrap();
    for expected in ["1e-4, stabilisation 1e-5", "2e-4, stabilisation 1e-4"] {
        assert!(page.contains(expected), "{expected}: {page}");
    }
    assert!(page.contains("reference uncertainty: species"), "{page}");
    // A smaller one that the scene gives is that of its runs.
    let (folder, _) = study(GROWING, &[&FEW[..], &["--set", "time.stabilisation=1e-4"]].concat());
    let page = fs::read_to_string(folder.path().join("out/accuracy.md")).unwrap();
    assert!(page.contains("stabilisation 1e-6"), "{page}");
}
