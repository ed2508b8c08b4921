//! Parameters that differ from place to place, in text, in Rust and in C; and observables.

use std::fs;
use std::process::Command;
use std::sync::Arc;

use rumple::Simulation;
use rumple::kinetics::PluginSearch;
use rumple::model::EvaluationBuffers;
use rumple::scene::Scene;

use super::build::{self, c_library};
use crate::common::prepare;
use crate::run::program;

/// On a flat sheet the curvature vanishes and Model I is dc/dt = -beta c.
const SCENE: &str = r#"
[sheet]
shape = "disc"
radius = 10.0
vertices = 400

[kinetics]
LAW
initial.c = { formula = "1 + 0.5*x/10" }

[time]
policy = "quasi-static"
integrator = { kind = "monolithic", method = "bdf", rtol = 1e-8 }
until = 1.0

[output]
every = 1.0
fields = ["c"]
"#;

const BETA: &str = r#"parameters.beta = { formula = "1 + step(x) + 0.01*y" }"#;

fn rates(law: &str) -> (Vec<f64>, Vec<f64>) {
    let (_, mut simulation) = prepare(&SCENE.replace("LAW", law), &[]);
    let rates = simulation.evaluate().rates().unwrap()[0].clone();
    let exact = |x: &rumple::Vec3| {
        let beta = 1.0 + f64::from(x.x > 0.0) + 0.01 * x.y;
        -beta * (1.0 + 0.05 * x.x)
    };
    (rates, simulation.sheet().rest().iter().map(exact).collect())
}

#[test]
fn a_formula_of_position_is_a_parameter_in_every_kind_of_law() {
    let c = c_library("tests/plugins/model_i.c", "model_i_fields", &["WITH_PARTIALS"]);
    let laws = [
        format!("plugin = \"curvature-feedback\"\n{BETA}"),
        format!("plugin = \"{}\"\n{BETA}", c.display()),
        format!("rates.c = \"-beta*c\"\n{BETA}"),
        // Through the joint law as well.
        format!("plugin = \"curvature-feedback\"\nrename.production = \"made\"\n{BETA}"),
    ];
    for law in laws {
        let (rates, exact) = rates(&law);
        for (rate, exact) in rates.iter().zip(exact) {
            assert!((rate - exact).abs() < 1e-13, "{law}: {rate} {exact}");
        }
    }
}

#[test]
fn length_factors_see_the_parameters_at_edges() {
    let law = "plugin = \"tension-feedback\"\nparameters.alpha = { formula = \"0.2 + 0.01*x\" }";
    let text = SCENE
        .replace("LAW", law)
        .replace("initial.c = { formula = \"1 + 0.5*x/10\" }", "initial.m = 0.5")
        .replace("fields = [\"c\"]", "")
        .replace(
            "[kinetics]",
            "[material]\nyoung = 1e6\npoisson = 0.3\nthickness = 0.5\n\n[kinetics]",
        );
    let (_, simulation) = prepare(&text, &[]);
    let (model, state) = (simulation.model(), simulation.state());
    let (sheet, chemistry) = (model.sheet(), model.chemistry().unwrap());
    let mut memory = EvaluationBuffers::default();
    let mut at = model.at(state, &mut memory);
    let surface = at.surface();
    let factor = chemistry.length_factor(sheet, surface, &state.species).unwrap().unwrap();
    let slopes = chemistry.length_factor_slopes(sheet, surface, &state.species).unwrap().unwrap();
    for (e, edge) in sheet.edges().iter().enumerate() {
        let [a, b] = edge.vertices.map(|v| sheet.rest()[v as usize].x);
        let alpha = 0.2 + 0.01 * 0.5 * (a + b);
        assert!((factor[e] - (1.0 - 0.5 * alpha)).abs() < 1e-14);
        assert!((slopes[0][e] + alpha).abs() < 1e-14);
    }
}

