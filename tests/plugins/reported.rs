//! What is reported of laws that a scene writes out: mistakes, and what their author may not have meant.

use std::fs;
use std::process::{Command, Stdio};

use rumple::Simulation;
use rumple::kinetics::validation::{self, Verdict};
use rumple::kinetics::{Kinetics, PluginSearch, formula};
use rumple::scene::Scene;

use crate::run::program;

const SCENE: &str = r#"
[sheet]
shape = "disc"
radius = 10.0
vertices = 200

LAWS

[time]
policy = "quasi-static"
integrator = { kind = "monolithic", method = "bdf", rtol = 1e-6 }
until = 0.1

[output]
every = 0.1
"#;

/// The notes of a scene, or what is wrong with it.
fn reported(laws: &str) -> Result<Vec<String>, String> {
    let text = SCENE.replace("LAWS", laws);
    let scene = Scene::parse(&text, "scene.toml", &[]).map_err(|e| e.rendered(false))?;
    match Simulation::new(&scene, &PluginSearch::in_directories(Vec::new())) {
        Ok(simulation) => Ok(simulation.notes().to_vec()),
        Err(rumple::Error::Scene(error)) => Err(error.rendered(false)),
        Err(error) => Err(error.to_string()),
    }
}

fn refused(laws: &str) -> String {
    reported(laws).unwrap_err()
}

#[test]
fn a_unit_of_nothing_is_refused() {
    let law = "[kinetics]\nrates.c = \"-tau*c\"\nparameters.tau = 1.0\nunits.ta = \"time\"";
    let text = refused(law);
    assert!(text.contains("units.ta = ") && text.contains("tau"), "{text}");
}

#[test]
fn names_that_frames_use_themselves_are_refused() {
    let text = refused("[kinetics]\nrates.c = \"-c\"\nobservables.quality = \"c\"");
    assert!(text.contains("kinetics.observables.quality") && text.contains("frames"), "{text}");
    let text = refused("[kinetics]\nrates.tension = \"-tension\"");
    assert!(text.contains("kinetics.rates.tension"), "{text}");
}

#[test]
fn a_species_without_a_rate_is_told() {
    let notes = reported("[kinetics]\nrates.c = \"-c*v\"\nspecies.v = {}").unwrap();
    assert!(notes.iter().any(|n| n.contains("`v` of kinetics has no rate")), "{notes:?}");
    let both = "[[kinetics]]\nrates.v = \"-v\"\n[[kinetics]]\nrates.c = \"-c*v\"\n\
                species.v = {}\nshared = [\"v\"]";
    assert_eq!(reported(both).unwrap(), Vec::<String>::new());
}

#[test]
fn the_species_of_another_law_is_known_by_name() {
    let laws = "[[kinetics]]\nrates.v = \"-v\"\n[[kinetics]]\nrates.c = \"-c*v\"";
    let text = refused(laws);
    assert!(text.contains("species of another law") && text.contains("species.v = {}"), "{text}");
}

#[test]
fn a_value_that_is_called_is_a_product_to_be() {
    let text = refused("[kinetics]\nrates.c = \"-tau(1 + c)\"\nparameters.tau = 1.0");
    assert!(text.contains("to multiply, write tau*(…)"), "{text}");
}

#[test]
fn what_is_said_of_one_species_twice_must_agree() {
    let both = |first: &str, second: &str| {
        format!(
            "[[kinetics]]\nrates.c = \"-c\"\nspecies.c = {{ {first} }}\n\
             [[kinetics]]\nrates.c = \"1\"\nspecies.c = {{ {second} }}\nshared = [\"c\"]"
        )
    };
    let text = refused(&both("unit = \"mol\"", "unit = \"g\""));
    assert!(text.contains("is in g here, and in mol"), "{text}");
    let text = refused(&both("lower = 1.0", "upper = 0.0"));
    assert!(text.contains("no value of `c` is valid for both"), "{text}");
    assert_eq!(reported(&both("lower = -1.0", "")).unwrap(), Vec::<String>::new());
    let text = refused("[kinetics]\nrates.c = \"-c\"\nspecies.c = { lower = 1.0, upper = 0.0 }");
    assert!(text.contains("range from 1 to 0 is empty"), "{text}");
    let text = refused("[[kinetics]]\nrates.c = \"-c\"\n[[kinetics]]\nrates.c = \"-c\"");
    assert!(text.contains("give it another name here"), "{text}");
}

#[test]
fn a_start_of_two_kinds_says_what_is_one() {
    let law = "[kinetics]\nrates.c = \"-c\"\n\
               initial.c = { gaussian = { width = 1.0, amplitude = 1.0 }, background = 1.0 }";
    let text = refused(law);
    assert!(text.contains("found gaussian, background") && text.contains("go inside it"), "{text}");
}

