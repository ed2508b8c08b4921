//! Measures of periodic sheets: a pattern across the end of a period is measured as the same one elsewhere.

use std::f64::consts::PI;
use std::fs;

use rumple::Vec3;
use rumple::geometry::face_areas;
use rumple::model::State;
use rumple::study::{Measures, Norm, measure};

use super::folder;
use crate::common::prepare;
use crate::run::program::passes;

const PERIODS: [f64; 2] = [24.0, 16.0];

fn scene(periodic: &str, location: &str, initial: &str) -> String {
    format!(
        r#"
        sheet = {{ shape = "rectangle", width = 24.0, height = 16.0, vertices = 6000, periodic = "{periodic}" }}
        effect = []
        time = {{ until = 1.0 }}
        output = {{ every = 1.0 }}
        kinetics = {{ rates = {{ c = "-2*c" }}, location = "{location}", initial.c = {{ formula = "{initial}" }} }}
        "#
    )
}

/// The distance from `centre` by coordinates, the shortest over the periods along `axes` axes.
fn distance((x, y): (f64, f64), axes: usize) -> String {
    let along = |k: usize, name: &str, at: f64| {
        let apart = format!("abs({name} - {at:?})");
        if k < axes { format!("min({apart}, {:?} - {apart})", PERIODS[k]) } else { apart }
    };
    format!("sqrt(({})^2 + ({})^2)", along(0, "x", x), along(1, "y", y))
}

/// Discs of radius 2 with a smooth edge around `centres`.
fn measured(periodic: &str, location: &str, centres: &[(f64, f64)]) -> Measures {
    let of = |at: &(f64, f64)| format!("1/(1 + exp(4*({} - 2)))", distance(*at, periodic.len()));
    let all: Vec<String> = centres.iter().map(of).collect();
    let (_, mut simulation) = prepare(&scene(periodic, location, &all.join(" + ")), &[]);
    measure(&mut simulation.evaluate(), Some(0.5)).unwrap()
}

#[test]
fn spots_across_the_end_of_a_period_are_one() {
    let area = PERIODS[0] * PERIODS[1];
    for (periodic, place) in [("x", (12.0, 0.0)), ("xy", (12.0, 0.0)), ("xy", (12.0, 8.0))] {
        for location in ["vertex", "face"] {
            let what = format!("{periodic} {location} {place:?}");
            let one = measured(periodic, location, &[place]);
            assert_eq!((one.spots, one.nearest), (1, None), "{what}");
            let share = 4.0 * PI / area;
            assert!((one.share / share - 1.0).abs() < 0.03, "{what}: {one:?}");
            let gap = 2.0 * ((area / PI).sqrt() - 2.0);
            assert!((one.separation.unwrap() / gap - 1.0).abs() < 0.01, "{what}: {one:?}");
            // The same within the cell, of the same width.
            let inside = measured(periodic, location, &[(0.0, 0.0)]);
            let width = one.width.unwrap() / inside.width.unwrap();
            assert!((width - 1.0).abs() < 0.03, "{what}: {one:?} {inside:?}");
            // Six away from another, across the end of the period and for that along x.
            let two = measured(periodic, location, &[place, (-6.0, place.1)]);
            assert_eq!(two.spots, 2, "{what}");
            assert!((two.nearest.unwrap() / 6.0 - 1.0).abs() < 1e-2, "{what}: {two:?}");
        }
    }
}

#[test]
fn a_wave_along_a_period_has_its_width() {
    for periodic in ["x", "xy"] {
        let wave = scene(periodic, "vertex", "1 + 0.3*cos(2*pi*x/8)");
        let (_, mut simulation) = prepare(&wave, &[]);
        let found = measure(&mut simulation.evaluate(), None).unwrap();
        assert_eq!(found.spots, 3, "{periodic}");
        // A triangle of 384/12000 has an edge of 0.27.
        let edge = (4.0 / 3f64.sqrt() * 384.0 / 12000.0).sqrt();
        let error = found.width.unwrap() * edge / 4.0 - 1.0;
        assert!(error.abs() < 0.05, "{periodic}: {found:?}");
    }
}

