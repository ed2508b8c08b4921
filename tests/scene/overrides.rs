//! `--set key.path=value`.

use rumple::scene::{Scene, ShapeSpec, SheetSource};

use super::{SCENE, refused};

fn with(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    Scene::parse(SCENE, "s.toml", &overrides).unwrap_or_else(|e| panic!("{}", e.rendered(false)))
}

#[test]
fn values_are_replaced_and_tables_made() {
    let scene = with(&[
        "time.until=7",
        "effect.test-spring.stiffness = 4.5",
        "effect[0].weight=optimal-area",
        "effect.0.share=0.25",
        "sheet.bump={ amplitude = 2, width = 1 }",
        "kinetics.parameters.\"odd. key\"=3",
        "time.integrator.step=2",
    ]);
    assert_eq!(scene.time.span.until.get(), 7.0);
    assert_eq!(scene.effects[0].name(), "spring 4.5");
    let resolved = scene.resolved().unwrap();
    assert!(resolved.contains("weight = \"optimal-area\"") && resolved.contains("share = 0.25"));
    assert!(resolved.contains("step = 2.0"), "{resolved}");
    assert_eq!(scene.sheet.bump.as_ref().unwrap().centre[0].get(), 0.0);
    assert_eq!(scene.kinetics[0].parameters["odd. key"].uniform(), Some(3.0));
    let SheetSource::Generated(ShapeSpec::Disc(disc)) = scene.sheet.source else { panic!() };
    assert_eq!(disc.radius.get(), 100.0);
}

#[test]
fn the_last_of_two_overrides_counts() {
    assert_eq!(with(&["time.until=7", "time.until=8"]).time.span.until.get(), 8.0);
}

#[test]
fn wrong_overrides_are_named() {
    for (change, message, help) in [
        ("time.until=-1", "time.until must be a number above 0, not -1.0", ""),
        ("time.until=abc", "time.until must be a number, not the string \"abc\"", ""),
        ("time.until=1e999", "this number is too large", "largest"),
        ("effect[1].x=1", "unknown key x in effect[1]", "allowed: kind"),
        ("effect[2].x=1", "effect has 2 elements, numbered from 0", ""),
        (
            "effect.test-sprin.x=1",
            "unknown element of effect \"test-sprin\"",
            "did you mean test-spring?",
        ),
        ("time.until.x=3", "time.until is 500.0, nothing is inside", ""),
        ("sheet[0]=1", "sheet is a table, not a list", ""),
        ("x", "an override has the form key.path=value", ""),
        ("=3", "a key is missing in the path", "time.until"),
        ("a..b=3", "a key is missing in the path", "time.until"),
        ("effect[0=3", "a bracket is not closed", "time.until"),
        ("effect[-1].x=3", "\"-1\" is not an element number", "time.until"),
        ("time.until=", "an override needs a value after the =", "\"\""),
        ("sheet.bump={amplitude=1", "not valid TOML: unclosed inline table, expected `}`", ""),
        ("kinetics.initial.m=inf", "kinetics.initial.m must be a finite number, not inf", ""),
    ] {
        let error = refused(SCENE, &["time.max_steps=3", change]);
        assert_eq!(error.to_string(), format!("--set {change}: {message}"));
        assert!(error.advice().unwrap_or("").contains(help), "{:?}", error.advice());
        assert_eq!(error.position(), None);
    }
    let error = refused(SCENE, &["sheet.bump={amplitude=1, width=0}"]);
    assert!(error.rendered(false).contains("[--set:1:32]"), "{}", error.rendered(false));
}

#[test]
fn an_element_that_occurs_twice_needs_its_number() {
    let text = SCENE.replacen("test-weightless\"", "test-spring\"\nstiffness = 1", 1);
    let error = refused(&text, &["effect.test-spring.stiffness=3"]);
    assert_eq!(error.message(), "effect lists test-spring more than once");
    assert_eq!(error.advice(), Some("name one by its number, as in effect[0]"));
    assert!(Scene::parse(&text, "s.toml", &["effect[1].stiffness=3".to_owned()]).is_ok());
}

/// The help was "no name is allowed here".
#[test]
fn a_key_of_one_of_several_laws_needs_the_number_of_the_law() {
    let at = SCENE.find("[kinetics]").unwrap();
    let end = SCENE[at + 1..].find("\n[").map_or(SCENE.len(), |end| at + 1 + end);
    let laws = "[[kinetics]]\nrates.a = \"-k*a\"\nparameters.k = 1.0\n\
                [[kinetics]]\nrates.b = \"-gamma*b\"\nparameters.gamma = 1.0\n";
    let text = [&SCENE[..at], laws, &SCENE[end..]].concat();
    let error = refused(&text, &["kinetics.parameters.gamma=2"]);
    assert_eq!(error.message(), "kinetics is a list of 2, named by their numbers from 0");
    // Both have parameters, the second has this one.
    assert_eq!(error.advice(), Some("write kinetics[1].parameters.gamma"));
    let error = refused(&text, &["kinetics.location=\"face\""]);
    assert_eq!(error.advice(), Some("write kinetics[0].location"));
}

#[test]
fn a_mistake_in_the_file_can_be_overridden() {
    let text = SCENE.replacen("until = 500.0", "until = -1", 1);
    assert!(Scene::parse(&text, "s.toml", &["time.until=3".to_owned()]).is_ok());
}

#[test]
fn a_key_without_its_table_is_told_where_it_belongs() {
    for (change, path) in [
        ("until=5", "time.until"),
        ("until=", "time.until"),
        ("policy=quasi-static", "time.policy"),
        ("every=0.1", "output.every"),
        ("radius=3", "sheet.radius"),
        ("young=1e5", "material.young"),
        ("initial.c=0", "kinetics.initial"),
        ("tolerance=1e-7", "equilibrium.tolerance"),
        ("modes=2", "stability.modes"),
    ] {
        let error = refused(SCENE, &[change]);
        let help = format!("did you mean {path}?");
        assert_eq!(error.advice(), Some(help.as_str()), "{change}: {error}");
    }
    // A misspelt table stays one.
    let help = refused(SCENE, &["outptu.every=1"]).advice().unwrap().to_owned();
    assert!(help.starts_with("did you mean output? allowed: sheet"), "{help}");
}
