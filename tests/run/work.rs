//! The account of work: what a hand counts, and one total in every file.

use std::fs;
use std::path::Path;

use rumple::run::Costs;
use rumple::tally::Work;
use serde_json::Value;

use super::{SMALL, prepare, rumple};
use crate::common;

/// The status of the scene `text` after a run in `folder`, and the sums of its ledger's columns by their names.
fn ran(folder: &Path, text: &str) -> (Value, impl Fn(&str) -> f64 + use<>) {
    fs::write(folder.join("scene.toml"), text).unwrap();
    let out = rumple(folder, &["run", "scene.toml", "--out", "out", "--quiet"]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let status = fs::read_to_string(folder.join("out/status.json")).unwrap();
    let ledger = fs::read_to_string(folder.join("out/ledger.csv")).unwrap();
    let sum = move |name: &str| {
        let column = ledger.lines().next().unwrap().split(',').position(|title| title == name);
        let column = column.unwrap_or_else(|| panic!("no column {name}: {ledger}"));
        let cells = ledger.lines().skip(1).map(|row| row.split(',').nth(column).unwrap());
        cells.map(|cell| cell.parse::<f64>().unwrap()).sum()
    };
    (serde_json::from_str(&status).unwrap(), sum)
}

/// A law at a point.
const POINT: &str = "sheet = { shape = 'point' }
    time = { policy = 'simultaneous', integrator = INTEGRATOR, until = 1.0 }
    [kinetics]
    rates.c = '-c'
    initial.c = 1.0
";

#[test]
fn rows_of_the_ledger_add_up_to_the_status() {
    let watched = format!("{SMALL}\n[stability]\nmodes = 2\n");
    let implicit = POINT.replace("INTEGRATOR", "{ kind = 'monolithic' }");
    for text in [SMALL, &watched, &implicit] {
        let folder = tempfile::tempdir().unwrap();
        let (status, sum) = ran(folder.path(), text);
        let work: Work = serde_json::from_value(status["work"].clone()).unwrap();
        for ((name, _), count) in Work::NAMES.iter().zip(work.values()).skip(1) {
            assert_eq!(sum(&name.replace('_', " ")), count as f64, "{name}: {work:?}");
        }
        assert!(work.steps > 1 && work.law_calls > work.steps && work.factorisations > 0);
        assert_eq!(Costs::read(&folder.path().join("out")).unwrap().work, work);
        // The start is a part of the whole.
        for time in ["cpu_seconds", "wall_seconds"] {
            let [all, start] = [&status, &status["start"]].map(|of| of[time].as_f64().unwrap());
            assert!(0.0 <= start && start < all && all < 1000.0, "{time}: {start} of {all}");
        }
        assert_eq!(status["start"]["work"]["steps"], 0);
    }
}

#[test]
fn names_are_those_of_the_files() {
    let Value::Object(keys) = serde_json::to_value(Work::default()).unwrap() else { panic!() };
    let names: Vec<&str> = Work::NAMES.iter().map(|(name, _)| *name).collect();
    assert_eq!(names.len(), keys.len());
    assert!(names.iter().all(|name| keys.contains_key(*name)), "{names:?}");
    let explained = |what: &str| what.ends_with('.') && !what.starts_with(' ');
    assert!(Work::NAMES.iter().all(|(_, what)| explained(what)), "{:?}", Work::NAMES);
}

/// Ten steps of Euler's method: ten right-hand sides, each of which calls the law once at one point.
#[test]
fn explicit_steps_cost_a_right_hand_side_each() {
    let euler = POINT.replace("INTEGRATOR", "{ kind = 'explicit', step = 0.1 }");
    let (_, mut simulation) = common::prepare(&euler, &[]);
    simulation.prepare().unwrap();
    let start = simulation.spent().work;
    let mut rows = start;
    while simulation.state().time < 1.0 {
        rows += simulation.step(1.0).unwrap().work;
    }
    let ten = Work { steps: 10, right_hand_sides: 10, law_calls: 10, law_sites: 10, ..start };
    assert_eq!((start, rows), (Work::default(), ten));
    assert_eq!(simulation.spent().work, ten);
}

/// Of a shape that moves by its forces such a step is one evaluation as well, whatever comes out of it.
#[test]
fn explicit_steps_of_a_shape_are_an_evaluation_each() {
    let explicit = "time.integrator={kind=\"explicit\",step=1e-7}";
    let keys = ["time.policy=\"simultaneous\"", explicit, "material.drag=1.0", "time.until=1e-6"];
    let (_, mut simulation) = prepare(&keys);
    simulation.prepare().unwrap();
    let start = simulation.spent().work;
    while simulation.state().time < 1e-6 {
        simulation.step(1e-6).unwrap();
    }
    let work = simulation.spent().work - start;
    assert_eq!((work.steps, work.evaluations(), work.right_hand_sides), (10, 10, 10), "{work:?}");
    assert_eq!((work.energies, work.gradients), (0, 0), "{work:?}");
}

/// Evaluations of observers are counted, but not as work of steps.
#[test]
fn looking_costs_steps_nothing() {
    let (_, mut simulation) = prepare(&[]);
    simulation.prepare().unwrap();
    let before = simulation.spent().work;
    let all = simulation.model().tally().work();
    assert!(before.iterations > 0 && before.gradients > before.iterations, "{before:?}");
    simulation.energies().unwrap();
    assert_eq!((simulation.model().tally().work() - all).energies, 1);
    assert_eq!(simulation.spent().work, before);
}
