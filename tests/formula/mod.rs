//! Laws written as text: values, derivatives, errors, and the shipped models as formulas.

mod edges;

use proptest::prelude::*;
use rumple::kinetics::descriptor;
use rumple::kinetics::formula::{Formula, FormulaIndex, FormulaKinetics, Law, LawError};
use rumple::kinetics::{Batch, Column, Feedback, Kinetics, Location, Parameter, Quantity, Species};
use rumple::scene::Scene;

use crate::common::{Noise, prepare, root};
use crate::plugins::build;

fn species(name: &str) -> Species {
    Species {
        name: name.into(),
        unit: "1".into(),
        doc: String::new(),
        typical: Some(1.0),
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        diffusion: 0.0,
        location: Location::Vertex,
    }
}

fn parameter(name: &str) -> Parameter {
    Parameter {
        name: name.into(),
        unit: "1".into(),
        doc: String::new(),
        default: descriptor::Default::Value(0.0),
        lower: f64::NEG_INFINITY,
        lower_open: false,
        upper: f64::INFINITY,
        upper_open: false,
    }
}

/// Species u and v, parameters k = 2 and n = 2.5, one rate.
fn law(rate: &str) -> Law {
    Law {
        name: "test".into(),
        species: vec![species("u"), species("v")],
        parameters: vec![parameter("k"), parameter("n")],
        values: vec![Some(2.0), Some(2.5)],
        lets: Vec::new(),
        rates: vec![Formula { name: "u".into(), text: rate.into() }],
        feedback: Vec::new(),
        observables: Vec::new(),
    }
}

fn made(rate: &str) -> FormulaKinetics {
    FormulaKinetics::new(&law(rate)).unwrap_or_else(|e| panic!("{rate}: {e:?}"))
}

/// Rates and partial derivatives at points given by columns of inputs.
fn evaluate(kinetics: &dyn Kinetics, inputs: &[Vec<f64>]) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let count = inputs[0].len();
    let d = kinetics.descriptor();
    let columns: Vec<Column<'_>> = inputs.iter().map(Into::into).collect();
    let (species, signals) = columns.split_at(d.species.len());
    let batch =
        Batch { location: Location::Vertex, first: 0, count, species, signals, parameters: &[] };
    let mut rates = vec![vec![0.0; count]; d.species.len()];
    let mut partials = vec![vec![0.0; count]; d.species.len() * d.inputs()];
    let mut out: Vec<&mut [f64]> = rates.iter_mut().map(Vec::as_mut_slice).collect();
    let mut slopes: Vec<&mut [f64]> = partials.iter_mut().map(Vec::as_mut_slice).collect();
    kinetics.evaluate(Quantity::Rates, &batch, &mut out, &mut slopes).unwrap();
    let mut alone = rates.clone();
    let mut out: Vec<&mut [f64]> = alone.iter_mut().map(Vec::as_mut_slice).collect();
    kinetics.evaluate(Quantity::Rates, &batch, &mut out, &mut []).unwrap();
    let bits = |all: &[Vec<f64>]| -> Vec<u64> {
        let values = all.iter().flatten();
        values.map(|value| if value.is_nan() { 0 } else { value.to_bits() }).collect()
    };
    assert!(bits(&alone) == bits(&rates), "with and without derivatives");
    (rates, partials)
}

type Value = fn(f64, f64) -> f64;

