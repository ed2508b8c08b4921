//! Correct laws, in which `plugin validate` must find nothing: roots and bounds, kinks and jumps.

use std::fs;

use rumple::kinetics::validation::{self, Verdict};
use rumple::kinetics::{Kinetics, formula};
use rumple::scene::Scene;

use super::build::{SHIPPED, library};
use crate::run::program;

const SCENE: &str = "[sheet]\nshape = \"disc\"\nradius = 5.0\nvertices = 50\n\
                     [kinetics]\nspecies.a = { lower = 0.0 }\n\
                     species.h = { lower = 0.0, upper = 2.0, typical = 0.1 }\nrates.a = \"RATE\"\n\
                     rates.h = \"a^2 - h\"\n[time]\nuntil = 1.0\n";

fn law(rate: &str) -> formula::FormulaKinetics {
    let text = SCENE.replace("RATE", rate);
    let scene = Scene::parse(&text, "scene.toml", &[]).unwrap_or_else(|e| panic!("{e}"));
    formula::FormulaKinetics::new(&scene.kinetics[0].law().unwrap()).unwrap()
}

fn nothing_wrong(kinetics: &dyn Kinetics, seed: u64, what: &str) -> Vec<String> {
    let mut reported = Vec::new();
    validation::validate(kinetics, &[], seed, &mut |_| (), &mut |found| match found.verdict {
        Verdict::Fault(text) => panic!("{what}, seed {seed}, {}: {text}", found.check),
        Verdict::Good(text) | Verdict::Skipped(text) => reported.push(text),
    });
    reported
}

/// At a = 0 the derivative of a² is 0, and a difference towards the one side that there is is not.
#[test]
fn a_square_at_the_bound_of_its_range_has_no_wrong_derivative() {
    let law = law("-a");
    for seed in 0..200 {
        nothing_wrong(&law, seed, "a^2");
    }
}

#[test]
fn roots_powers_kinks_and_jumps_have_no_wrong_derivatives() {
    for rate in [
        "hill(a, 0.5, 4) - a",
        "hill(a, 1e-4, 2) - a*h",
        "hill(a, 0.3, 1.5)*h - a",
        "a^1.2 - h^1.05",
        "a^3*h - a^4",
        "pos(a - 0.5) - pos(0.5 - a)",
        "abs(a - h) + abs(time - 1)",
        "step(a - 0.5)*a - step(h - 0.1)",
        "min(a, h) - max(a, 0.5)",
        "exp(-100*(a - 0.1)^2) - h",
        "1/(1 + exp(-200*(a - 0.5))) - h/(1e-3 + h)",
        "sqrt(time) + area_ratio^1.5 - a",
        "1e6*a*(1 - a) - 1e6*h + 1e-3*h",
    ] {
        let law = law(rate);
        for seed in 0..10 {
            nothing_wrong(&law, seed, rate);
        }
    }
}

/// The derivative is infinite there, in truth: reported, and no fault of the law.
#[test]
fn a_root_at_the_bound_has_an_infinite_derivative_and_no_fault() {
    for rate in ["sqrt(a) - h", "a^0.5 - h", "1 - 2*a^0.3", "sqrt(h) - sqrt(2 - h)"] {
        let law = law(rate);
        for seed in 0..10 {
            let reported = nothing_wrong(&law, seed, rate);
            assert!(
                reported.iter().any(|t| t.contains("infinite at vertex")),
                "{rate}: {reported:?}"
            );
        }
    }
}

#[test]
fn shipped_plugins_have_no_faults_for_any_seed() {
    for name in SHIPPED {
        let law = library(name).instantiate(&std::collections::BTreeMap::new()).unwrap();
        for seed in 0..20 {
            nothing_wrong(&law, seed, name);
        }
    }
}

#[test]
fn validate_tries_the_same_points_unless_asked() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), SCENE.replace("RATE", "-a")).unwrap();
    let say = |more: &[&str]| {
        let out = std::process::Command::new(program())
            .current_dir(folder.path())
            .args(["plugin", "validate", "scene.toml"])
            .args(more)
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&out.stdout).into_owned();
        assert!(out.status.success(), "{text}");
        text.lines().next().unwrap_or_default().to_owned()
    };
    assert_eq!(say(&[]), say(&[]));
    assert_eq!(say(&[]), say(&["--seed", "1"]));
    assert!(say(&["--seed", "12"]).contains("--seed 12"));
}
