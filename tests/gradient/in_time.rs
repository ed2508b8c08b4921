//! Gradients of runs in time against central differences of their replays, with the same steps, and of whole runs.

use rumple::kinetics::PluginSearch;
use rumple::run::{Observer, StopRules};
use rumple::scene::Scene;
use rumple::study::gradient::{Objective, Place};
use rumple::{Simulation, model::State};

use super::{error, made};

fn in_time(scene: &str, measures: &[&str], numbers: &[&str], fields: &[&str]) -> Objective {
    made(scene, (measures, numbers, fields), Place::InTime(Vec::new()))
}

/// Chemistry on a fixed sheet, with a held boundary.
const FIXED: &str = r#"
sheet = { shape = "rectangle", width = 6.0, height = 4.0, vertices = 120 }
effect = [
    { kind = "diffusion", species = "u", coefficient = 0.4 },
    { kind = "hold", species = "u", where = "rim", value = 0.7 },
]
time = { until = 2.0, integrator = { kind = "staggered", rtol = 1e-4, atol = 1e-4 } }
[kinetics]
rates.u = "a - u + u^2*v"
rates.v = "b - u^2*v"
parameters = { a = 0.1, b = 0.9 }
initial.u = { formula = "0.7 + 0.2*exp(-x^2-y^2)" }
initial.v = 0.9
"#;

#[test]
fn chemistry_on_a_fixed_sheet_by_its_law_transport_start_and_boundary() {
    let numbers = [
        "kinetics.parameters.a",
        "kinetics.parameters.b",
        "effect.diffusion.coefficient",
        "effect.hold.value",
        "kinetics.initial.v",
    ];
    let measures = ["mean(u^2 + u*v)", "integral(0.1*x*v)"];
    let found = error(&mut in_time(FIXED, &measures, &numbers, &["kinetics.initial.u"]), 2e-3);
    assert!(found < 1e-7, "{found:e}");
}

#[test]
fn a_boundary_value_that_changes_in_time() {
    let waves = FIXED.replace("value = 0.7", "value = \"0.7 + 0.2*sin(3*t)\"");
    let numbers = ["kinetics.parameters.a", "effect.diffusion.coefficient"];
    let found = error(&mut in_time(&waves, &["mean(u^2 + u*v)"], &numbers, &[]), 2e-3);
    assert!(found < 1e-7, "{found:e}");
}

/// Shape and chemistry that do not rest.
const MOVING: &str = r#"
sheet = { shape = "sphere", radius = 5.0, vertices = 120 }
material = { young = 1e4, poisson = 0.3333333333333333, thickness = 0.3, drag = { per-area = 50.0 } }
effect = [
    { kind = "stretching" },
    { kind = "bending", rest = "mesh" },
    { kind = "diffusion", species = "c", coefficient = 0.5 },
    { kind = "pressure", value = 20.0, ramp = { formula = "1 + t" } },
]
time = { until = 0.6, policy = "quasi-static", integrator = { kind = "staggered", rtol = 1e-3, atol = 1e-3 } }
equilibrium = { tolerance = 1e-9 }
[kinetics]
rates.c = "k*(1 + 2*mean_curvature) - c"
parameters = { k = { formula = "0.3 + 0.02*z" }, b = 1.0 }
length_factor = "1 + 0.3*b*c"
species.c = { typical = 0.3 }
initial.c = 0.6
"#;

const OF_MOVING: [&str; 4] = [
    "kinetics.parameters.b",
    "effect.diffusion.coefficient",
    "material.thickness",
    "kinetics.initial.c",
];

#[test]
fn a_shape_in_equilibrium_with_species_that_evolve() {
    let measures = ["mean(c*c)", "0.001*volume"];
    let found =
        error(&mut in_time(MOVING, &measures, &OF_MOVING, &["kinetics.parameters.k"]), 2e-3);
    assert!(found < 1e-6, "{found:e}");
}

#[test]
fn a_shape_that_moves_under_drag_from_an_equilibrium_and_from_a_given_start() {
    let moving = MOVING.replace("quasi-static", "simultaneous");
    let measures = ["mean(c*c)", "0.001*volume"];
    let numbers = [&OF_MOVING[..], &["material.drag.per-area"]].concat();
    let found = error(&mut in_time(&moving, &measures, &numbers, &["kinetics.parameters.k"]), 2e-3);
    assert!(found < 1e-6, "{found:e}");
    let fast = moving.replace("simultaneous", "chemistry-fast");
    let mut objective = in_time(&fast, &measures, &numbers, &[]);
    let found = error(&mut objective, 2e-3);
    assert!(found < 1e-6, "{found:e}");
    // Its shape begins at the species of the scene, from which it moves on: the replay is the run.
    let short = fast.replace("until = 0.6", "until = 0.02");
    for scene in [&fast, &short] {
        let mut objective = in_time(scene, &["mean(sqrt(ux^2+uy^2+uz^2))"], &numbers[..1], &[]);
        let here = objective.evaluate(&objective.values()).unwrap();
        let doubts = here.course().unwrap().doubts(here.value);
        assert!(doubts.is_empty(), "{doubts:?}");
    }
    let given = moving.replace("until = 0.6", "until = 0.6, start = \"given\"");
    let found = error(&mut in_time(&given, &measures, &numbers, &[]), 2e-3);
    assert!(found < 1e-6, "{found:e}");
}