const FORMULAS: [(&str, Value); 22] = [
    ("u + 2*v - 1.5e-1", |u, v| u + 2.0 * v - 0.15),
    ("-u^2", |u, _| -(u * u)),
    ("2^3^v", |_, v| 2f64.powf(3f64.powf(v))),
    ("u - v - 1", |u, v| u - v - 1.0),
    ("u/v/2", |u, v| u / v / 2.0),
    ("u**3 + u^-2", |u, _| u.powi(3) + u.powi(-2)),
    ("k*exp(-u)*log(v)", |u, v| 2.0 * (-u).exp() * v.ln()),
    ("sqrt(u*v) + tanh(u)", |u, v| (u * v).sqrt() + u.tanh()),
    ("sin(u)*cos(v)", |u, v| u.sin() * v.cos()),
    ("abs(u - v)", |u, v| (u - v).abs()),
    ("pos(u - 1)*step(v - 1)", |u, v| (u - 1.0).max(0.0) * f64::from(v > 1.0)),
    ("min(u, v) + 3*max(u*v, 1)", |u, v| u.min(v) + 3.0 * (u * v).max(1.0)),
    ("hill(u, k, n)", |u, _| u.powf(2.5) / (2f64.powf(2.5) + u.powf(2.5))),
    ("logistic(k*(u - v))", |u, v| 1.0 / (1.0 + (-2.0 * (u - v)).exp())),
    ("u^n + u^v", |u, v| u.powf(2.5) + u.powf(v)),
    ("(u)", |u, _| u),
    ("0*u + 1*v + 0/u", |_, v| v),
    ("pi*u", |u, _| std::f64::consts::PI * u),
    ("- - u", |u, _| u),
    ("1/(1/u)", |u, _| u),
    ("u*u*u/(1 + u*u*u)", |u, _| u * u * u / (1.0 + u * u * u)),
    (".5*u + 1.", |u, _| 0.5 * u + 1.0),
];

#[test]
fn formulas_mean_what_they_say_and_so_do_their_derivatives() {
    let mut noise = Noise::new(3);
    // More than a block of points, and not a multiple of it.
    let points: Vec<(f64, f64)> =
        (0..700).map(|_| (1.05 + 0.9 * noise.number(), 1.1 + 0.9 * noise.number())).collect();
    let columns = |shift: (f64, f64)| {
        let u = points.iter().map(|p| p.0 + shift.0).collect();
        let v = points.iter().map(|p| p.1 + shift.1).collect();
        vec![u, v]
    };
    for (text, value) in FORMULAS {
        let kinetics = made(text);
        let (rates, partials) = evaluate(&kinetics, &columns((0.0, 0.0)));
        for (k, &(u, v)) in points.iter().enumerate() {
            let expected = value(u, v);
            let found = rates[0][k];
            assert!((found - expected).abs() <= 1e-13 * (1.0 + expected.abs()), "{text} {u} {v}");
            assert_eq!(rates[1][k], 0.0);
        }
        let h = 1e-5;
        for (input, shift) in [(0, (h, 0.0)), (1, (0.0, h))] {
            for (k, &(u, v)) in points.iter().enumerate() {
                let near = (u - 1.0).abs() < 2.0 * h
                    || (v - 1.0).abs() < 2.0 * h
                    || (u - v).abs() < 2.0 * h
                    || (u * v - 1.0).abs() < 4.0 * h;
                if near {
                    continue;
                }
                let by_difference =
                    (value(u + shift.0, v + shift.1) - value(u - shift.0, v - shift.1)) / (2.0 * h);
                let found = partials[input][k];
                let size = 1.0 + by_difference.abs();
                assert!(
                    (found - by_difference).abs() < 1e-6 * size,
                    "{text} by {input} at {u} {v}: {found} {by_difference}"
                );
            }
        }
    }
}

#[test]
fn nothing_is_computed_twice_or_for_nothing() {
    assert_eq!(made("0*exp(u) + v").operations().0, 0);
    assert_eq!(made("exp(u*v) + exp(v*u)").operations().0, 3);
    // Constants are folded: a product and a difference are left.
    assert_eq!(made("(k + 1)^2*u - log(1)").operations().0, 1);
}

