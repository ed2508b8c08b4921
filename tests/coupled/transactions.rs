//! A step that fails leaves everything as it was: later steps have the bits of a run that was never disturbed.

use std::sync::atomic::{AtomicUsize, Ordering};

use rumple::solve::{Control, SolveError};
use rumple::{Error, Simulation};

use super::DOME;
use crate::common::prepare;
use crate::plugins::build::c_library;

/// Own methods, under every policy, with every way to relax that remembers something.
const CASES: [&[&str]; 10] = [
    &["time.policy=\"quasi-static\""],
    &[
        "time.policy=\"quasi-static\"",
        "equilibrium.preconditioner=\"blocks\"",
        "equilibrium.tolerance=1e-4",
    ],
    &[
        "time.policy=\"quasi-static\"",
        "time.integrator={ kind = \"staggered\", method = \"euler\", step = 0.05 }",
    ],
    &[
        "time.policy=\"quasi-static\"",
        "time.integrator={ kind = \"staggered\", chemistry = \"bdf\" }",
    ],
    &["time.policy=\"quasi-static\"", "equilibrium.preconditioner=\"multigrid\""],
    &["time.policy=\"simultaneous\"", "time.integrator=\"staggered\""],
    &["time.policy=\"simultaneous\"", "equilibrium.preconditioner=\"multigrid\""],
    // An invariant that is checked after every step, and holds.
    &["time.policy=\"simultaneous\"", "invariants.crossings=0"],
    &["time.policy=\"simultaneous\"", "time.integrator={ kind = \"explicit\", step = 1e-6 }"],
    &[
        "time.policy=\"chemistry-fast\"",
        "time.integrator={ kind = \"staggered\", longest_step = 0.1 }",
        "kinetics.parameters.b=1",
    ],
];

/// A time that no case reaches.
const UNTIL: f64 = 100.0;
/// Steps of the undisturbed run after those that are disturbed.
const LATER: usize = 3;

fn step(simulation: &mut Simulation, keys: &[&str]) {
    simulation.step(UNTIL).unwrap_or_else(|e| panic!("{keys:?}: {e}"));
}

#[test]
fn a_step_that_is_cut_short_anywhere_leaves_no_trace() {
    for keys in CASES {
        let [mut whole, mut disturbed] = [(); 2].map(|()| prepare(DOME, keys).1);
        for simulation in [&mut whole, &mut disturbed] {
            simulation.prepare().unwrap();
            step(simulation, keys);
        }
        let mut cut = 0;
        for questions in [0, 1, 2, 4, 7, 12, 20, 33, 54] {
            let before = disturbed.state().clone();
            let asked = AtomicUsize::new(0);
            let stops = move || asked.fetch_add(1, Ordering::SeqCst) >= questions;
            disturbed.set_control(Control::new(stops, |_| ()));
            match disturbed.step(UNTIL) {
                Err(Error::Solve(SolveError::Interrupted)) => {
                    cut += 1;
                    assert!(*disturbed.state() == before, "{keys:?}: {questions} questions");
                }
                Err(error) => panic!("{keys:?}: {error}"),
                Ok(_) => step(&mut whole, keys),
            }
            disturbed.set_control(Control::default());
        }
        assert!(cut > 0, "{keys:?}");
        for later in 0..LATER {
            step(&mut whole, keys);
            step(&mut disturbed, keys);
            assert!(
                whole.state() == disturbed.state(),
                "{keys:?}: step {later} after {cut} cut ones"
            );
        }
    }
}

/// A law that fails in one call of hundreds, and not for a step that is too long.
#[cfg(unix)]
#[test]
fn a_law_that_fails_once_leaves_no_trace() {
    for policy in ["quasi-static", "simultaneous"] {
        let [mut whole, mut disturbed] = ["NONE", "FAILS_ONCE"].map(|fault| {
            let name = format!("planted_{fault}_{policy}");
            let library = c_library("tests/faulty/planted.c", &name, &[&format!("FAULT={fault}")]);
            let text = DOME
                .replace("curvature-feedback", library.to_str().unwrap())
                .replace(
                    "parameters = { c_star = 0.4, b = 3.0, w = 2.0, H_s = 0.5, lambda_min = 0.95 }",
                    "",
                )
                .replace("amplitude = 0.3", "amplitude = 0.8");
            let mut simulation = prepare(&text, &[&format!("time.policy=\"{policy}\"")]).1;
            simulation.prepare().unwrap();
            simulation
        });
        let mut failed = 0;
        while disturbed.state().time < 1.0 {
            let before = disturbed.state().clone();
            if let Err(error) = disturbed.step(1.0) {
                failed += 1;
                assert!(error.to_string().contains("planted to fail"), "{error}");
                assert!(*disturbed.state() == before);
                continue;
            }
            whole.step(1.0).unwrap_or_else(|e| panic!("{policy}: {e}"));
            assert!(whole.state() == disturbed.state(), "{policy}: time {}", whole.state().time);
        }
        assert_eq!(failed, 1, "{policy}: the fault was not met");
    }
}
