//! Policies and integrators against each other and against their limits, on a smooth coupled scene.

use rumple::Vec3;
use rumple::model::State;

use super::{DOME, distance, final_state};
use crate::common::prepare;

fn run(policy: &str, integrator: &str, more: &[&str]) -> State {
    let policy = format!("time.policy=\"{policy}\"");
    let integrator = format!("time.integrator={{{integrator}}}");
    let mut all = vec![policy.as_str(), integrator.as_str(), "time.start=\"equilibrium\""];
    all.extend(more);
    final_state(DOME, &all)
}

fn monolithic(method: &str, rtol: f64) -> String {
    format!("kind=\"monolithic\",method=\"{method}\",rtol={rtol:e},atol={rtol:e}")
}

#[test]
fn all_methods_agree_under_every_policy() {
    for policy in ["quasi-static", "simultaneous", "chemistry-fast"] {
        let reference = run(policy, &monolithic("bdf", 1e-8), &[]);
        let mut others = vec![monolithic("tr-bdf2", 1e-6), monolithic("esdirk34", 1e-6)];
        others.push(monolithic("bdf", 1e-6) + ",linear=\"blocks\"");
        others.push("kind=\"staggered\",rtol=1e-5,atol=1e-5".into());
        if policy == "simultaneous" {
            others.push("kind=\"explicit\",method=\"tsit45\",rtol=1e-6,atol=1e-6".into());
        }
        for integrator in others {
            let (shape, species) = distance(&run(policy, &integrator, &[]), &reference);
            let text = format!("{policy}, {integrator}: {shape:e} {species:e}");
            assert!(shape < 1e-4 && species < 1e-4, "{text}");
        }
    }
}

/// The policies differ: what agrees above does not agree by being the same.
#[test]
fn policies_differ() {
    let [slow, both, fast] = ["quasi-static", "simultaneous", "chemistry-fast"]
        .map(|policy| run(policy, &monolithic("tr-bdf2", 1e-5), &[]));
    let (shape, _) = distance(&slow, &both);
    assert!(shape > 1e-3, "{shape:e}");
    let (_, species) = distance(&fast, &both);
    assert!(species > 0.1, "{species:e}");
}

/// Slope of log error against log of the number of steps, over a range of tolerances.
fn order(integrator: impl Fn(f64) -> String, tolerances: &[f64], reference: &State) -> f64 {
    let points: Vec<(f64, f64)> = tolerances
        .iter()
        .map(|&tolerance| {
            let state = run("simultaneous", &integrator(tolerance), &[]);
            let (shape, species) = distance(&state, reference);
            ((state.step as f64).ln(), shape.max(species).ln())
        })
        .collect();
    let n = points.len() as f64;
    let (mx, my) =
        (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let top: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    let bottom: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
    -top / bottom
}

#[test]
fn observed_orders_are_those_of_the_methods() {
    // From another method, a hundred times tighter than the finest of them.
    let reference = run("simultaneous", &monolithic("bdf", 1e-10), &[]);
    let tr_bdf2 = order(|t| monolithic("tr-bdf2", t), &[1e-4, 1e-5, 1e-6, 1e-7], &reference);
    assert!((tr_bdf2 - 2.0).abs() < 0.2, "TR-BDF2 {tr_bdf2}");
    let esdirk = order(|t| monolithic("esdirk34", t), &[1e-4, 1e-5, 1e-6, 1e-7, 1e-8], &reference);
    assert!((esdirk - 3.0).abs() < 0.2, "ESDIRK34 {esdirk}");
    let euler = |step: f64| format!("kind=\"explicit\",step={step:e}");
    let euler = order(euler, &[1e-3, 5e-4, 2.5e-4], &reference);
    assert!((euler - 1.0).abs() < 0.2, "Euler {euler}");
    let staggered = |step: f64| format!("kind=\"staggered\",method=\"euler\",step={step:e}");
    let staggered = order(staggered, &[0.1, 0.05, 0.025], &reference);
    assert!((staggered - 1.0).abs() < 0.2, "staggered Euler {staggered}");
    // Steps of the same length, by tolerances that accept everything; their sub-steps are accurate.
    let minimised = |step: f64| {
        format!("kind=\"staggered\",step={step:e},longest_step={step:e},rtol=2e-4,atol=2e-4")
    };
    let minimised = order(minimised, &[0.02, 0.01, 0.005], &reference);
    assert!((minimised - 2.0).abs() < 0.2, "staggered Heun, SDIRK2 {minimised}");
}

/// Distances from a limit, and the slope of their logarithms over the given ratios.
fn slope(ratios: &[f64], distances: &[f64]) -> f64 {
    let (first, last) = (0, ratios.len() - 1);
    (distances[last] / distances[first]).ln() / (ratios[last] / ratios[first]).ln()
}

#[test]
fn without_drag_simultaneous_becomes_quasi_static() {
    let integrator = monolithic("bdf", 1e-9);
    let limit = run("quasi-static", &integrator, &[]);
    let drags = [0.1, 0.01, 0.001];
    let distances = drags.map(|drag| {
        let drag = format!("material.drag={drag}");
        distance(&run("simultaneous", &integrator, &[&drag]), &limit).0
    });
    let slope = slope(&drags, &distances);
    assert!((slope - 1.0).abs() < 0.1, "{slope}: {distances:?}");
}

#[test]
fn with_fast_rates_simultaneous_becomes_chemistry_fast() {
    let integrator = monolithic("bdf", 1e-9);
    let limit = run("chemistry-fast", &integrator, &[]);
    let slowness = [1e-3, 1e-4, 1e-5];
    let distances = slowness.map(|slow| {
        let keys = [
            format!("kinetics.parameters.w={:e}", 2.0 / slow),
            format!("kinetics.parameters.beta={:e}", 1.0 / slow),
            format!("effect[4].coefficient={:e}", 1.0 / slow),
        ];
        let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
        distance(&run("simultaneous", &integrator, &keys), &limit).1
    });
    let slope = slope(&slowness, &distances);
    assert!((slope - 1.0).abs() < 0.1, "{slope}: {distances:?}");
}

/// A scene that names a policy alone gets an integrator that can do it.
#[test]
fn every_policy_has_a_default_integrator() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), DOME).unwrap();
    for (policy, expected) in [
        ("quasi-static", "staggered, predict-relax-correct"),
        ("simultaneous", "staggered, predict-relax-correct"),
        ("chemistry-fast", "monolithic, BDF"),
    ] {
        let out = std::process::Command::new(crate::run::program())
            .current_dir(folder.path())
            .env("RUMPLE_PLUGIN_PATH", crate::plugins::build::directory())
            .args(["check", "scene.toml", "--set", &format!("time.policy=\"{policy}\"")])
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&out.stdout);
        assert!(out.status.success(), "{text}{}", String::from_utf8_lossy(&out.stderr));
        let named = text.lines().find_map(|line| line.strip_prefix("integrator ")).unwrap();
        assert_eq!(named, expected);
    }
}

