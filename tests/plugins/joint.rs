//! Several laws in one scene: side by side, one reading the other's species.

use rumple::kinetics::{Kinetics, PluginSearch};
use rumple::run;
use rumple::scene::Scene;

use super::build;
use crate::common::prepare;

const POINT: &str = r#"
[sheet]
shape = "point"

LAWS

[time]
policy = "quasi-static"
integrator = { kind = "monolithic", method = "bdf", rtol = 1e-8, atol = 1e-10 }
until = 2.0
"#;

/// A law in two tables, the second reading the first one's `u` and adding to it.
const TWO: &str = r#"
[[kinetics]]
rates.u = "k - u"
length_factor = "1 + 0.1*u"
observables.flux = "k*u"
parameters = { k = 2.0 }
initial.u = 0.5

[[kinetics]]
rates = { v = "u^2 - k*v", u = "-0.25*v" }
length_factor = "1 - 0.2*v*u"
shared = ["u"]
parameters = { k = 3.0 }
initial.v = 0.25
"#;

const ONE: &str = r#"
[kinetics]
rates = { u = "k - u - 0.25*v", v = "u^2 - 3*v" }
length_factor = "(1 + 0.1*u)*(1 - 0.2*v*u)"
observables.flux = "k*u"
parameters = { k = 2.0 }
initial = { u = 0.5, v = 0.25 }
"#;

fn law(laws: &str) -> std::sync::Arc<dyn Kinetics> {
    let scene = Scene::parse(&POINT.replace("LAWS", laws), "scene.toml", &[]).unwrap();
    let search = PluginSearch::in_directories(vec![build::directory().to_owned()]);
    let laws = run::laws::load(&scene, &search, &mut Vec::new());
    laws.unwrap_or_else(|e| panic!("{e}")).unwrap().kinetics
}

#[test]
fn two_laws_that_share_a_species_are_the_law_of_both() {
    use rumple::kinetics::{Batch, Feedback, Location, Quantity, field};
    let (two, one) = (law(TWO), law(ONE));
    assert_eq!(two.descriptor().observables, one.descriptor().observables);
    let (u, v) = (vec![0.3, 1.0, 2.5, 0.0], vec![0.1, 0.7, 0.2, 1.0]);
    let species = [(&u).into(), (&v).into()];
    let evaluate = |law: &dyn Kinetics| {
        let names: Vec<_> = law.descriptor().species.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, ["u", "v"]);
        let batch = Batch {
            location: Location::Vertex,
            first: 0,
            count: 4,
            species: &species,
            signals: &[],
            parameters: &[],
        };
        let mut rates = field::Columns::new(2, 4);
        let mut partials = field::Columns::new(4, 4);
        field::evaluate(
            law,
            Quantity::Rates,
            &batch,
            &mut rates.slices_mut(),
            &mut partials.slices_mut(),
        )
        .unwrap();
        let mut alone = field::Columns::new(2, 4);
        field::evaluate(law, Quantity::Rates, &batch, &mut alone.slices_mut(), &mut []).unwrap();
        assert_eq!(alone, rates);
        let (mut factor, mut slopes) = (vec![0.0; 4], field::Columns::new(2, 4));
        field::evaluate(
            law,
            Feedback::LengthFactor.into(),
            &batch,
            &mut [&mut factor],
            &mut slopes.slices_mut(),
        )
        .unwrap();
        let mut flux = vec![0.0; 4];
        field::evaluate(law, Quantity::Observables, &batch, &mut [&mut flux], &mut []).unwrap();
        [rates.into_inner(), partials.into_inner(), factor, slopes.into_inner(), flux].concat()
    };
    for (two, one) in evaluate(&*two).iter().zip(evaluate(&*one)) {
        assert!((two - one).abs() < 1e-14, "{two} {one}");
    }
}

#[test]
fn plugins_side_by_side_do_what_each_does_alone() {
    // Two Schnakenberg laws, the second under other names and at another pace.
    let both = r#"
[[kinetics]]
plugin = "schnakenberg"
initial = { u = 1.2, v = 0.5 }

[[kinetics]]
plugin = "schnakenberg"
rename = { u = "p", v = "q" }
parameters = { gamma = 3.0 }
initial = { p = 1.2, q = 0.5 }
"#;
    let alone = |gamma: f64| {
        format!(
            "[kinetics]\nplugin = \"schnakenberg\"\nparameters.gamma = {gamma:?}\n\
             initial = {{ u = 1.2, v = 0.5 }}\n"
        )
    };
    let last = |laws: &str| {
        let (_, mut simulation) = prepare(&POINT.replace("LAWS", laws), &[]);
        // Explicit Euler is enough to compare the same law with itself.
        for _ in 0..100 {
            let rates = simulation.evaluate().rates().unwrap().to_vec();
            for (c, rate) in simulation.state_mut().species.iter_mut().zip(&rates) {
                c[0] += 0.01 * rate[0];
            }
        }
        simulation.state().species.iter().map(|c| c[0]).collect::<Vec<f64>>()
    };
    assert_eq!(last(both), [last(&alone(1.0)), last(&alone(3.0))].concat());
}

#[test]
fn names_that_clash_or_lead_nowhere_are_refused_with_the_way_out() {
    let refusal = |laws: &str| {
        let scene = Scene::parse(&POINT.replace("LAWS", laws), "scene.toml", &[]);
        let scene = match scene {
            Ok(scene) => scene,
            Err(error) => return error.rendered(false),
        };
        let search = PluginSearch::in_directories(vec![build::directory().to_owned()]);
        match rumple::Simulation::new(&scene, &search) {
            Ok(_) => panic!("{laws}"),
            Err(rumple::Error::Scene(error)) => error.rendered(false),
            Err(other) => other.to_string(),
        }
    };
    let clash = TWO.replace("shared = [\"u\"]\n", "");
    let text = refusal(&clash);
    assert!(text.contains("kinetics[1]") && text.contains("shared = [\"u\"]"), "{text}");
    let text = refusal(&TWO.replace("shared = [\"u\"]", "shared = [\"w\"]"));
    assert!(text.contains("kinetics[1]"), "{text}");
    let renamed = "[[kinetics]]\nplugin = \"schnakenberg\"\nrename = { w = \"p\" }\n";
    let text = refusal(renamed);
    assert!(text.contains("has no `w`; it has u, v"), "{text}");
    let twice = TWO.replace("initial.v = 0.25", "initial = { v = 0.25, u = 1.0 }");
    let text = refusal(&twice);
    assert!(text.contains("kinetics[1].initial.u"), "{text}");
    let elsewhere = TWO.replace("initial.v = 0.25", "initial.v = 0.25\nlocation = \"face\"");
    let text = refusal(&elsewhere);
    assert!(text.contains("the same for all laws"), "{text}");
    let wrong = TWO.replace("u^2 - k*v", "u^2 - kk*v");
    let text = refusal(&wrong);
    assert!(text.contains("kinetics[1].rates.v") && text.contains("unknown name `kk`"), "{text}");
}

#[test]
fn a_scene_with_several_laws_is_written_out_as_it_was() {
    let text = POINT.replace("LAWS", TWO);
    let scene = Scene::parse(&text, "scene.toml", &[]).unwrap();
    let resolved = scene.resolved().unwrap();
    let again = Scene::parse(&resolved, "resolved.toml", &[]).unwrap();
    assert_eq!(scene.kinetics, again.kinetics);
    assert_eq!(scene.kinetics.len(), 2);
}