#[test]
fn wrinkles_across_a_period_have_their_width() {
    let film = scene("xy", "vertex", "1").replace(
        "effect = []",
        "effect = [{ kind = \"stretching\" }, { kind = \"bending\" }]\n\
         material = { young = 1e3, poisson = 0.3, thickness = 0.1 }",
    );
    let (_, mut simulation) = prepare(&film, &[]);
    let sheet = simulation.sheet().clone();
    let bent = |x: &Vec3| x + Vec3::new(0.3, 0.0, 0.2 * (2.0 * PI * (x.x + 1.0) / 8.0).cos());
    simulation.state_mut().x = sheet.rest().iter().map(bent).collect::<Vec<_>>().into();
    let found = measure(&mut simulation.evaluate(), None).unwrap();
    let edge = (4.0 / 3f64.sqrt() * 384.0 / 12000.0).sqrt();
    let error = found.wrinkle_width.unwrap() * edge / 4.0 - 1.0;
    assert!(error.abs() < 0.05, "{found:?}");
    // A translation does not count as deflection.
    assert!((found.amplitude / 0.2 - 1.0).abs() < 1e-3, "{found:?}");
}

#[test]
fn the_distance_of_states_is_that_of_one_period() {
    let (_, simulation) = prepare(&scene("xy", "face", "1"), &[]);
    let sheet = simulation.sheet().clone();
    let norm = Norm::new(&sheet, vec![(1.0, rumple::kinetics::Location::Face)]);
    let state = |by: Vec3, c: Vec<f64>| {
        let x: Vec<Vec3> = sheet.rest().iter().map(|x| x + by).collect();
        State { x: x.into(), species: vec![c], ..State::default() }
    };
    let areas = face_areas(&sheet, sheet.rest());
    let owned = sheet.reduction().owned(areas.len());
    let uniform = vec![1.0; areas.len()];
    // 2 in the triangles with a corner that is an image, 1 elsewhere.
    let vertices = sheet.reduction().owned(sheet.vertex_count());
    let crosses = |t: usize| sheet.triangles()[t].iter().any(|v| *v as usize >= vertices);
    let other = (0..areas.len()).map(|t| sheet.triangle_number(t) as usize);
    let other: Vec<f64> = other.map(|t| if crosses(t) { 2.0 } else { 1.0 }).collect();
    let found = norm
        .distance(&state(Vec3::new(1.0, -2.0, 0.5), other), &state(Vec3::zeros(), uniform.clone()));
    assert_eq!(found.of_shape(), 0.0, "a translation");
    let crossing: f64 = (0..owned).filter(|t| crosses(*t)).map(|t| areas[t]).sum();
    let expected = (crossing / (PERIODS[0] * PERIODS[1])).sqrt();
    assert!((found.of_species() - expected).abs() < 1e-9, "{found:?} {expected}");
    // Turned about z a periodic sheet is another one.
    let turn = |x: &Vec3| x + 0.01 * Vec3::z().cross(x);
    let x: Vec<Vec3> = sheet.rest().iter().map(turn).collect();
    let turned = State { x: x.into(), species: vec![uniform.clone()], ..State::default() };
    assert!(norm.distance(&turned, &state(Vec3::zeros(), uniform)).of_shape() > 0.01);
}

#[test]
fn what_is_written_counts_the_vertices_of_one_period() {
    let text_of = |file: std::path::PathBuf| fs::read_to_string(file).unwrap();
    let folder = folder(&scene("xy", "vertex", "1 + x").replace("6000", "300"));
    let checked = passes(folder.path(), "check scene.toml --json");
    let checked: serde_json::Value = serde_json::from_slice(&checked.stdout).unwrap();
    assert_eq!(checked["sheet"]["vertices"], 300, "{checked}");
    passes(folder.path(), "run scene.toml --out out --quiet");
    let page = text_of(folder.path().join("out/report.html"));
    assert!(page.contains("300 vertices, 600 triangles"));
    passes(folder.path(), "inspect scene.toml --json all.json");
    let all: serde_json::Value =
        serde_json::from_str(&text_of(folder.path().join("all.json"))).unwrap();
    let count = |value: &serde_json::Value| value.as_array().unwrap().len();
    assert_eq!(count(&all["force"]["total"]), 300);
    assert_eq!(count(&all["species"]["c"]), 300);
    assert_eq!(count(&all["bond"]["length"]), 900);
    let ends =
        all["bond"]["vertices"].as_array().unwrap().iter().flat_map(|e| e.as_array().unwrap());
    assert!(ends.map(|v| v.as_u64().unwrap()).all(|v| v < 300));
    let area: f64 =
        all["vertex_area"].as_array().unwrap().iter().map(|a| a.as_f64().unwrap()).sum();
    assert!((area / 384.0 - 1.0).abs() < 1e-9, "{area}");
}
