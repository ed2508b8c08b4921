//! The chemistry between two shapes: every method against a reference, and its order.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use rumple::kinetics::PluginSearch;
use rumple::model::{EvaluationBuffers, State};
use rumple::scene::Scene;
use rumple::solve::{Control, SolveError};
use rumple::{Error, Simulation};

use super::{DOME, distance, final_state};

const METHODS: [&str; 6] = ["euler", "chebyshev", "tsit45", "bdf", "tr-bdf2", "esdirk34"];

const BRUSSELATOR: &str = r#"
[sheet]
shape = "point"
[kinetics]
plugin = "brusselator"
initial = { u = 1.0, v = 1.0 }
[time]
until = 4.0
"#;

fn staggered(text: &str, method: &str, tolerance: f64) -> State {
    let integrator = format!(
        "time.integrator={{kind=\"staggered\",step=0.01,chemistry=\"{method}\",rtol={tolerance:e},atol={tolerance:e}}}"
    );
    final_state(text, &["time.policy=\"quasi-static\"", &integrator])
}

/// Moving signals, diffusion on a moving shape: whatever integrates the chemistry, the answer is one.
#[test]
fn every_method_gives_the_same_coupled_solution() {
    let reference = final_state(
        DOME,
        &[
            "time.policy=\"quasi-static\"",
            "time.integrator={kind=\"monolithic\",rtol=1e-8,atol=1e-8}",
        ],
    );
    for method in METHODS {
        let (shape, species) = distance(&staggered(DOME, method, 1e-4), &reference);
        assert!(shape < 5e-4 && species < 5e-4, "{method}: {shape:e} {species:e}");
    }
}

