//! Runs that end when steady: not before what is still to come.

use std::fs;

use super::program::{folder, passes};

/// Where a run of a strip with this effect, and `species` beside it, ends.
fn ends(effect: &str, policy: &str) -> f64 {
    let folder = folder(&format!(
        "sheet = {{ shape = \"rectangle\", width = 4.0, height = 2.0, vertices = 60, planar = true }}\n\
         material = {{ young = 1e3, poisson = 0.3, thickness = 0.1, drag = {{ per-area = 1.0 }} }}\n\
         time = {{ policy = \"{policy}\", until = 10.0, stop_when_steady = 1e-3 }}\n\
         output = {{ every = 1.0, report = false }}\n\
         [[effect]]\nkind = \"stretching\"\n\
         [[effect]]\nkind = \"pin\"\nwhere = {{ box = {{ min = [-2.01, -2, -1], max = [-1.99, 2, 1] }} }}\naxes = \"xy\"\n\
         {effect}\n"
    ));
    passes(folder.path(), "run scene.toml --out out");
    let ledger = fs::read_to_string(folder.path().join("out/ledger.csv")).unwrap();
    ledger.lines().last().unwrap().split(',').nth(1).unwrap().parse().unwrap()
}

#[test]
fn a_run_is_not_steady_before_its_loads_have_changed() {
    let load = |ramp: &str| {
        format!(
            "[[effect]]\nkind = \"load\"\nwhere = {{ box = {{ min = [1.99, -2, -1], max = [2.01, 2, 1] }} }}\n\
             force = {{ total = [1.0, 0, 0] }}\nramp = {ramp}"
        )
    };
    for policy in ["quasi-static", "simultaneous"] {
        let ramped = ends(&load("{ points = [[0, 0], [5, 0], [6, 1]] }"), policy);
        assert!((6.0..10.0).contains(&ramped), "{policy}: {ramped}");
        let switched = ends(&load("{ formula = \"1/(1 + exp(-20*(t - 5)))\" }"), policy);
        assert!((5.0..10.0).contains(&switched), "{policy}: {switched}");
        let grown = ends("[[effect]]\nkind = \"growth\"\nfactor = \"1 + 0.01*t\"", policy);
        assert_eq!(grown, 10.0, "{policy}");
        let held = ends(
            "[[effect]]\nkind = \"hold\"\nspecies = \"c\"\nwhere = \"rim\"\nvalue = \"1/(1 + exp(-20*(t - 5)))\"\n\
             [kinetics]\nrates.c = \"0\"",
            policy,
        );
        assert!((5.0..10.0).contains(&held), "{policy}: {held}");
    }
    let still = ends(&load("{ points = [[0, 1], [1, 1]] }"), "quasi-static");
    assert!(still < 5.0, "{still}");
}
