//! Errors of later stages that point into the scene.

use rumple::scene::{Scene, path_to};

use super::{SCENE, position};

#[test]
fn values_keys_and_what_is_not_written() {
    let text = SCENE.replacen("b = 100", "\"odd. b\" = 100", 1);
    let scene = Scene::parse(&text, "s.toml", &[]).unwrap();
    let error =
        scene.error_at("kinetics.parameters.c_star", "must be at most 0.05", Some("0 to 0.05"));
    assert_eq!(error.message(), "kinetics.parameters.c_star: must be at most 0.05");
    assert_eq!(error.position(), Some(position(&text, "0.1, ")));
    assert_eq!(error.advice(), Some("0 to 0.05"));

    let odd = path_to("kinetics.parameters", "odd. b");
    assert_eq!(odd, "kinetics.parameters.\"odd. b\"");
    assert_eq!(scene.error_at(&odd, "", None).position(), Some(position(&text, "100 }")));

    let error = scene.unknown_key("kinetics.parameters", "c_star", "parameter", &["c_stat", "b"]);
    assert_eq!(error.message(), "unknown parameter \"c_star\"");
    assert_eq!(error.position(), Some(position(&text, "c_star")));
    assert_eq!(error.advice(), Some("did you mean c_stat? allowed: c_stat, b"));
    let error = scene.unknown_key("kinetics.initial", "m", "species", &["c"]);
    assert_eq!(error.position(), Some(position(&text, "m = 0.25")));

    let fields = ["c", "gaussian_curvature"];
    let error = scene.unknown_name("output.fields[1]", "field", "mean_curvature", &fields);
    assert_eq!(error.position(), Some(position(&text, "\"mean_curvature\"")));
    let error = scene.error_at("effect[0].anchors[1][2]", "is not on the sheet", None);
    assert_eq!(error.position(), Some(position(&text, "3]]")));

    // A default has no place of its own: the table that could hold it has.
    let error = scene.error_at("material.drag", "must be 0 here", None);
    assert_eq!(error.position(), Some(position(&text, "[material]")));
    assert_eq!(scene.error_at("nowhere", "x", None).to_string(), "s.toml: nowhere: x");
}

#[test]
fn an_overridden_value_is_shown_as_the_override() {
    let change = "kinetics.parameters.c_star=9".to_owned();
    let scene = Scene::parse(SCENE, "s.toml", &[change]).unwrap();
    let error = scene.error_at("kinetics.parameters.c_star", "too large", None);
    let start = "--set kinetics.parameters.c_star=9: kinetics.parameters.c_star: too large";
    assert_eq!(error.to_string(), start);
}