#[test]
fn what_is_elastic_needs_a_material() {
    use rumple::kinetics::PluginSearch;
    use rumple::scene::Scene;
    let text = DOME.replacen("[material]", "[stability]\n[output]\n#", 1);
    let text = ["young = 1e3", "poisson = 0.3333333333333333", "thickness = 2.0", "drag = 10.0"]
        .iter()
        .fold(text, |text, line| text.replacen(line, "", 1));
    let scene = Scene::parse(&text, "scene.toml", &[]).unwrap();
    let search = PluginSearch::in_directories(vec![crate::plugins::build::directory().to_owned()]);
    let error = rumple::Simulation::new(&scene, &search).err().unwrap().to_string();
    assert!(error.contains("missing table [material]"), "{error}");
}

#[test]
fn senseless_pairings_are_refused_with_the_reason() {
    use rumple::kinetics::PluginSearch;
    use rumple::scene::Scene;
    let refusal = |policy: &str, kind: &str| {
        let keys =
            [format!("time.policy=\"{policy}\""), format!("time.integrator={{kind=\"{kind}\"}}")];
        let scene = Scene::parse(DOME, "scene.toml", &keys).unwrap();
        let search =
            PluginSearch::in_directories(vec![crate::plugins::build::directory().to_owned()]);
        match rumple::Simulation::new(&scene, &search) {
            Ok(_) => panic!("{policy} with {kind} accepted"),
            Err(error) => error.to_string(),
        }
    };
    assert!(refusal("quasi-static", "explicit").contains("the shape has none"));
    assert!(refusal("chemistry-fast", "explicit").contains("the chemistry has none"));
}

/// The paper's bounded relaxation: a bounded number of descent steps, which does not count as a failure.
#[test]
fn a_bounded_relaxation_stops_short_of_rest() {
    let run = |steps: usize| {
        let method = format!("equilibrium={{method=\"descent\",steps={steps}}}");
        let euler = "time.integrator={kind=\"staggered\",method=\"euler\",step=0.1}";
        let (_, mut simulation) = prepare(DOME, &["time.policy=\"quasi-static\"", euler, &method]);
        simulation.prepare().unwrap();
        let mut report = None;
        for _ in 0..5 {
            report = Some(simulation.step(1.0).unwrap());
        }
        report.unwrap().relaxation
    };
    let (few, more) = (run(3), run(300));
    assert_eq!((few.iterations, more.iterations), (3, 300));
    assert!(few.residual > 3.0 * more.residual, "{few:?} {more:?}");
}

