//! Spontaneous curvature that follows the species, and growth along and across fibres by a law.

use rumple::Vec3;
use rumple::model::State;
use rumple::scene::Scene;

use super::{final_state, finished};
use crate::common::prepare;

/// A strip that nothing holds, with C₀ by `CURVED` of [kinetics] or of bending.
const STRIP: &str = r#"
sheet = { shape = "rectangle", width = 6.0, height = 1.0, vertices = 220, seed = 3 }
material = { young = 1e4, poisson = 0.0, thickness = 0.1, drag = 1e-4 }
effect = [{ kind = "stretching", model = "stvk" }, { kind = "bending" }]
equilibrium = { tolerance = 1e-11 }
[kinetics]
rates.c = "0"
initial.c = 2.5
[time]
policy = "quasi-static"
until = 0.5
"#;

const LAW: &str = "kinetics.curvature=\"0.1*c\"";
const FIELD: &str = "effect.bending.curvature=0.25";

fn largest(a: &State, b: &State) -> f64 {
    a.x.iter().zip(b.x.iter()).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// Of the distances of all vertices from three of them: rigid motions change none.
fn largest_difference_of_distances(a: &State, b: &State) -> f64 {
    let distances = |state: &State, i: usize| {
        let distance = |x: &Vec3| (x - state.x[i]).norm();
        state.x.iter().map(distance).collect::<Vec<_>>()
    };
    let vertices = [0, a.x.len() / 3, a.x.len() - 1];
    let pairs = vertices.map(|i| distances(a, i).into_iter().zip(distances(b, i)));
    pairs.into_iter().flatten().map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Curvature of the circle through three vertices along the strip: near its middle, and a quarter of it on either side.
fn rolled(state: &State, sheet: &rumple::sheet::Sheet) -> f64 {
    let middle = sheet.rest().iter().sum::<Vec3>() / rumple::num::real(sheet.vertex_count());
    let nearest = |dx: f64| {
        let at = middle + Vec3::new(dx, 0.0, 0.0);
        let distance = |v: &usize| (sheet.rest()[*v] - at).norm();
        let all = 0..sheet.vertex_count();
        state.x[all.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap()]
    };
    let [a, b, c] = [-1.5, 0.0, 1.5].map(nearest);
    let (u, v, w) = (b - a, c - b, c - a);
    2.0 * u.cross(&v).norm() / (u.norm() * v.norm() * w.norm())
}

#[test]
fn a_constant_species_bends_as_the_same_field_does() {
    for model in ["meyer", "hinge"] {
        for location in ["vertex", "face"] {
            let keys = [
                format!("effect.bending.model=\"{model}\""),
                format!("kinetics.location=\"{location}\""),
            ];
            let [law, field] = [LAW, FIELD].map(|key| {
                let keys: Vec<&str> = keys.iter().map(String::as_str).chain([key]).collect();
                finished(STRIP, &keys)
            });
            // Means over faces round: a strip that floats may be turned a little further then.
            let error = largest_difference_of_distances(law.state(), field.state());
            assert!(error < 1e-10, "{model}, {location}: {error:e}");
            // The rim carries no moments, so that a few edges across the radius is 1/C₀ roughly; R1 converges.
            let curvature = rolled(law.state(), law.model().sheet());
            assert!((curvature / 0.25 - 1.0).abs() < 0.2, "{model}: {curvature}");
        }
    }
}

/// Half of it from the law, half from the field; and on a rest shape that is curved.
#[test]
fn the_law_adds_to_the_field() {
    for rest in ["flat", "mesh"] {
        for model in ["meyer", "hinge"] {
            let keys = [
                format!("effect.bending.rest=\"{rest}\""),
                format!("effect.bending.model=\"{model}\""),
            ];
            let of = |more: &[&str]| {
                let keys: Vec<&str> =
                    keys.iter().map(String::as_str).chain(more.iter().copied()).collect();
                final_state(STRIP, &keys)
            };
            let both = of(&["kinetics.curvature=\"0.05*c\"", "effect.bending.curvature=0.125"]);
            let error = largest(&both, &of(&[FIELD]));
            assert!(error < 1e-10, "{rest}, {model}: {error:e}");
        }
    }
}

const MONOLITHIC: &str = "time.integrator={kind=\"monolithic\",method=\"bdf\",rtol=1e-3,atol=1e-3}";
const STAGGERED: &str = "time.integrator={kind=\"staggered\",rtol=1e-3,atol=1e-3}";

/// dc/dt = 5, so that C₀ = 0.25 at the end; under drag the strip lags behind.
#[test]
fn a_strip_rolls_up_as_the_species_grows() {
    let rest = finished(STRIP, &[FIELD]);
    let sheet = rest.model().sheet();
    let expected = rolled(rest.state(), sheet);
    let at = |policy: &str, integrator: &str| {
        let policy = format!("time.policy=\"{policy}\"");
        let grows = ["kinetics.rates.c=\"5\"", "kinetics.initial.c=0.0", LAW];
        let keys: Vec<&str> = grows.into_iter().chain([policy.as_str(), integrator]).collect();
        rolled(&final_state(STRIP, &keys), sheet)
    };
    for integrator in [MONOLITHIC, STAGGERED] {
        let found = at("quasi-static", integrator);
        assert!((found / expected - 1.0).abs() < 1e-3, "{integrator}: {found} {expected}");
    }
    let (one, other) = (at("simultaneous", MONOLITHIC), at("simultaneous", STAGGERED));
    assert!((one / other - 1.0).abs() < 2e-3, "{one} {other}");
    assert!(one < 0.99 * expected && one > 0.9 * expected, "{one} {expected}");
}

/// A species that reads the curvature that it makes, dc/dt = 2 - 4 H - c with C₀ = 0.1 c, has one steady state,
/// whatever the policy and the integrator.
#[test]
fn curvature_that_feeds_back_has_one_steady_state() {
    let closed = ["kinetics.rates.c=\"2 - 4*H - c\"", "kinetics.initial.c=0.0", LAW];
    let at = |policy: &str, integrator: &str| {
        let policy = format!("time.policy=\"{policy}\"");
        let more = ["time.until=12.0", "material.drag=1e-3", &policy, integrator];
        finished(STRIP, &closed.into_iter().chain(more).collect::<Vec<_>>())
    };
    let first = at("quasi-static", STAGGERED);
    let sheet = first.model().sheet();
    let expected = rolled(first.state(), sheet);
    assert!(expected > 0.1 && expected < 0.2, "{expected}");
    for (policy, integrator) in
        [("chemistry-fast", MONOLITHIC), ("chemistry-fast", STAGGERED), ("simultaneous", STAGGERED)]
    {
        let found = rolled(at(policy, integrator).state(), sheet);
        assert!(
            (found / expected - 1.0).abs() < 1e-3,
            "{policy}, {integrator}: {found} {expected}"
        );
    }
}

/// Growth by a law along and across a fibre, against the same by formulas.
const DISC: &str = r#"
sheet = { shape = "disc", radius = 4.0, vertices = 150, bump = { amplitude = 0.3, width = 2.0 } }
material = { young = 1e3, poisson = 0.3, thickness = 0.3 }
effect = [{ kind = "stretching", model = "stvk" }, { kind = "bending" }, GROWTH]
equilibrium = { tolerance = 1e-11 }
[kinetics]
rates = { c = "0", d = "0" }
initial = { c = 0.2, d = 0.1 }
[time]
until = 0.2
"#;

#[test]
fn a_law_grows_along_and_across_fibres_as_formulas_do() {
    let law = DISC.replace("GROWTH", "{ kind = \"directed-growth\", fibre = [1, \"x\", 0] }");
    let factors = ["kinetics.length_factor=\"1 + c\"", "kinetics.length_factor_across=\"1 - d\""];
    let formulas = DISC.replace(
        "GROWTH",
        "{ kind = \"growth\", fibre = [1, \"x\", 0], along = 1.2, across = 0.9 }",
    );
    let (law, formulas) = (final_state(&law, &factors), final_state(&formulas, &[]));
    let error = largest(&law, &formulas);
    assert!(error < 1e-9, "{error:e}");
}

fn refused(text: &str, keys: &[&str]) -> String {
    let keys: Vec<String> = keys.iter().map(|key| (*key).to_owned()).collect();
    let scene = Scene::parse(text, "scene.toml", &keys).unwrap();
    let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
    match rumple::Simulation::new(&scene, &search) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("it is accepted"),
    }
}

#[test]
fn what_has_no_meaning_is_refused_by_name() {
    let error = refused(STRIP, &[LAW, "effect.bending.weight=\"paper\""]);
    assert!(error.contains("effect[1].weight") && error.contains("as printed"), "{error}");
    let flows = ["effect.bending.model=\"hinge\"", "effect.bending.remodelling={time=1.0}", LAW];
    let error = refused(STRIP, &flows);
    assert!(error.contains("effect[1].remodelling"), "{error}");
    let across = ["kinetics.length_factor=\"1\"", "kinetics.length_factor_across=\"1 + c\""];
    let error = refused(STRIP, &across);
    assert!(error.contains("no effect gives the fibre"), "{error}");
    let both =
        DISC.replace("GROWTH", "{ kind = \"directed-growth\", fibre = [1, 0, 0], across = 0.5 }");
    let error = refused(&both, &across);
    assert!(error.contains("effect[2].across"), "{error}");
    // Nothing bends: it is said.
    let (_, flat) = prepare(STRIP, &[LAW]);
    assert!(flat.notes().iter().all(|note| !note.contains("spontaneous curvature")));
    let text = STRIP.replace(", { kind = \"bending\" }", "");
    let (_, flat) = prepare(&text, &[LAW]);
    let note = flat.notes().iter().find(|note| note.contains("spontaneous curvature"));
    assert!(note.is_some(), "{:?}", flat.notes());
}