/// J of a whole run of the staggered integrator.
fn run(scene: &str, set: &str, of: fn(&Simulation, &State) -> f64) -> f64 {
    let scene = Scene::parse(scene, "scene.toml", &[set.to_owned()]).unwrap();
    let mut simulation = Simulation::new(&scene, &PluginSearch::from_environment(&[])).unwrap();
    simulation.prepare().unwrap();
    let mut rules = StopRules::new(&scene);
    while rules.stop(&mut simulation.evaluate()).unwrap().is_none() {
        simulation.step(scene.time.span.until.get()).unwrap();
    }
    of(&simulation, simulation.state())
}

#[test]
fn differences_of_whole_runs_at_a_tight_tolerance_agree() {
    let tight = MOVING.replace("1e-3, atol = 1e-3", "1e-5, atol = 1e-5");
    let volume = |s: &Simulation, at: &State| rumple::geometry::volume(s.sheet(), &at.x, at.x[0]);
    let at = |b: f64| run(&tight, &format!("kinetics.parameters.b={b}"), volume);
    let expected = (at(1.05) - at(0.95)) / 0.1;
    let mut objective = in_time(&tight, &["volume"], &["kinetics.parameters.b"], &[]);
    let mut here = objective.evaluate(&objective.values()).unwrap();
    let found = objective.gradient(&mut here).unwrap()[0][0];
    println!("{found} {expected} {:?} {}", here.course().unwrap().of_run(), here.value);
    assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
    assert!(here.course().unwrap().doubts(here.value).is_empty());
}

/// What the gradient of a scene by `key` is refused with.
fn refusal(scene: &str, key: &str) -> String {
    let mut objective = in_time(scene, &["mean(z)"], &[key], &[]);
    let values = objective.values();
    let done = objective.evaluate(&values).and_then(|mut here| objective.gradient(&mut here));
    done.err().map(|error| error.to_string()).unwrap_or_default()
}

#[test]
fn what_is_not_covered_is_refused() {
    let with = |effect: &str| MOVING.replace("effect = [", &format!("effect = [ {effect},"));
    let b = "kinetics.parameters.b";
    let said = refusal(&with("{ kind = \"volume\", stiffness = 10.0 }"), b);
    assert!(said.contains("couples vertices far apart"), "{said}");
    let said = refusal(&with("{ kind = \"contact\" }"), b);
    assert!(said.contains("contact"), "{said}");
    let jumps = FIXED.replace("value = 0.7", "value = \"0.7 + 0.2*step(t - 1)\"");
    let said = refusal(&jumps, "kinetics.parameters.a");
    assert!(said.contains("a value that is held jumps at t = 1"), "{said}");
    let later = FIXED.replace("\"a - u", "\"a*step(t - b) - u");
    assert_eq!(refusal(&later, "kinetics.parameters.a"), "");
    let said = refusal(&later, "kinetics.parameters.b");
    assert!(said.contains("kinetics.parameters.b: it moves a time"), "{said}");
}

#[test]
fn values_next_to_zero_have_derivatives() {
    let at = |b: f64| {
        let scene = FIXED
            .replace("\"a - u", "\"a + d*u - u")
            .replace("b = 0.9 }", &format!("b = 0.9, d = {b:e} }}"));
        let mut objective = in_time(&scene, &["mean(u^2)"], &["kinetics.parameters.d"], &[]);
        let mut here = objective.evaluate(&objective.values()).unwrap();
        objective.gradient(&mut here).unwrap()[0][0]
    };
    let exact = at(0.0);
    for tiny in [1e-16, 1e-12, -1e-9, 1e-6] {
        let found = at(tiny);
        assert!((found / exact - 1.0).abs() < 1e-5, "{tiny}: {found} {exact}");
    }
}

/// A species whose source ends where it reaches a level.
const JUMPING: &str = r#"
sheet = { shape = "disc", radius = 5.0, vertices = 30 }
effect = [{ kind = "diffusion", species = "u", coefficient = 0.5 }]
time = { until = 2.0, integrator = "monolithic" }
[kinetics]
rates.u = "a*step(b - u) + 0.3"
parameters = { a = 1.0, b = 0.8 }
initial.u = { formula = "0.2 + 0.02*x" }
"#;

#[test]
fn a_law_that_jumps_is_doubted_and_a_smooth_one_is_not() {
    let doubt = |scene: &str| {
        let mut objective =
            in_time(scene, &["mean(u)"], &["kinetics.parameters.a", "kinetics.parameters.b"], &[]);
        let mut here = objective.evaluate(&objective.values()).unwrap();
        let gradient = objective.gradient(&mut here).unwrap();
        objective.check_by_replay(&here, &gradient).unwrap()
    };
    assert_eq!(doubt(FIXED), None);
    let said = doubt(JUMPING).unwrap_or_default();
    assert!(said.contains("Does the law jump"), "{said}");
}
