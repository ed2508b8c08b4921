//! The staggered coupling: order, determinism, the range of species, amounts, what a scene pays for.

use rumple::model::State;

use super::{final_state, prepare};

/// Largest difference of the species.
fn distance(a: &State, b: &State) -> f64 {
    let pairs = a.species.iter().flatten().zip(b.species.iter().flatten());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

// Before buckling the coupled solution is smooth: a gentle switch, a thick sheet.
const SMOOTH: [&str; 5] = [
    "material.thickness=3.0",
    "kinetics.parameters.b=2.0",
    "equilibrium.tolerance=1e-11",
    "time.integrator.longest_step=0.25",
    "kinetics.parameters.c_star=0.2",
];

fn smooth(more: &[&str]) -> State {
    let mut all: Vec<&str> = SMOOTH.to_vec();
    all.extend(more);
    final_state(&all)
}

fn order(coarse: &[&str], middle: &[&str], fine: &[&str], reference: &State) -> f64 {
    let error = |set: &[&str]| distance(&smooth(set), reference);
    let (a, b, c) = (error(coarse), error(middle), error(fine));
    assert!(a > b && b > c, "{a:e} {b:e} {c:e}");
    0.5 * (a / c).log2()
}

#[test]
fn euler_is_of_first_and_heun_of_second_order() {
    let loose = "time.integrator.rtol=1e3";
    let heun = |step: &'static str, longest: &'static str| {
        [step, longest, loose, "time.integrator.atol=1e3"]
    };
    // Tight tolerances would choose their own steps; for the order the step is prescribed by
    // tolerances that accept everything, so the chemistry within a step is one Chebyshev step.
    let reference = smooth(&[
        "time.integrator.rtol=1e-7",
        "time.integrator.atol=1e-7",
        "time.integrator.step=1e-3",
    ]);
    let heun_order = order(
        &heun("time.integrator.step=0.125", "time.integrator.longest_step=0.125"),
        &heun("time.integrator.step=0.0625", "time.integrator.longest_step=0.0625"),
        &heun("time.integrator.step=0.03125", "time.integrator.longest_step=0.03125"),
        &reference,
    );
    assert!((heun_order - 2.0).abs() < 0.2, "heun {heun_order}");
    let euler = |step: &'static str| ["time.integrator.method=\"euler\"", step];
    let euler_order = order(
        &euler("time.integrator.step=0.125"),
        &euler("time.integrator.step=0.0625"),
        &euler("time.integrator.step=0.03125"),
        &reference,
    );
    assert!((euler_order - 1.0).abs() < 0.2, "euler {euler_order}");
}

#[test]
fn the_error_follows_the_tolerance() {
    let run = |rtol: &'static str, atol: &'static str| smooth(&[rtol, atol]);
    let reference = run("time.integrator.rtol=1e-7", "time.integrator.atol=1e-7");
    let mut last = f64::INFINITY;
    for (rtol, atol, tolerance) in [
        ("time.integrator.rtol=1e-2", "time.integrator.atol=1e-2", 1e-2),
        ("time.integrator.rtol=1e-3", "time.integrator.atol=1e-3", 1e-3),
        ("time.integrator.rtol=1e-4", "time.integrator.atol=1e-4", 1e-4),
    ] {
        let error = distance(&run(rtol, atol), &reference);
        assert!(error < tolerance, "{error:e} at {tolerance:e}");
        assert!(error < last, "{error:e} after {last:e}");
        last = error;
    }
}

#[test]
fn the_same_scene_gives_the_same_bits_on_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| final_state(&["time.until=0.1"]))
    };
    let one = run(1);
    for threads in [2, 5] {
        let other = run(threads);
        assert!(one == other, "{threads} threads");
    }
}

const DIFFUSION: &str = "[[effect]]\nkind = \"diffusion\"\nspecies = \"c\"\ncoefficient = 1.0";
const FAST_DIFFUSION: &str =
    "[[effect]]\nkind = \"diffusion\"\nspecies = \"c\"\ncoefficient = 50.0";

#[test]
fn species_on_faces_and_diffusion_run_and_stay_in_range() {
    for extra in [
        &["kinetics.location=\"face\""][..],
        &["kinetics.location=\"face\"", DIFFUSION],
        &[FAST_DIFFUSION],
    ] {
        let state = final_state(extra);
        assert!(state.species[0].iter().all(|c| *c >= 0.0 && *c < 0.75), "{extra:?}");
    }
}

#[test]
fn a_failed_step_leaves_the_state_as_it_was() {
    // One iteration is not enough for a force of the last digits.
    let (_, mut simulation) = prepare(&[]);
    simulation.relax().unwrap();
    let (_, mut hopeless) = prepare(&[
        "equilibrium.max_iterations=1",
        "equilibrium.tolerance=1e-18",
        "time.integrator.method=\"euler\"",
        "time.integrator.step=0.3",
    ]);
    hopeless.state_mut().clone_from(simulation.state());
    let before = hopeless.state().clone();
    assert!(hopeless.step(1.0).is_err());
    assert!(before == *hopeless.state());
}

#[test]
fn a_scene_without_kinetics_has_no_species_and_no_plugin() {
    let text = super::SMALL.split("[kinetics]").next().unwrap().to_owned()
        + "[time]\nuntil = 1.0\nstop_when_steady = 1e-3\n";
    let scene = rumple::scene::Scene::parse(&text, "bare.toml", &[]).unwrap();
    let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
    let simulation = rumple::Simulation::new(&scene, &search).unwrap();
    assert!(simulation.model().chemistry().is_none());
    assert!(simulation.state().species.is_empty());
    assert!(simulation.plugins().is_empty());
}
