//! Steps end where something jumps or bends in time.

use rumple::Simulation;
use rumple::kinetics::PluginSearch;
use rumple::scene::Scene;

use super::program::{folder, passes, text};
use crate::common::prepare;
use crate::plugins::build::rust_library;

const PULSE: &str = r#"
[sheet]
shape = "point"
[kinetics]
rates.c = "step(t-50)*step(52-t)"
[time]
policy = "simultaneous"
until = 100.0
"#;

/// The times at which steps end.
fn ends(simulation: &mut Simulation, until: f64) -> Vec<f64> {
    let mut ends = Vec::new();
    simulation.prepare().unwrap_or_else(|e| panic!("{e}"));
    while simulation.state().time < until {
        simulation.step(until).unwrap_or_else(|e| panic!("time {:?}: {e}", ends.last()));
        ends.push(simulation.state().time);
    }
    ends
}

/// What `rumple check` prints.
fn check(scene: &str) -> String {
    let folder = folder(scene);
    let out = passes(folder.path(), "check scene.toml");
    text(&out.stdout)
}

fn integrators() -> Vec<String> {
    let mut all = vec![
        "{ kind = \"staggered\" }".to_owned(),
        "{ kind = \"staggered\", method = \"euler\", step = 0.5 }".into(),
        "{ kind = \"staggered\", method = \"euler\", step = 0.5, chemistry = \"bdf\" }".into(),
        "{ kind = \"explicit\", method = \"euler\", step = 0.5 }".into(),
        "{ kind = \"explicit\", method = \"tsit45\" }".into(),
    ];
    for method in ["euler", "chebyshev", "tsit45", "bdf", "tr-bdf2", "esdirk34"] {
        all.push(format!("{{ kind = \"staggered\", chemistry = \"{method}\" }}"));
    }
    for method in ["bdf", "tr-bdf2", "esdirk34"] {
        all.push(format!("{{ kind = \"monolithic\", method = \"{method}\" }}"));
    }
    all
}

#[test]
fn a_pulse_in_time_is_not_stepped_over_by_any_integrator() {
    let (_, mut simulation) = prepare(PULSE, &[]);
    ends(&mut simulation, 100.0);
    let c = simulation.state().species[0][0];
    assert!((c - 2.0).abs() < 1e-9, "the default: {c}");
    for integrator in integrators() {
        let (_, mut simulation) = prepare(PULSE, &[&format!("time.integrator={integrator}")]);
        let ends = ends(&mut simulation, 100.0);
        let c = simulation.state().species[0][0];
        assert!((c - 2.0).abs() < 1e-9, "{integrator}: {c}");
        assert!(ends.contains(&50.0) && ends.contains(&52.0), "{integrator}: {ends:?}");
    }
}

/// Whatever the formula that the time is in, and however short the pulse.
#[test]
fn kinks_of_laws_are_found_in_every_formula() {
    let cases: [(&str, &[f64]); 9] = [
        ("step(t-50)", &[50.0]),
        ("pos(t-31.5)", &[31.5]),
        ("abs(sin(t/10))", &[31.41592653589793, 62.83185307179586, 94.24777960769379]),
        ("min(t/20, 1) - c", &[20.0]),
        ("max(exp(t/50), 2)", &[34.657359027997266]),
        ("c*step(1e-5 - abs(t - 77))", &[76.99999, 77.0, 77.00001]),
        ("hill(t - 40, 1, 2)", &[40.0]),
        ("step((t-30)^2 - 4)", &[28.0, 32.0]),
        ("step(1e-3 - (t-30)*(t-30.001))", &[29.96887327, 30.03212673]),
    ];
    for (law, expected) in cases {
        let rates = format!("kinetics.rates.c='{law}'");
        let (_, mut simulation) = prepare(PULSE, &[&rates, "kinetics.initial.c=1.0"]);
        let ends = ends(&mut simulation, 100.0);
        for kink in expected {
            assert!(
                ends.iter().any(|end| (end - kink).abs() < 1e-6),
                "{law}: no step ends at {kink}: {ends:?}"
            );
        }
    }
}

/// Laws that are smooth in time have steps as before.
#[test]
fn smooth_laws_have_no_breakpoints() {
    for law in ["sin(t)", "exp(-t)", "1/(1+t)", "t*c", "step(c - 0.5)", "tanh(t/50 - 1)"] {
        let (_, simulation) = prepare(PULSE, &[&format!("kinetics.rates.c='{law}'")]);
        assert_eq!(simulation.notes(), [] as [&str; 0], "{law}");
        let out = check(&PULSE.replace("step(t-50)*step(52-t)", law));
        assert!(!out.contains("steps end at"), "{law}: {out}");
    }
}

