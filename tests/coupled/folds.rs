//! Under `chemistry-fast` the steady state of the chemistry may end while the shape moves.

use crate::common::prepare;

/// Model II on a small disc: motors that tension holds; as it relaxes they let go.
const MOTORS: &str = r#"
[sheet]
shape = "disc"
radius = 30.0
vertices = 200
imperfection = { amplitude = 0.05, seed = 7 }
[material]
young = 1e6
poisson = 0.3333333333333333
thickness = 2.0
[[effect]]
kind = "stretching"
[[effect]]
kind = "bending"
[[effect]]
kind = "pin"
where = "rim"
axes = "z"
[kinetics]
plugin = "tension-feedback"
tension = "paper"
initial.m = { gaussian = { width = 10.0, amplitude = 1.0 } }
[time]
policy = "chemistry-fast"
until = 12.0
"#;

/// A tried state out of range is a rejected step; what ends the run is said, with what to do.
#[test]
fn the_end_of_a_steady_state_is_not_blamed_on_a_tried_state() {
    for method in ["tr-bdf2", "bdf"] {
        let keys = [format!("time.integrator={{kind='monolithic',method='{method}',rtol=1e-2}}")];
        let (_, mut simulation) = prepare(MOTORS, &[&keys[0]]);
        simulation.prepare().unwrap();
        let before = simulation.state().clone();
        let error = loop {
            match simulation.step(12.0) {
                Ok(_) => assert!(simulation.state().step < 1000, "{method} does not stop"),
                Err(error) => break error.to_string(),
            }
        };
        assert!(
            error.contains("the steady state that the chemistry is in ends near time"),
            "{method}: {error}"
        );
        assert!(error.contains("time.integrator = \"staggered\""), "{method}: {error}");
        assert!(!error.contains("optimal lengths"), "{method}: {error}");
        let species = simulation.state().species.concat();
        assert!(species.iter().all(|m| (0.0..=1.0).contains(m)), "{method}: {species:?}");
        assert!(simulation.state().time > before.time);
    }
}

/// A chemistry that is steady says nothing of the speed of the shape, which the first step follows from.
#[test]
fn the_first_step_of_chemistry_fast_follows_from_the_motion_of_the_shape() {
    let (_, mut simulation) = prepare(MOTORS, &["time.integrator={kind='staggered',rtol=1e-2}"]);
    simulation.prepare().unwrap();
    let report = simulation.step(12.0).unwrap();
    assert_eq!(report.work.rejected, 0, "{:?}", report.rejected);
    assert!(report.length < 1e-6 && report.work.newton_iterations < 50, "{report:?}");
}

/// Beyond a fold the search for a steady state follows the rates, not the linear system, which points backwards there: it
/// found all motors bound, seven times as many as the rates lead to.
#[test]
fn the_chemistry_settles_where_its_rates_lead() {
    let total = |keys: &[&str]| {
        let (scene, mut simulation) = prepare(MOTORS, keys);
        simulation.prepare().unwrap();
        let until = scene.time.span.until.get();
        while scene.time.policy.name() == "simultaneous" && simulation.state().time < until {
            simulation.step(until).unwrap();
        }
        simulation.state().species[0].iter().sum::<f64>()
    };
    let still = [
        "time.policy='simultaneous'",
        "material.drag=1e15",
        "time.until=2000.0",
        "time.integrator={kind='monolithic',rtol=1e-6,atol=1e-8}",
    ];
    let (expected, found) = (total(&still), total(&["time.integrator='staggered'"]));
    assert!((found / expected - 1.0).abs() < 0.25, "{found}, not {expected}");
}