/// The ratio of rates is of the size of the error, and errors of 1.8 times it were seen: no bound.
#[test]
fn the_ratio_of_rates_is_not_called_a_bound() {
    let verdict = rumple::study::Timescales { shape_rate: 1.0, chemistry_rate: 0.1 }.verdict();
    assert!(verdict.contains("ratio 1.00e-1") && !verdict.contains("at most"), "{verdict}");
}

/// A step's error is relative to the pattern: of a uniform field its relative error, of a spot the spot's, and a
/// single point that switches counts by its share of the pattern.
#[test]
fn errors_of_a_step_are_relative_to_the_pattern() {
    let (_, simulation) = prepare(DOME, &[]);
    let (model, start) = (simulation.model(), simulation.state().clone());
    let points = start.species[0].len();
    let with = |c: &dyn Fn(usize) -> f64| {
        let mut state = start.clone();
        state.species[0].iter_mut().enumerate().for_each(|(i, value)| *value = c(i));
        state
    };
    let misfit = |a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64| {
        let (a, b) = (with(a), with(b));
        model.species_misfit(&b, (&a, &b), (0.01, 0.0))
    };
    let spot = |i: usize| if i < 40 { 2.0 } else { 0.0 };
    let near =
        |value: f64, expected: f64| assert!((value / expected - 1.0).abs() < 1e-9, "{value}");
    near(misfit(&|_| 2.04, &|_| 2.0), 2.0);
    near(misfit(&|i| 1.02 * spot(i), &spot), 2.0);
    let one = |i: usize| if i == 7 { 0.0 } else { 2.0 };
    near(misfit(&one, &|_| 2.0), 100.0 / (points as f64).sqrt());
    // Of a shape the same, by displacements from rest.
    let rest = simulation.sheet().rest();
    let at = |height: f64| {
        let mut state = start.clone();
        state.x = rest.iter().map(|x| x + height * Vec3::z()).collect();
        state
    };
    let b = at(3.0);
    near(model.shape_misfit(&b.x, (&at(3.06).x, &b.x), (0.01, 0.0)), 2.0);
}

/// Species on faces set lengths by weights of the current shape: the start is in equilibrium at the lengths of its own
/// shape, not of the one that its relaxation began with, and a chemistry that stands still leaves it where it is.
#[test]
fn a_start_with_species_on_faces_is_in_equilibrium() {
    let text = include_str!("../../models/accuracy/before.toml");
    let still = [
        "sheet.vertices=500",
        "kinetics.parameters.w=0.0",
        "kinetics.parameters.beta=0.0",
        "equilibrium.tolerance=1e-10",
        "time.integrator={kind=\"staggered\",step=1e-3}",
        "time.until=2e-3",
    ];
    let (_, mut simulation) = prepare(text, &still);
    simulation.prepare().unwrap();
    let residual = simulation.evaluate().residual().unwrap();
    assert!(residual <= 1e-10, "{residual:e}");
    let energy = |simulation: &mut rumple::Simulation| -> f64 {
        simulation.energies().unwrap().iter().map(|e| e.1).sum()
    };
    let start = energy(&mut simulation);
    simulation.step(1e-3).unwrap();
    let later = energy(&mut simulation);
    assert!((later / start - 1.0).abs() < 1e-8, "{start} {later}");
}

/// Species on faces in equilibrium: neither the coupling nor the part of the shape is symmetric. Steps are those that a
/// factor of the whole matrix gives; less exact solutions made Newton's method fail at any step, and twice the steps.
#[test]
fn equations_of_equilibrium_are_solved_as_exactly_as_newtons_method_needs() {
    let text = include_str!("../../models/accuracy/before.toml");
    for method in ["bdf", "esdirk34"] {
        let [whole, blocks] = ["lu", "blocks"].map(|linear| {
            let integrator = monolithic(method, 1e-3) + &format!(",linear=\"{linear}\"");
            let integrator = format!("time.integrator={{{integrator}}}");
            final_state(text, &["sheet.vertices=300", "time.until=0.5", &integrator])
        });
        let apart = blocks.step.abs_diff(whole.step);
        assert!(apart <= 1 + whole.step / 10, "{method}: {} and {}", blocks.step, whole.step);
        let (shape, species) = distance(&blocks, &whole);
        assert!(shape < 1e-3 && species < 1e-3, "{method}: {shape:e} {species:e}");
    }
}
