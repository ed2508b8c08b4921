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
fn the_report_has_every_plot_and_every_run() {
    let (folder, out) =
        study(GROWING, &["--tolerances", "1e-1,1e-2", "--force-tolerances", "1e-4,1e-6"]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let root = folder.path().join("out");
    let plots = plots(&root);
    for plot in ["work-precision", "error-in-time", "tolerance", "measures", "map"] {
        let panels = plots[plot]["panels"].as_array().unwrap();
        let curves = panels.iter().flat_map(|panel| panel["curves"].as_array().unwrap());
        let drawn = curves.filter(|curve| !curve["points"].as_array().unwrap().is_empty()).count();
        assert!(drawn >= 4, "{plot}: {panels:?}");
    }
    let rows = table(folder.path());
    // The stabilisations at the tighter tolerance but for that which equals it.
    assert_eq!(rows.len(), 4 * 2 * 2 + 3, "{rows:?}");
    let page = fs::read_to_string(root.join("accuracy.md")).unwrap();
    assert_eq!(page.matches("| complete ").count(), rows.len(), "{page}");
}

#[test]
fn the_mesh_is_studied_by_its_references() {
    let scene = GROWING.replace("vertices = 120", "vertices = 100");
    let over = ["--over", "sheet.vertices=100,200,400"];
    let few = ["--tolerances", "1e-2", "--seeds", "0", "--integrator", "staggered"];
    let (folder, out) = study(&scene, &[&over[..], &few].concat());
    assert!(out.status.success(), "{}", text(&out.stderr));
    let root = folder.path().join("out");
    let page = fs::read_to_string(root.join("accuracy.md")).unwrap();
    let line = page.lines().find(|line| line.starts_with("| energy")).unwrap();
    let cells: Vec<&str> = line.split('|').map(str::trim).collect();
    assert_eq!(cells.len(), 2 + 4 + 2, "{line}");
    assert!(cells[2..5].iter().all(|cell| cell.parse::<f64>().unwrap() > 0.0), "{line}");
    assert!(plots(&root).contains_key("cases-vertices"));
}

#[test]
fn policies_come_together_as_the_ratio_of_timescales_does() {
    let over = "time.policy=simultaneous,quasi-static";
    let drags = "material.drag=0.001,0.01";
    let one = ["--integrator", "staggered", "--tolerances", "1e-2", "--seeds", "0"];
    let arguments = [&one[..], &["--over", over, "--over", drags]].concat();
    let (folder, out) = study(GROWING, &arguments);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let page = fs::read_to_string(folder.path().join("out/accuracy.md")).unwrap();
    let line =
        page.lines().find(|line| line.contains("slope at the smallest distances")).expect(&page);
    let cells: Vec<&str> = line.split('|').map(str::trim).collect();
    assert_eq!(cells[1], "quasi-static from simultaneous");
    // Of the shape.
    let slope: f64 = cells[6].parse().unwrap();
    assert!((slope - 1.0).abs() < 0.15, "{line}\n{page}");
    assert!(plots(&folder.path().join("out")).contains_key("cases-policies"));
}