#[test]
fn errors_point_to_the_place() {
    let cases: [(&str, &str, &str); 18] = [
        ("u + w", "w", "unknown name `w`"),
        ("u + mean_curvatur", "mean_curvatur", "unknown name `mean_curvatur`"),
        ("expp(u)", "expp", "unknown function `expp`"),
        ("2 u", "u", "an operator is missing"),
        ("(u + v", "(", "not closed"),
        ("u + v)", ")", "unmatched closing"),
        ("u +", "", "ends too early"),
        ("u * / v", "/", "belongs here, not `/`"),
        ("min(u)", "min(u)", "takes 2 argument(s), not 1"),
        ("u ? v", "?", "unexpected character"),
        ("v*(u > 1)", ">", "unexpected character"),
        ("np.sin(u)", ".", "unexpected character"),
        ("1.2.3*u", "1.2.3", "not a finite number"),
        ("1e999", "1e999", "not a finite number"),
        ("u/0", "0", "division by zero"),
        ("", "", "an empty formula"),
        ("   ", "   ", "an empty formula"),
        ("v µ", "µ", "an operator is missing"),
    ];
    for (text, part, message) in cases {
        let LawError { formula, error } = FormulaKinetics::new(&law(text)).unwrap_err();
        assert_eq!(formula, FormulaIndex::Rate(0));
        assert_eq!(&text[error.span.clone()], part, "{text}");
        assert!(error.message.contains(message), "{text}: {}", error.message);
    }
    let error = FormulaKinetics::new(&law("u + mean_curvatur")).unwrap_err().error;
    assert!(error.help.unwrap().contains("did you mean `mean_curvature`"));
    let help = |text: &str| FormulaKinetics::new(&law(text)).unwrap_err().error.help.unwrap();
    for (text, here) in [
        ("ln(u)", "write log(x); there are pos"),
        ("pow(u, 2)", "write x^y;"),
        ("Heaviside(u)", "write step(x);"),
        ("tan(u)", "write sin(x)/cos(x);"),
        ("v*(u > 1)", "there are no comparisons: step(x - y)"),
        ("np.sin(u)", "functions stand alone"),
    ] {
        assert!(help(text).starts_with(here), "{text}: {}", help(text));
    }
    let deep = "(".repeat(500) + "u" + &")".repeat(500);
    let error = FormulaKinetics::new(&law(&deep)).unwrap_err().error;
    assert!(error.message.contains("nested too deeply"));
}

#[test]
fn parts_come_in_any_order_but_not_in_a_circle() {
    let part = |name: &str, text: &str| Formula { name: name.into(), text: text.into() };
    let mut good = law("b*2");
    good.lets = vec![part("b", "a + 1"), part("a", "u*v")];
    let kinetics = FormulaKinetics::new(&good).unwrap();
    let (rates, _) = evaluate(&kinetics, &[vec![3.0], vec![5.0]]);
    assert_eq!(rates[0][0], 32.0);
    good.lets = vec![part("b", "a + 1"), part("a", "b*v")];
    let error = FormulaKinetics::new(&good).unwrap_err();
    assert!(error.error.message.contains("depends on itself"), "{error:?}");
    good.lets = vec![part("u", "1")];
    let error = FormulaKinetics::new(&good).unwrap_err();
    assert!(error.error.message.contains("species or a parameter already"), "{error:?}");
    good.lets = vec![part("b", "tension")];
    good.feedback = vec![(Feedback::LengthFactor, "1 + 1e-3*b".into())];
    let error = FormulaKinetics::new(&good).unwrap_err();
    assert_eq!(error.formula, FormulaIndex::Feedback(0));
    assert!(error.error.message.contains("reads the signal tension"), "{error:?}");
}

proptest! {
    #[test]
    fn no_text_breaks_the_parser(text in "[-+*/^()., a-z0-9µ]{0,60}|\\PC{0,30}") {
        if let Err(LawError { error, .. }) = FormulaKinetics::new(&law(&text)) {
            prop_assert!(text.get(error.span).is_some());
        }
    }
}

/// The law of a shipped scene as text against the plugin of the same model.
fn against(scene: &str, plugin: &str, range: impl Fn(&mut Noise) -> Vec<f64>) {
    let path = root().join(scene);
    let law = Scene::load(&path, &[]).unwrap().kinetics[0].law().unwrap();
    let text = FormulaKinetics::new(&law).unwrap();
    let native = build::plugin(plugin, &[]);
    assert_eq!(text.descriptor().signals[0].signal, native.descriptor().signals[0].signal);
    let mut noise = Noise::new(11);
    let points: Vec<Vec<f64>> = (0..1000).map(|_| range(&mut noise)).collect();
    let inputs: Vec<Vec<f64>> =
        (0..2).map(|column| points.iter().map(|point| point[column]).collect()).collect();
    let (a, b) = (evaluate(&text, &inputs), evaluate(&native, &inputs));
    let close = |a: &[Vec<f64>], b: &[Vec<f64>]| {
        for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
            assert!((a - b).abs() <= 1e-13 * (1.0 + b.abs()), "{a} {b}");
        }
    };
    close(&a.0, &b.0);
    close(&a.1, &b.1);
    let factor = |kinetics: &dyn Kinetics| {
        let columns: [Column<'_>; 1] = [(&inputs[0]).into()];
        let batch = Batch {
            location: Location::Edge,
            first: 0,
            count: 1000,
            species: &columns,
            signals: &[],
            parameters: &[],
        };
        let (mut factor, mut slope) = (vec![0.0; 1000], vec![0.0; 1000]);
        let which = Feedback::LengthFactor.into();
        kinetics.evaluate(which, &batch, &mut [&mut factor], &mut [&mut slope]).unwrap();
        vec![factor, slope]
    };
    close(&factor(&text), &factor(&native));
}