/// Without a shape a step of the coupling is one of the chemistry, and its tolerance that of the answer.
#[test]
fn errors_follow_the_tolerance_where_nothing_else_moves() {
    let reference =
        final_state(BRUSSELATOR, &["time.integrator={kind=\"monolithic\",rtol=1e-10,atol=1e-12}"]);
    for method in METHODS.into_iter().filter(|method| *method != "euler") {
        let error = |tolerance| {
            let state = staggered(BRUSSELATOR, method, tolerance);
            let pairs = state.species.iter().flatten().zip(reference.species.iter().flatten());
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let (coarse, fine) = (error(1e-2), error(1e-5));
        assert!(coarse < 5e-2, "{method}: {coarse:e}");
        assert!(fine < 5e-5 && fine < 0.1 * coarse, "{method}: {coarse:e}, then {fine:e}");
    }
}

#[test]
fn a_method_is_refused_where_the_chemistry_settles_at_once() {
    let keys = [
        "time.policy=\"chemistry-fast\"".to_owned(),
        "time.integrator={kind=\"staggered\",chemistry=\"bdf\"}".to_owned(),
    ];
    let scene = Scene::parse(DOME, "scene.toml", &keys).unwrap();
    let search = PluginSearch::in_directories(vec![crate::plugins::build::directory().to_owned()]);
    let error = Simulation::new(&scene, &search).err().unwrap().to_string();
    assert!(error.contains("leave out chemistry = \"bdf\""), "{error}");
}

/// What makes the chemistry settle before the first step.
const SETTLING: [&str; 2] =
    ["time.policy=\"chemistry-fast\"", "time.integrator={kind=\"monolithic\",rtol=1e-6,atol=1e-6}"];

/// Where the chemistry has two steady states it settles in the one that it runs into: of a bistable
/// patch under tension those points that start above the unstable state end bound, the others not.
#[test]
fn a_bistable_chemistry_settles_in_the_state_it_runs_into() {
    let text = r#"
[sheet]
shape = "disc"
radius = 6.0
vertices = 80
[material]
young = 1e6
poisson = 0.3333333333333333
thickness = 2.0
[kinetics]
plugin = "tension-feedback"
initial.m = { gaussian = { width = 2.0, amplitude = 1.0 } }
[time]
until = 1.0
"#;
    let (_, mut simulation) = crate::common::prepare(text, &SETTLING);
    let mut slow = simulation.state().clone();
    simulation.prepare().unwrap();
    // The same by small explicit steps in time.
    let step = 2e-3;
    let mut memory = EvaluationBuffers::default();
    for _ in 0..20_000 {
        let rates = simulation.model().at(&slow, &mut memory).rates().unwrap().to_vec();
        for (c, r) in slow.species[0].iter_mut().zip(&rates[0]) {
            *c += step * r;
        }
    }
    let bound = |state: &State| state.species[0].iter().filter(|m| **m > 0.5).count();
    assert!(bound(&slow) > 0, "nothing stays bound");
    for (a, b) in simulation.state().species[0].iter().zip(&slow.species[0]) {
        assert!((a - b).abs() < 1e-3, "{a} {b}");
    }
}

/// What a simulation that is to stop after so many questions said, and whether it stopped for that.
fn interrupted(
    simulation: &mut Simulation,
    questions: usize,
    work: impl FnOnce(&mut Simulation) -> rumple::Result<()>,
) -> (bool, Vec<String>) {
    let asked = AtomicUsize::new(0);
    let reported = Arc::new(Mutex::new(Vec::new()));
    let seen = Arc::clone(&reported);
    simulation.set_control(Control::new(
        move || asked.fetch_add(1, Ordering::SeqCst) >= questions,
        move |text| seen.lock().unwrap().push(text()),
    ));
    let stopped = matches!(work(simulation), Err(Error::Solve(SolveError::Interrupted)));
    let reported = reported.lock().unwrap().clone();
    (stopped, reported)
}

/// Diffusion so fast that a step of the coupling takes millions of sub-steps.
#[test]
fn long_sub_steps_ask_whether_to_go_on_and_tell_how_far_they_are() {
    for method in METHODS.into_iter().filter(|method| *method != "euler") {
        let integrator =
            format!("time.integrator={{kind=\"staggered\",chemistry=\"{method}\",step=0.1}}");
        let policy = "time.policy=\"quasi-static\"";
        let keys = [policy, &integrator, "effect[4].coefficient=1e12"];
        let (_, mut simulation) = crate::common::prepare(DOME, &keys);
        simulation.prepare().unwrap();
        let (stopped, reported) = interrupted(&mut simulation, 20, |s| s.step(1.0).map(drop));
        assert!(stopped, "{method}");
        assert!(
            reported.iter().any(|t| t.contains("integrating the chemistry")),
            "{method}: {reported:?}"
        );
    }
}

#[test]
fn settling_asks_whether_to_go_on_and_tells_how_far_it_is() {
    let (_, mut simulation) = crate::common::prepare(DOME, &SETTLING);
    // Nothing is left to relax then.
    simulation.relax().unwrap();
    let (stopped, reported) = interrupted(&mut simulation, 4, |s| s.prepare().map(drop));
    assert!(stopped);
    assert!(
        reported.iter().any(|t| t.contains("relaxing the chemistry to steady state, step 1")),
        "{reported:?}"
    );
}

/// Errors are proportional to the tolerance over three decades, without space and with diffusion.
#[test]
fn errors_of_sub_steps_are_proportional_to_the_tolerance() {
    let spread = BRUSSELATOR
        .replace("shape = \"point\"", "shape = \"disc\"\nradius = 5.0\nvertices = 60")
        .replace("u = 1.0", "u = { gaussian = { width = 2.0, amplitude = 1.0 } }")
        + "[[effect]]\nkind = \"diffusion\"\nspecies = \"u\"\ncoefficient = 2.0\n";
    for text in [BRUSSELATOR, &spread] {
        let fine = "time.integrator={kind=\"monolithic\",rtol=1e-10,atol=1e-12}";
        let reference = final_state(text, &[fine]);
        for method in ["chebyshev", "tr-bdf2", "esdirk34"] {
            let shares = [1e-3, 1e-4, 1e-5, 1e-6].map(|tolerance| {
                let state = staggered(text, method, tolerance);
                let pairs = state.species.iter().flatten().zip(reference.species.iter().flatten());
                pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / tolerance
            });
            let least = shares.iter().copied().fold(f64::INFINITY, f64::min);
            let most = shares.iter().copied().fold(0.0, f64::max);
            assert!(most < 1.0 && most < 3.0 * least, "{method}: error over tolerance {shares:?}");
        }
    }
}
