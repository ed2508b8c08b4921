//! Whole runs give the same bits on any number of threads, and do the same work for them: every policy with
//! every integrator.

use rumple::model::State;
use rumple::tally::Work;

use super::{DOME, finished};

use crate::common::shipped;

fn on(threads: usize, all: &[&str]) -> (State, Work) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let done = pool.install(|| finished(DOME, all));
    (done.state().clone(), done.spent().work)
}

fn same(all: &[&str]) {
    let one = on(1, all);
    assert!(one.1.steps > 0 && one.1.law_sites > one.1.law_calls, "{:?}", one.1);
    // 2 and 4 are compared in `run::bits`.
    assert!(on(3, all) == one, "{all:?}");
}

#[test]
fn every_policy_with_every_integrator() {
    let kinds = [
        "kind=\"staggered\",rtol=1e-3,atol=1e-3",
        "kind=\"staggered\",method=\"euler\",step=0.01",
        "kind=\"monolithic\",method=\"bdf\",rtol=1e-4,atol=1e-4",
        "kind=\"monolithic\",method=\"tr-bdf2\",rtol=1e-4,atol=1e-4",
        "kind=\"monolithic\",method=\"esdirk34\",rtol=1e-4,atol=1e-4",
    ];
    for policy in ["quasi-static", "simultaneous", "chemistry-fast"] {
        for kind in kinds {
            // Enough unknowns for the factors of two fields.
            same(&[
                &format!("time.policy=\"{policy}\""),
                &format!("time.integrator={{{kind}}}"),
                "time.until=0.02",
                "sheet.vertices=1100",
            ]);
        }
    }
    let explicit = "time.integrator={kind=\"explicit\",method=\"tsit45\",rtol=1e-4,atol=1e-4}";
    same(&[explicit, "time.until=0.002", "sheet.vertices=1100"]);
}

#[test]
fn every_linear_solver_and_preconditioner() {
    let until = "time.until=0.02";
    for linear in ["lu", "blocks"] {
        let integrator = format!(
            "time.integrator={{kind=\"monolithic\",rtol=1e-4,atol=1e-4,linear=\"{linear}\"}}"
        );
        same(&[&integrator, until, "sheet.vertices=400"]);
    }
    for more in ["precision=\"single\"", "precision=\"double\"", "preconditioner=\"multigrid\""] {
        let relax = format!("equilibrium={{method=\"lbfgs\",tolerance=1e-7,{more}}}");
        let integrator = "time.integrator={kind=\"staggered\",rtol=1e-3,atol=1e-3}";
        same(&[&relax, integrator, "time.policy=\"quasi-static\"", until, "sheet.vertices=1100"]);
    }
}

/// A shape that is as good as singular, positive by one factor and not by the other, is solved by one of them:
/// this run went on for ever in its 23rd step.
#[test]
fn a_shape_at_the_edge_of_stability_comes_to_an_end() {
    let text = shipped("models/paper/model-i.toml");
    let integrator = "time.integrator={kind=\"monolithic\",method=\"bdf\",rtol=1e-3,atol=1e-3}";
    let smaller = [
        "sheet.radius=40",
        "sheet.vertices=3200",
        "time.until=0.2",
        "time.start=\"equilibrium\"",
        integrator,
    ];
    assert_eq!(super::final_state(&text, &smaller).time, 0.2);
}