#[test]
fn a_bad_number_says_which_law_and_where() {
    let laws = "[[kinetics]]\nrates.v = \"-v\"\n[[kinetics]]\nrates.c = \"log(c)\"";
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), SCENE.replace("LAWS", laws)).unwrap();
    let run = ["run", "scene.toml", "--out", "results"];
    let out = Command::new(program()).current_dir(folder.path()).args(run).output().unwrap();
    let text = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(2), "{text}");
    assert!(text.contains("the law `kinetics[1]` returned -inf in rates"), "{text}");
    assert!(text.contains("for the rate of species c at vertex 0"), "{text}");
    assert!(text.contains("v = 0") && text.contains("position ("), "{text}");
}

/// dc/dt = -1 at the lower end of the range: fixed there, and said so.
#[test]
fn a_law_that_leads_out_of_its_range_is_told() {
    let law = "[kinetics]\nrates.c = \"-1\"\nspecies.c = { lower = 0.0 }\ninitial.c = 0.05";
    let text = SCENE.replace("LAWS", law).replace(
        "kind = \"monolithic\", method = \"bdf\", rtol = 1e-6",
        "kind = \"staggered\", method = \"heun\", rtol = 0.05",
    );
    let text = text.replace("until = 0.1", "until = 0.5");
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), text).unwrap();
    let run = ["run", "scene.toml", "--out", "results"];
    let out = Command::new(program()).current_dir(folder.path()).args(run).output().unwrap();
    let text = String::from_utf8_lossy(&out.stderr);
    assert!(text.contains("step size repeatedly reduced: species `c` becomes -"), "{text}");
    assert!(text.contains("or the kinetics leave the range"), "{text}");
}

/// Held in z alone, a boundary lets the sheet slide and turn in its plane.
#[test]
fn the_rigid_motions_that_pins_leave_free_are_counted() {
    let law = "[kinetics]\nrates.c = \"-c\"\n\
               [material]\nyoung = 1e6\npoisson = 0.3333333333333333\nthickness = 0.5\n\
               [[effect]]\nkind = \"stretching\"\n";
    let pin = |region: &str, axes: &str| {
        format!("{law}[[effect]]\nkind = \"pin\"\nwhere = {region}\naxes = \"{axes}\"\n")
    };
    for (laws, free) in [
        (law.to_owned(), 6),
        (pin("\"rim\"", "z"), 3),
        (pin("{ vertices = [0] }", "xyz"), 3),
        (pin("{ vertices = [0, 1] }", "xyz"), 1),
        (pin("\"rim\"", "xyz"), 0),
    ] {
        let text = SCENE.replace("LAWS", &laws);
        let scene = Scene::parse(&text, "scene.toml", &[]).unwrap();
        let search = PluginSearch::in_directories(Vec::new());
        let simulation = Simulation::new(&scene, &search).unwrap();
        assert_eq!(simulation.model().mechanics().free_motions(), free, "{laws}");
    }
}

#[test]
fn nobody_to_read_it_is_no_reason_to_fail() {
    let folder = tempfile::tempdir().unwrap();
    let text = SCENE.replace("LAWS", "[kinetics]\nrates.c = \"-c\"");
    fs::write(folder.path().join("scene.toml"), text).unwrap();
    let mut child = Command::new(program())
        .current_dir(folder.path())
        .args(["check", "scene.toml"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let out = child.wait_with_output().unwrap();
    assert!(out.status.success() && out.stderr.is_empty(), "{out:?}");
}

#[test]
fn parameters_over_the_sheet_are_shown_and_tried() {
    let folder = tempfile::tempdir().unwrap();
    let law = "[kinetics]\nrates.c = \"-sqrt(k)*c\"\n\
               parameters.k = { formula = \"2 + 0.1*x\" }";
    fs::write(folder.path().join("scene.toml"), SCENE.replace("LAWS", law)).unwrap();
    let say = |args: &[&str]| {
        let out = Command::new(program()).current_dir(folder.path()).args(args).output().unwrap();
        let text = String::from_utf8_lossy(&out.stdout).into_owned();
        assert!(out.status.success(), "{text}");
        text
    };
    for command in [&["check", "scene.toml"][..], &["plugin", "describe", "scene.toml"]] {
        let text = say(command);
        let line = text.lines().find(|line| line.contains("over the sheet")).unwrap();
        assert!(line.contains("k = 1 to 3 over"), "{line}");
    }
    assert!(say(&["plugin", "validate", "scene.toml"]).contains("no faults found"));
}

/// A kink that is met exactly (c = 0 is tried first), so small that it passes for smooth.
#[test]
fn a_small_kink_is_no_wrong_derivative() {
    let text = SCENE.replace("LAWS", "[kinetics]\nrates.c = \"e*pos(c) - c\"\nparameters.e = 4e-3");
    let scene = Scene::parse(&text, "scene.toml", &[]).unwrap();
    let law = formula::FormulaKinetics::new(&scene.kinetics[0].law().unwrap()).unwrap();
    assert!(law.descriptor().capabilities.rate_partials);
    let mut verdicts = Vec::new();
    validation::validate(&law, &[], 7, &mut |_| (), &mut |found| verdicts.push(found));
    let wrong = verdicts.iter().find(|found| matches!(found.verdict, Verdict::Fault(_)));
    assert_eq!(wrong, None);
}
