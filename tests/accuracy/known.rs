//! Errors that are known, and runs that fail.

use std::fs;

use rumple::tally::Work;

use super::{DECAY, GROWING, number, row, study, table, text};
use crate::common::plots;

#[test]
fn the_error_of_explicit_euler_is_that_of_its_formula() {
    let (folder, out) = study(DECAY, &["--tolerances", "1e-1,1e-2,1e-3"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let rows = table(folder.path());
    for step in [0.1, 0.01, 0.001f64] {
        let euler = (1.0 - step).powf(1.0 / step);
        let expected = (euler / (-1.0f64).exp() - 1.0).abs();
        let found = number(row(&rows, "staggered, Euler", step), "error of the species");
        assert!((found / expected - 1.0).abs() < 1e-3, "step {step}: {found}, not {expected}");
        assert_eq!(number(row(&rows, "staggered, Euler", step), "steps"), (1.0 / step).round());
    }
    // All counts by the names of all other tables.
    let implicit = row(&rows, "monolithic, BDF", 1e-3);
    for (name, _) in Work::NAMES {
        assert!(number(implicit, &name.replace('_', " ")) >= 0.0, "{name}");
    }
    assert!(number(implicit, "evaluations") >= number(implicit, "right hand sides"));
    assert!(number(implicit, "newton iterations") > 0.0 && number(implicit, "memory [MB]") > 0.0);
    // A tolerance that is asked for is about the error that one gets.
    for method in ["BDF", "TR-BDF2", "ESDIRK34"] {
        let found =
            number(row(&rows, &format!("monolithic, {method}"), 1e-3), "error of the species");
        assert!((1e-6..1e-2).contains(&found), "{method}: {found}");
    }
}

#[test]
fn runs_that_fail_are_shown_where_they_belong() {
    // Euler's steps of 1/10 are beyond its limit of stability, 2/50, and its values become infinite.
    let scene = DECAY.replace("-k*c", "-k*c*c*c*(1 + c*c)").replace("k = 1.0", "k = 4000.0");
    let (folder, out) = study(&scene, &["--tolerances", "1e-1,1e-4"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let rows = table(folder.path());
    let lost = row(&rows, "staggered, Euler", 0.1);
    assert_eq!(lost["status"], "failed");
    assert!(!lost["reason"].is_empty() && lost["error of the species"].is_empty(), "{lost:?}");
    let page = fs::read_to_string(folder.path().join("out/accuracy.md")).unwrap();
    assert!(page.contains("staggered, Euler, 1e-1: failed: "), "{page}");
    let html = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(html.contains("staggered, Euler, 1e-1: failed: "));
}

#[test]
fn a_run_that_takes_too_long_is_given_up_and_says_so() {
    let slow = ["--integrator", "{ kind = \"staggered\", method = \"euler\" }"];
    let limits = ["--tolerances", "1e-1,1e-7", "--limit", "1", "--seeds", "0"];
    let (folder, out) = study(GROWING, &[&slow[..], &limits].concat());
    let rows = table(folder.path());
    let lost = row(&rows, "staggered, Euler", 1e-7);
    assert_eq!(lost["status"], "failed", "{}", text(&out.stderr));
    assert!(lost["reason"].contains("the time limit of 1 s"), "{lost:?}");
    assert!(row(&rows, "staggered, Euler", 1e-1)["status"] == "complete");
}

#[test]
fn the_report_has_a_panel_for_every_quantity_and_every_run() {
    let (folder, out) = study(GROWING, &["--tolerances", "1e-1,1e-2"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let root = folder.path().join("out");
    let panels = &plots(&root)["work-precision"]["panels"];
    let titles: Vec<&str> =
        panels.as_array().unwrap().iter().map(|panel| panel["title"].as_str().unwrap()).collect();
    for quantity in ["species", "shape", "energy", "amplitude"] {
        assert!(titles.contains(&&*format!("error of the {quantity}")), "{titles:?}");
    }
    for panel in panels.as_array().unwrap() {
        let points = |curve: &serde_json::Value| curve["points"].as_array().unwrap().len();
        // Of two integrators at least a point, or a mark for an error of 0.
        let marks = panel["zeros"].as_array().unwrap().len();
        let drawn: usize = panel["curves"].as_array().unwrap().iter().map(points).sum();
        assert!(drawn + marks >= 4, "{panel}");
    }
    let rows = table(folder.path());
    assert_eq!(rows.len(), 4 * 2, "{rows:?}");
    let page = fs::read_to_string(root.join("accuracy.md")).unwrap();
    assert_eq!(page.matches("| complete ").count(), rows.len(), "{page}");
}
