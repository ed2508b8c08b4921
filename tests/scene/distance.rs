//! The distance to the boundary in formulas of fields.

use rumple::Simulation;
use rumple::effects::{formula_on, formula_values};
use rumple::kinetics::{Location, PluginSearch};
use rumple::scene::Scene;
use rumple::sheet::{Sheet, SheetShape, Subdomain, generate};

use crate::coupled::ranks::ThreadRank;

const SIZE: [f64; 2] = [6.0, 4.0];

fn rectangle() -> Sheet {
    generate(&SheetShape::Rectangle { width: SIZE[0], height: SIZE[1] }, 200, 1).unwrap()
}

fn values(sheet: &Sheet, location: Location) -> Vec<f64> {
    let formula = formula_on(sheet, "2*distance_to_boundary", false).unwrap();
    formula_values(&formula, location, sheet, 0.0)
}

/// Twice the distance to the sides of the rectangle.
fn exact(sheet: &Sheet, location: Location) -> Vec<f64> {
    let at = |p: rumple::Vec3| (SIZE[0] - 2.0 * p.x.abs()).min(SIZE[1] - 2.0 * p.y.abs());
    let centroid =
        |t: &[u32; 3]| t.iter().map(|v| sheet.rest()[*v as usize]).sum::<rumple::Vec3>() / 3.0;
    match location {
        Location::Vertex => sheet.rest().iter().map(|p| at(*p)).collect(),
        _ => sheet.triangles().iter().map(|t| at(centroid(t))).collect(),
    }
}

fn near(found: &[f64], expected: &[f64]) -> bool {
    found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12)
}

#[test]
fn it_is_exact_on_a_rectangle_and_on_its_parts() {
    let whole = rectangle();
    for location in [Location::Vertex, Location::Face] {
        assert!(near(&values(&whole, location), &exact(&whole, location)));
    }
    std::thread::scope(|scope| {
        for communicator in ThreadRank::all(3) {
            let whole = &whole;
            scope.spawn(move || {
                let part = Subdomain::cut(whole, communicator).unwrap();
                for location in [Location::Vertex, Location::Face] {
                    assert!(near(&values(&part.sheet, location), &exact(&part.sheet, location)));
                }
            });
        }
    });
}

const SCENE: &str = r#"
[sheet]
shape = "rectangle"
width = 6.0
height = 4.0
vertices = 200

[material]
young = 100
poisson = 0.3
thickness = "0.1 + distance_to_boundary"

[kinetics]
location = "vertex"
rates.c = "k - c"
parameters.k = { formula = "distance_to_boundary" }
initial.c = { formula = "1 + distance_to_boundary" }

[time]
until = 1.0

[[effect]]
kind = "stretching"

[[effect]]
kind = "growth"
factor = "1 + 0.01*distance_to_boundary*t"

[[effect]]
kind = "active-tension"
value = "c*distance_to_boundary"

[[effect]]
kind = "diffusion"
species = "c"
coefficient = "1 + distance_to_boundary*c^2"

[[effect]]
kind = "flux"
species = "c"
where = "rim"
value = "distance_to_boundary"
"#;

fn built(text: &str) -> Result<Simulation, rumple::Error> {
    let scene = Scene::parse(text, "s.toml", &[]).map_err(rumple::Error::from)?;
    Simulation::new(&scene, &PluginSearch::in_directories(Vec::new()))
}

#[test]
fn fields_initial_values_and_parameters_read_it() {
    for location in ["vertex", "face"] {
        let text = SCENE.replace("\"vertex\"", &format!("{location:?}"));
        let text = if location == "face" {
            text.replace("\"1 + distance_to_boundary*c^2\"", "1")
        } else {
            text
        };
        let mut simulation = built(&text).unwrap_or_else(|e| panic!("{location}: {e}"));
        let (sheet, place) = (
            simulation.sheet().clone(),
            match location {
                "vertex" => Location::Vertex,
                _ => Location::Face,
            },
        );
        let expected: Vec<f64> = exact(&sheet, place).iter().map(|d| 1.0 + 0.5 * d).collect();
        assert!(near(&simulation.state().species[0], &expected));
        assert!(simulation.evaluate().potential().is_ok());
    }
}

#[test]
fn a_closed_sheet_has_none() {
    let closed = SCENE
        .replace("\"rectangle\"\nwidth = 6.0\nheight = 4.0", "\"sphere\"\nradius = 2.0")
        .replace("where = \"rim\"", "where = \"all\"");
    let fixed = |text: &str, but: &str| {
        let parts: Vec<String> = text
            .lines()
            .map(|line| {
                if line.contains(but) {
                    line.to_owned()
                } else {
                    line.replace("distance_to_boundary", "1")
                }
            })
            .collect();
        parts.join("\n")
    };
    for (line, path) in [
        ("thickness =", "material.thickness"),
        ("parameters.k", "kinetics.parameters.k.formula"),
        ("initial.c", "kinetics.initial.c.formula"),
        ("factor =", "effect[1].factor"),
        ("value = \"c*", "effect[2].value"),
        ("coefficient =", "effect[3].coefficient"),
        ("value = \"distance", "effect[4].value"),
    ] {
        let text = fixed(&closed, line);
        let Err(rumple::Error::Scene(error)) = built(&text) else { panic!("{line}") };
        assert_eq!(error.message(), format!("{path}: the sheet is closed: it has no boundary"));
        assert_eq!(error.advice(), Some("`distance_to_boundary` is for sheets with a boundary"));
    }
    let misspelt = fixed(SCENE, "none")
        .replace("factor = \"1 + 0.01*1*t\"", "factor = \"distance_to_boundry\"");
    let Err(rumple::Error::Scene(error)) = built(&misspelt) else { panic!() };
    let advice = error.advice().unwrap();
    assert!(advice.contains("did you mean `distance_to_boundary`"), "{advice}");
}
