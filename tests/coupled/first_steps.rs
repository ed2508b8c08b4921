//! First steps: of what grows at tight tolerances, and of rates too fast for any.

use std::time::{Duration, Instant};

use rumple::Simulation;
use rumple::kinetics::PluginSearch;
use rumple::scene::Scene;

use crate::common::prepare;

/// A planar ring that grows by a half in the unit of time, free, with a slow decay.
const RING: &str = r#"
[sheet]
shape = "annulus"
outer = 2.0
inner = 1.0
vertices = 240
planar = true
[material]
young = 10.0
poisson = 0.3333333333333333
thickness = 1.0
[[effect]]
kind = "stretching"
[[effect]]
kind = "growth"
factor = "1 + t/2"
[kinetics]
rates.c = "-0.1*c"
initial.c = 1.0
[time]
until = 1.0
"#;

/// The shape has no storage: its slopes at the start are those that the equations without storage give.
#[test]
fn a_ring_that_grows_begins_at_any_tolerance_by_every_method() {
    for method in ["bdf", "tr-bdf2", "esdirk34"] {
        for (rtol, atol) in [(1e-4, 1e-6), (1e-8, 1e-10), (1e-4, 1e-10), (1e-8, 1e-11)] {
            for rate in ["-0.1*c", "-1e-6*c", "-1e4*(c - cos(t))"] {
                let integrator = format!(
                    "time.integrator={{kind='monolithic',method='{method}',rtol={rtol:e},atol={atol:e}}}"
                );
                let (_, mut simulation) =
                    prepare(RING, &[&integrator, &format!("kinetics.rates.c='{rate}'")]);
                let name = format!("{method}, {rtol:e}, {atol:e}, {rate}");
                simulation.prepare().unwrap_or_else(|e| panic!("{name}: {e}"));
                let size =
                    |x: &[rumple::Vec3]| x.iter().map(|y| (y - x[0]).norm()).fold(0.0, f64::max);
                let before = size(&simulation.state().x);
                let mut steps = 0;
                while simulation.state().time < 1.0 {
                    simulation.step(1.0).unwrap_or_else(|e| panic!("{name}: {e}"));
                    steps += 1;
                }
                let grown = size(&simulation.state().x) / before;
                assert!((grown - 1.5).abs() < 1e-6, "{name}: {grown}");
                assert!(steps < 3000, "{name}: {steps} steps");
            }
        }
    }
}

const POINT: &str = r#"
[sheet]
shape = "point"
[kinetics]
rates.c = "-c"
initial.c = 1.0
[time]
policy = "simultaneous"
until = 1.0
"#;

const INTEGRATORS: [&str; 10] = [
    "{kind='explicit',method='tsit45'}",
    "{kind='staggered'}",
    "{kind='staggered',chemistry='bdf'}",
    "{kind='staggered',chemistry='tr-bdf2'}",
    "{kind='staggered',chemistry='esdirk34'}",
    "{kind='staggered',chemistry='tsit45'}",
    "{kind='staggered',chemistry='euler'}",
    "{kind='monolithic'}",
    "{kind='monolithic',method='tr-bdf2'}",
    "{kind='monolithic',method='esdirk34'}",
];

/// Steps that have fallen to nothing end a run, with the species that asks for them.
#[test]
fn rates_that_no_step_follows_end_a_run_with_their_species() {
    for rate in ["-1e90*1e90*c", "-1e90*c"] {
        // Both end the staggered default alike, whose sub-steps take the longest to fall.
        let falls = |integrator: &&str| rate != "-1e90*c" || *integrator != "{kind='staggered'}";
        for integrator in INTEGRATORS.into_iter().filter(falls) {
            let keys =
                [format!("kinetics.rates.c='{rate}'"), format!("time.integrator={integrator}")];
            let (_, mut simulation) = prepare(POINT, &[&keys[0], &keys[1]]);
            simulation.prepare().unwrap();
            let begun = Instant::now();
            let failure = loop {
                if simulation.state().time >= 1.0 {
                    break None;
                }
                if let Err(error) = simulation.step(1.0) {
                    break Some(error.to_string());
                }
            };
            let seconds = begun.elapsed();
            println!("{rate}, {integrator}: {seconds:?}, {failure:?}");
            assert!(seconds < Duration::from_secs(60), "{rate}, {integrator}: {seconds:?}");
            let implicit = ["bdf", "esdirk34", "monolithic"].iter().any(|m| integrator.contains(m));
            match failure {
                // What decays is steady soon, and implicit steps grow.
                None => assert!(implicit && rate == "-1e90*c", "{rate}, {integrator}"),
                Some(error) => {
                    assert!(error.contains("lead nowhere"), "{rate}, {integrator}: {error}");
                    assert!(!implicit || error.contains("species `c` at vertex 0"), "{error}");
                }
            }
        }
    }
}

#[test]
fn numbers_of_formulas_are_of_sizes_that_can_be_computed_with() {
    for number in ["1e150", "1e-150"] {
        let key = format!("kinetics.rates.c='-{number}*c'");
        let scene = Scene::parse(POINT, "scene.toml", &[key]).unwrap();
        let error = Simulation::new(&scene, &PluginSearch::in_directories(Vec::new())).err();
        let error = error.unwrap().to_string();
        assert!(error.contains("not of a size between 1e-100 and 1e100"), "{error}");
    }
}