/// A kink at an output time is one time, whatever the rounding of either.
#[test]
fn a_kink_at_an_output_time_is_met_once() {
    let keys = [
        "kinetics.rates.c='step(t-0.3)'",
        "time.until=1.0",
        "output.every=0.1",
        "time.integrator={kind='staggered'}",
    ];
    let (_, mut simulation) = prepare(PULSE, &keys);
    simulation.prepare().unwrap();
    for k in 1..=10_u32 {
        let target = (f64::from(k) * 0.1_f64).min(1.0);
        while simulation.state().time < target {
            let report = simulation.step(target).unwrap();
            assert!(report.length > 1e-9, "a step of {:e} at {target}", report.length);
        }
        assert_eq!(simulation.state().time.to_bits(), target.to_bits());
    }
    let c = simulation.state().species[0][0];
    assert!((c - 0.7).abs() < 1e-9, "{c}");
}

const LOADED: &str = r#"
effect = [
    { kind = "stretching" },
    { kind = "bending" },
    { kind = "pin", where = "rim", axes = "xyz" },
]
sheet = { shape = "disc", radius = 5.0, vertices = 60 }
material = { young = 1e4, poisson = 0.3, thickness = 0.5 }
time = { until = 10.0 }
"#;

#[test]
fn kinks_of_ramps_and_growth_are_step_ends() {
    let cases = [
        (
            "effect+={kind=\"load\",where=\"all\",force={total=[0,0,1]},ramp={formula=\"min(t/3,1)\"}}",
            3.0,
        ),
        ("effect+={kind=\"pressure\",value=0.1,ramp={points=[[0,0],[4.5,1],[20,2]]}}", 4.5),
        ("effect+={kind=\"growth\",factor=\"1+0.01*pos(t-7)\"}", 7.0),
        ("effect+={kind=\"growth\",factor=\"1+0.01*step(t-5-100*pos(x-4.9))\"}", 5.0),
    ];
    for (effect, kink) in cases {
        let scene = LOADED.replace(
            "    { kind = \"pin\"",
            &format!("    {},\n    {{ kind = \"pin\"", &effect[8..]),
        );
        let (_, mut simulation) = prepare(&scene, &[]);
        let ends = ends(&mut simulation, 10.0);
        assert!(ends.contains(&kink), "{effect}: {ends:?}");
    }
}

/// Of a plugin the values alone are known.
#[test]
fn a_plugin_that_reads_the_time_is_sampled() {
    let file = rust_library("tests/faulty/pulse.rs", "pulse", &[]);
    let law = format!("plugin = '{}'", file.display());
    let scene = PULSE.replace("rates.c = \"step(t-50)*step(52-t)\"", &law);
    let made = |keys: &[&str]| {
        let keys: Vec<String> = keys.iter().map(|key| (*key).to_owned()).collect();
        let scene = Scene::parse(&scene, "scene.toml", &keys).unwrap();
        Simulation::new(&scene, &PluginSearch::in_directories(Vec::new())).unwrap()
    };
    for integrator in integrators() {
        let mut simulation = made(&[&format!("time.integrator={integrator}")]);
        ends(&mut simulation, 100.0);
        let c = simulation.state().species[0][0];
        assert!((c - 1.75).abs() < 1e-9, "{integrator}: {c}");
        let notes = simulation.notes().concat();
        assert!(notes.contains("sampled at 2049 times") && notes.contains("0.0488"), "{notes}");
    }
    // One that has no values later on is followed in short steps, and that is said.
    let mut simulation = made(&["kinetics.parameters.only=10.0", "time.until=9.0"]);
    assert!(simulation.notes().concat().contains("sampled"), "{:?}", simulation.notes());
    ends(&mut simulation, 9.0);
    let simulation = made(&["kinetics.parameters.only=10.0", "time.until=50.0"]);
    let notes = simulation.notes().concat();
    assert!(notes.contains("steps end at 100 equal parts"), "{notes}");
}

#[test]
fn check_lists_the_times_at_which_steps_end() {
    let out = check(PULSE);
    assert!(out.contains("steps end at t = 50, 52"), "{out}");
}

/// The chemistry of a sheet: which method suits it depends on how fast its reactions are for its span.
#[test]
fn check_measures_stiffness_and_says_what_to_use() {
    let scene = include_str!("../../models/kinetics/stiff-sheet.toml").replace("1000", "100");
    let at = |k: &str| check(&scene.replace("k = 100.0", &format!("k = {k}")));
    let (mild, stiff) = (at("100.0"), at("1e6"));
    assert!(
        mild.contains("chemistry = \"chebyshev\" (the default of staggered) suits it"),
        "{mild}"
    );
    assert!(
        stiff.contains("the reaction is stiff") && stiff.contains("chemistry = \"bdf\""),
        "{stiff}"
    );
    assert!(stiff.contains("up to 2.9e6") && stiff.contains("2.9e8"), "{stiff}");
    // A point has an implicit method by default.
    assert!(!check(PULSE).contains("stiff"), "{}", check(PULSE));
}
