//! Spontaneous curvature and the length factor across a fibre through the boundary, and of several laws.

use rumple::kinetics::formula::{FormulaKinetics, Law};
use rumple::kinetics::{Batch, Column, Feedback, Kinetics, Library, Location, PluginSearch, field};
use rumple::run;
use rumple::scene::Scene;

use super::build::{c_library, directory, map, rust_library};

const C: [f64; 3] = [0.5, -1.0, 2.0];
const D: [f64; 3] = [1.5, 0.25, -0.5];

/// Values and both partial derivatives.
fn given(law: &dyn Kinetics, which: Feedback) -> [Vec<f64>; 3] {
    given_with(law, which, &[])
}

fn given_with(law: &dyn Kinetics, which: Feedback, parameters: &[Column<'_>]) -> [Vec<f64>; 3] {
    let species = [C.as_slice().into(), D.as_slice().into()];
    let (location, signals) = (Location::Vertex, &[]);
    let batch = Batch { location, first: 0, count: 3, species: &species, signals, parameters };
    let mut alone = vec![0.0; 3];
    field::evaluate(law, which.into(), &batch, &mut [&mut alone], &mut []).unwrap();
    let [mut values, mut by_c, mut by_d] = [0; 3].map(|_| vec![0.0; 3]);
    field::evaluate(law, which.into(), &batch, &mut [&mut values], &mut [&mut by_c, &mut by_d])
        .unwrap();
    assert_eq!(alone, values);
    [values, by_c, by_d]
}

/// The same law as text.
fn text(across: bool) -> FormulaKinetics {
    let law = Law::named("rolling")
        .parameter("k", 2.0)
        .species("c", "1")
        .species("d", "-d")
        .length_factor("1 + 0.1*c")
        .feedback(Feedback::Curvature, "k*c*d");
    let law = if across { law.feedback(Feedback::FactorAcross, "1 + 0.2*d^2") } else { law };
    FormulaKinetics::new(&law).unwrap()
}

fn close(a: &[Vec<f64>; 3], b: &[Vec<f64>; 3], tolerance: f64) {
    for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
        assert!((a - b).abs() <= tolerance * b.abs().max(1.0), "{a:e} {b:e}");
    }
}

#[test]
fn plugins_give_spontaneous_curvature_and_a_factor_across_as_text_does() {
    let path = rust_library("tests/faulty/rolling.rs", "rolling-across", &["across"]);
    let here = Library::load(&path).unwrap().instantiate(&map(&[("k", 2.0)])).unwrap();
    let text = text(true);
    let varying = [1.0, 2.0, 3.0];
    for which in Feedback::ALL {
        let expected = given(&text, which);
        close(&given(&here, which), &expected, 1e-15);
    }
    let scaled = &given_with(&here, Feedback::Curvature, &[varying.as_slice().into()])[0];
    let expected: Vec<f64> = (0..3).map(|k| varying[k] * C[k] * D[k]).collect();
    assert_eq!(scaled, &expected);
    // Without the trait the factor across is absent, and not evaluated.
    let path = rust_library("tests/faulty/rolling.rs", "rolling", &[]);
    let plain = Library::load(&path).unwrap();
    let capabilities = plain.descriptor().capabilities;
    assert!(capabilities.curvature && !capabilities.length_factor_across);
    let plain = plain.instantiate(&map(&[])).unwrap();
    assert_eq!(given(&plain, Feedback::FactorAcross), [vec![1.0; 3], vec![0.0; 3], vec![0.0; 3]]);
}

#[test]
fn a_c_plugin_may_leave_the_derivatives_out() {
    let path = c_library("tests/faulty/rolling.c", "rolling-c", &[]);
    let law = Library::load(&path).unwrap().instantiate(&map(&[])).unwrap();
    let by_differences = given(&law, Feedback::Curvature);
    let text = text(false);
    let expected =
        given(&text, Feedback::Curvature).map(|all| all.iter().map(|v| v / 4.0).collect());
    close(&by_differences, &expected, 1e-9);
    for (definition, message) in [
        ("NO_EXTENSION", "extension `rumple.feedback/1`: is missing"),
        ("NO_FUNCTION", "its function `curvature` is null"),
        ("TRUNCATED", "is truncated"),
        ("ACROSS_ALONE", "a length factor across a fibre without one along it"),
        ("STATEFUL", "state of instances"),
    ] {
        let path = c_library("tests/faulty/rolling.c", definition, &[definition]);
        let error = Library::load(&path).unwrap_err().to_string();
        assert!(error.contains(message.trim_start_matches("extension ")), "{definition}: {error}");
    }
}

const TWO: &str = r#"
sheet = { shape = "point" }
time = { until = 1.0, integrator = { kind = "monolithic" } }
[[kinetics]]
rates.c = "1"
length_factor = "1"
length_factor_across = "1 + 0.1*c"
curvature = "2*c"
[[kinetics]]
rates = { c = "0", d = "-d" }
shared = ["c"]
length_factor = "1 + d^2"
length_factor_across = "1 + 0.2*c*d"
curvature = "c*d"
"#;

fn law(text: &str) -> Result<std::sync::Arc<dyn Kinetics>, String> {
    let scene = Scene::parse(text, "scene.toml", &[]).map_err(|e| e.to_string())?;
    let search = PluginSearch::in_directories(vec![directory().to_owned()]);
    let laws = run::laws::load(&scene, &search, &mut Vec::new()).map_err(|e| e.to_string())?;
    Ok(laws.unwrap().kinetics)
}

#[test]
fn curvatures_of_several_laws_add_and_factors_multiply() {
    let joint = law(TWO).unwrap();
    let one = Law::named("one")
        .species("c", "1")
        .species("d", "-d")
        .length_factor("1 + d^2")
        .feedback(Feedback::Curvature, "2*c + c*d")
        .feedback(Feedback::FactorAcross, "(1 + 0.1*c)*(1 + 0.2*c*d)");
    let one = FormulaKinetics::new(&one).unwrap();
    for which in Feedback::ALL {
        close(&given(&*joint, which), &given(&one, which), 1e-14);
    }
    let without = TWO.replace("length_factor_across = \"1 + 0.2*c*d\"\n", "");
    let error = law(&without).unwrap_err();
    assert!(error.contains("kinetics[1]") && error.contains("across the fibre"), "{error}");
}

#[test]
fn wrong_formulas_are_refused_at_their_keys() {
    let scene = |more: &str| {
        format!(
            "sheet = {{ shape = 'point' }}\ntime = {{ until = 1.0 }}\n[kinetics]\nrates.c = 'k*c'\n\
             parameters.k = 1\n{more}\n"
        )
    };
    for (more, messages) in [
        ("curvature = 'H'", ["kinetics.curvature", "reads the signal mean_curvature"]),
        ("curvature = 'a*c'", ["kinetics.curvature", "unknown name `a`"]),
        ("length_factor_across = '1 + c'", ["kinetics.length_factor_across", "along it"]),
    ] {
        let error = law(&scene(more)).unwrap_err();
        assert!(messages.iter().all(|m| error.contains(m)), "{error}");
    }
    let text = scene("").replace("rates.c = 'k*c'", "plugin = 'x'") + "curvature = '1'";
    let error = law(&text).unwrap_err();
    assert!(
        error.contains("kinetics.curvature") && error.contains("plugin has its own"),
        "{error}"
    );
}