#[test]
fn an_array_of_a_file_is_a_parameter() {
    let place = tempfile::tempdir().unwrap();
    let run = |scene: &str, out: &str| {
        fs::write(place.path().join("scene.toml"), scene).unwrap();
        let out = Command::new(program())
            .current_dir(place.path())
            .env("RUMPLE_PLUGIN_PATH", build::directory())
            .args(["run", "scene.toml", "--out", out])
            .output()
            .unwrap();
        (out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let first = SCENE.replace("LAW", "plugin = \"curvature-feedback\"");
    assert_eq!(run(&first, "first").0, Some(0));
    // The first run's start, 1 + x/20, is the second one's decay.
    let from = |array: &str| {
        format!(
            "plugin = \"curvature-feedback\"\nparameters.beta = {{ file = \
             \"first/frames/frame_000000.vtu\", array = \"{array}\" }}"
        )
    };
    fs::write(place.path().join("scene.toml"), SCENE.replace("LAW", &from("c"))).unwrap();
    let scene = Scene::load(&place.path().join("scene.toml"), &[]).unwrap();
    let search = PluginSearch::in_directories(vec![build::directory().to_owned()]);
    let mut simulation = Simulation::new(&scene, &search).unwrap();
    let rates = simulation.evaluate().rates().unwrap()[0].clone();
    for (rate, x) in rates.iter().zip(simulation.sheet().rest()) {
        let c = 1.0 + 0.05 * x.x;
        assert!((rate + c * c).abs() < 1e-12, "{rate} {c}");
    }
    let (code, text) = run(&SCENE.replace("LAW", &from("d")), "none");
    assert_eq!(code, Some(2));
    assert!(text.contains("unknown array \"d\"") && text.contains("did you mean c"), "{text}");
}

#[test]
fn fields_that_cannot_be_are_refused_with_place_and_point() {
    let refusal = |law: &str| {
        let scene = match Scene::parse(&SCENE.replace("LAW", law), "scene.toml", &[]) {
            Ok(scene) => scene,
            Err(error) => return error.rendered(false),
        };
        let search = PluginSearch::in_directories(vec![build::directory().to_owned()]);
        match Simulation::new(&scene, &search) {
            Err(rumple::Error::Scene(error)) => error.rendered(false),
            Err(other) => other.to_string(),
            Ok(_) => panic!("{law}"),
        }
    };
    let of = |beta: &str| refusal(&format!("plugin = \"curvature-feedback\"\nparameters.{beta}"));
    let text = of("beta = { formula = \"x\" }");
    assert!(text.contains("kinetics.parameters.beta") && text.contains("at vertex"), "{text}");
    assert!(text.contains("beta") && text.contains("0 <= beta"), "{text}");
    let text = of("beta = { formula = \"1 + t\" }");
    assert!(text.contains("unknown name `t`") && text.contains("x, y, z"), "{text}");
    let text = of("betta = { formula = \"1\" }");
    assert!(text.contains("did you mean `beta`"), "{text}");
    let text = of("beta = { formel = \"1\" }");
    assert!(text.contains("formel") && text.contains("formula"), "{text}");
    let text = of("beta = \"1\"");
    assert!(text.contains("{ formula ="), "{text}");
}

#[test]
fn a_parameter_that_no_formula_mentions_is_told() {
    let law = "rates.c = \"-beta*c\"\nparameters = { beta = 1.0, betta = 2.0 }";
    let (_, simulation) = prepare(&SCENE.replace("LAW", law), &[]);
    assert_eq!(simulation.notes(), ["no formula of kinetics reads its parameter `betta`"]);
}

#[test]
fn observables_are_fields_of_frames_and_the_same_in_text_rust_and_c() {
    let text = "rates.c = \"made - beta*c\"\nlet.made = \"15*pos(H)/(1 + pos(H)/0.05)\"\n\
                observables.production = \"made\"\nunits.production = \"1/time\"\n\
                parameters = { beta = 1.0 }";
    let observed = |law: &str| {
        let scene = SCENE
            .replace("LAW", law)
            .replace(
                "vertices = 400",
                "vertices = 400\nbump = { centre = [0, 0, 0], width = 3.0, amplitude = 1.0 }",
            )
            .replace("fields = [\"c\"]", "fields = [\"c\", \"production\"]");
        let (_, mut simulation) = prepare(&scene, &[]);
        let frame = simulation.frame().unwrap();
        let found = frame.point.iter().find(|f| f.name == "production [1/time]").unwrap();
        found.data.to_vec()
    };
    let c = c_library("tests/plugins/model_i.c", "model_i_observed", &["WITH_PARTIALS"]);
    let c = observed(&format!("plugin = \"{}\"", c.display()));
    let (rust, text) = (observed("plugin = \"curvature-feedback\""), observed(text));
    assert!(rust.iter().fold(0.0_f64, |m, p| m.max(*p)) > 0.1);
    for ((rust, text), c) in rust.iter().zip(text).zip(c) {
        assert!((rust - text).abs() < 1e-13 && (rust - c).abs() < 1e-13, "{rust} {text} {c}");
    }
}

/// Signals that only observables read are no inputs of the rates, and those of several laws find
/// their columns.
#[test]
fn what_observables_read_is_computed_for_them_alone() {
    let laws = "[[kinetics]]\nrates.c = \"H*0.1 - c\"\nobservables.both = \"H + 2*K\"\n\
                initial.c = 1.0\n\
                [[kinetics]]\nrates.d = \"K - d\"\nobservables.bent = \"J + K + d\"\n";
    let text = SCENE
        .replace("[kinetics]\nLAW\ninitial.c = { formula = \"1 + 0.5*x/10\" }\n", laws)
        .replace("shape = \"disc\"\nradius = 10.0", "shape = \"sphere\"\nradius = 2.0");
    let asked =
        r#"fields = ["both", "bent", "mean_curvature", "gaussian_curvature", "area_ratio"]"#;
    let (_, mut simulation) = prepare(&text.replace("fields = [\"c\"]", asked), &[]);
    let model = Arc::clone(simulation.model());
    let d = model.chemistry().unwrap().descriptor();
    let names = |read: &[rumple::kinetics::SignalRead]| -> Vec<&str> {
        read.iter().map(|read| read.signal.name()).collect()
    };
    assert_eq!(names(&d.signals), ["mean_curvature", "gaussian_curvature"]);
    assert_eq!(names(&d.observed), ["mean_curvature", "gaussian_curvature", "area_ratio"]);

    let frame = simulation.frame().unwrap();
    let field = |name: &str| {
        let found = frame.point.iter().find(|f| f.name.split(' ').next() == Some(name));
        found.unwrap().data.clone()
    };
    let (h, k, j) = (field("mean_curvature"), field("gaussian_curvature"), field("area_ratio"));
    for (i, (both, bent)) in field("both").iter().zip(&*field("bent")).enumerate() {
        assert!((both - h[i] - 2.0 * k[i]).abs() < 1e-12, "{i}");
        assert!((bent - j[i] - k[i]).abs() < 1e-12, "{i}");
    }

    // Not asked for, they cost nothing.
    let (_, simulation) = prepare(&text.replace("fields = [\"c\"]", ""), &[]);
    let wanted = simulation.model().chemistry().unwrap().signals().wanted().to_vec();
    assert!(!wanted.contains(&rumple::kinetics::Signal::AreaRatio));
}