#[test]
fn the_shipped_models_are_the_same_as_text() {
    against("models/model-i/formula.toml", "curvature-feedback", |noise| {
        vec![0.4 + 0.4 * noise.number(), 0.2 * noise.number()]
    });
    against("models/model-ii/formula.toml", "tension-feedback", |noise| {
        vec![0.5 + 0.5 * noise.number(), 3e4 * noise.number()]
    });
}

/// A law as text runs like any other, and what is wrong with it is shown in the scene.
#[test]
fn a_scene_with_a_law_runs_and_shows_its_mistakes() {
    let text = r#"
[sheet]
shape = "point"
[kinetics]
rates.u = "a - (b + 1)*u + u^2*v"
rates.v = "b*u - u^2*v"
parameters = { a = 1.0, b = 3.0 }
initial = { u = 1.0, v = 1.0 }
[time]
integrator = { kind = "monolithic", rtol = 1e-8, atol = 1e-10 }
until = 5.0
"#;
    let end = |text: &str| {
        let (_, mut simulation) = prepare(text, &[]);
        while simulation.state().time < 5.0 {
            simulation.step(5.0).unwrap();
        }
        simulation.state().species.concat()
    };
    let native = text.replace("rates.u = \"a - (b + 1)*u + u^2*v\"", "plugin = \"brusselator\"");
    let native =
        native.replace("rates.v = \"b*u - u^2*v\"\nparameters = { a = 1.0, b = 3.0 }\n", "");
    for (a, b) in end(text).iter().zip(end(&native)) {
        assert!((a - b).abs() < 1e-7, "{a} {b}");
    }
    let wrong = text.replace("u^2*v\"\nrates.v", "u^2*vv\"\nrates.v");
    let scene = Scene::parse(&wrong, "scene.toml", &[]).unwrap();
    let search = rumple::kinetics::PluginSearch::in_directories(Vec::new());
    let error = match rumple::Simulation::new(&scene, &search) {
        Err(rumple::Error::Scene(error)) => error,
        other => panic!("{:?}", other.err()),
    };
    assert_eq!(error.position(), Some((5, 32)), "{error}");
    assert!(error.message().contains("unknown name `vv`"), "{error}");
    assert!(error.advice().unwrap().contains("did you mean `v`"), "{error}");
    let both = text.replace("rates.u", "plugin = \"brusselator\"\nrates.u");
    let error = Scene::parse(&both, "scene.toml", &[]).unwrap_err();
    assert!(error.to_string().contains("not both"), "{error}");
    let part = native.replace("initial =", "let.x = \"1\"\ninitial =");
    let error = Scene::parse(&part, "scene.toml", &[]).unwrap_err();
    assert!(error.to_string().contains("part of a law"), "{error}");
    // What is written out reads back as the same law.
    let scene = Scene::parse(text, "scene.toml", &[]).unwrap();
    let again = Scene::parse(&scene.resolved().unwrap(), "resolved.toml", &[]).unwrap();
    assert_eq!(scene.kinetics, again.kinetics);
}

/// 1e-200 has two hundred digits after the point.
#[test]
fn numbers_in_messages_are_short() {
    let site = rumple::kinetics::Site {
        location: "vertex",
        point: 3,
        inputs: vec![("c".into(), 1e-200), ("k".into(), 20000.0)],
        position: None,
    };
    assert_eq!(site.to_string(), "vertex 3 (c = 1e-200, k = 20000)");
    let parameter = Parameter { lower: 1e-200, upper: 1e200, ..parameter("k") };
    assert_eq!(parameter.range(), "1e-200 <= k <= 1e200");
}
