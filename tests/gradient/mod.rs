//! Gradients of equilibria and steady states against central differences of relaxed scenes; what is refused.

mod in_time;
mod program;

use rumple::kinetics::PluginSearch;
use rumple::solve::Control;
use rumple::study::gradient::{Objective, Place, Request, SceneSource};

use crate::common::Noise;
use crate::plugins::build;

pub const PLATE: &str = r#"
sheet = { shape = "rectangle", width = 8.0, height = 4.0, vertices = 150 }
material = { young = 1e4, poisson = 0.3, thickness = 0.3 }
time = { until = 1.0 }
equilibrium = { tolerance = 1e-10 }
[[effect]]
kind = "stretching"
model = "stvk"
modulus = "plate"
[[effect]]
kind = "bending"
[[effect]]
kind = "pin"
where = { half-space = { point = [-3.3, 0, 0], normal = [-1, 0, 0] } }
axes = "xyz"
[[effect]]
kind = "load"
where = "all"
force = { per-area = [-0.3, 0.0, 0.4] }
"#;

fn objective(scene: &str, measures: &[&str], numbers: &[&str], fields: &[&str]) -> Objective {
    made(scene, (measures, numbers, fields), Place::End)
}

/// The same of the equilibrium that the scene begins with.
fn start(scene: &str, measures: &[&str], numbers: &[&str], fields: &[&str]) -> Objective {
    made(scene, (measures, numbers, fields), Place::Start)
}

type Lists<'a> = (&'a [&'a str], &'a [&'a str], &'a [&'a str]);

fn made(scene: &str, (measures, numbers, fields): Lists<'_>, place: Place) -> Objective {
    let owned = |all: &[&str]| all.iter().map(|text| (*text).to_owned()).collect();
    let request = Request {
        scene: SceneSource::Text { text: scene.to_owned(), name: "scene.toml".to_owned() },
        set: Vec::new(),
        measures: owned(measures),
        numbers: owned(numbers),
        fields: owned(fields),
        place,
    };
    let search = PluginSearch::in_directories(vec![build::directory().to_owned()]);
    Objective::new(request, search, Control::default()).unwrap_or_else(|e| panic!("{e}"))
}

/// The largest error of a gradient along directions: of every number alone, and of fields at random. Against central
/// differences of equilibria, extrapolated, relative to the sum of the magnitudes of its parts.
fn error(objective: &mut Objective, step: f64) -> f64 {
    let start = objective.values();
    let mut here = objective.evaluate(&start).unwrap_or_else(|e| panic!("{e}"));
    let gradient = objective.gradient(&mut here).unwrap_or_else(|e| panic!("{e}"));
    let mut noise = Noise::new(5);
    let mut worst: f64 = 0.0;
    for (k, slopes) in gradient.iter().enumerate() {
        let largest = start[k].iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let direction: Vec<f64> = match slopes.len() {
            1 => vec![largest],
            _ => slopes.iter().map(|_| largest * noise.number()).collect(),
        };
        let mut at = |share: f64| {
            let mut values = start.clone();
            values[k].iter_mut().zip(&direction).for_each(|(value, d)| *value += share * d);
            objective.evaluate(&values).unwrap_or_else(|e| panic!("{e}")).value
        };
        let mut difference = |h: f64| (at(h) - at(-h)) / (2.0 * h);
        let expected = (4.0 * difference(0.5 * step) - difference(step)) / 3.0;
        let found: f64 = slopes.iter().zip(&direction).map(|(s, d)| s * d).sum();
        let size: f64 = slopes.iter().zip(&direction).map(|(s, d)| (s * d).abs()).sum();
        println!("{} {expected:.9e} {found:.9e} {size:.3e}", objective.parameters()[k].key);
        worst = worst.max((found - expected).abs() / size.max(1e-300));
    }
    worst
}

const MATERIAL: [&str; 3] =
    ["material.young", "material.thickness", "effect.load.force.per-area[2]"];

#[test]
fn every_measure_of_a_loaded_plate_by_its_material_and_its_load() {
    for measure in ["mean(uz)", "integral((uz - 0.1*x)^2 + ux*y)", "energy", "-2*mean(ux^2)"] {
        let found = error(&mut objective(PLATE, &[measure], &MATERIAL, &[]), 4e-3);
        assert!(found < 1e-6, "{measure}: {found:e}");
    }
}

#[test]
fn maps_of_fields_are_the_derivatives_along_any_direction() {
    let fields = ["material.thickness", "material.young"];
    let found = error(&mut objective(PLATE, &["mean(uz)"], &[], &fields), 4e-3);
    assert!(found < 1e-6, "{found:e}");
}

const GROWING: &str = r#"
sheet = { shape = "disc", radius = 5.0, vertices = 150, imperfection = { amplitude = 0.05, seed = 3 } }
material = { young = 1e4, poisson = 0.3333333333333333, thickness = 0.2 }
time = { until = 1.0 }
equilibrium = { tolerance = 1e-10 }
effect = [
    { kind = "stretching" },
    { kind = "bending" },
    { kind = "growth", factor = "1 + 0.03*exp(-(x^2+y^2)/4)" },
]
"#;

#[test]
fn the_distance_of_a_free_sheet_from_a_shape_by_its_growth() {
    let mut plain = objective(GROWING, &["energy"], &["material.young"], &[]);
    let shape = plain.evaluate(&plain.values()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("target.obj");
    let mut lines = String::new();
    for x in shape.state().x.iter() {
        // Turned, moved, and raised by something.
        let bent = 1.3 * x.z + 0.02 * x.x * x.x;
        lines +=
            &format!("v {} {} {}\n", 0.8 * x.x - 0.6 * bent + 2.0, x.y, 0.6 * x.x + 0.8 * bent);
    }
    for t in plain.sheet().triangles() {
        lines += &format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
    }
    std::fs::write(&file, lines).unwrap();
    let measure = format!("shape({})", file.display());
    let fields = ["effect.growth.factor", "material.thickness"];
    let mut maps = objective(GROWING, &[&measure], &[], &fields);
    let found = error(&mut maps, 2e-3);
    assert!(found < 2e-6, "{found:e}");
    let gradient = |of: &mut Objective| {
        let mut here = of.evaluate(&of.values()).unwrap();
        let gradient = of.gradient(&mut here).unwrap();
        assert!(!here.changes_with_rigid_motions());
        gradient
    };
    // Thicker at every vertex alike is thicker.
    let sum: f64 = gradient(&mut maps)[1].iter().sum();
    let whole = gradient(&mut objective(GROWING, &[&measure], &["material.thickness"], &[]))[0][0];
    assert!((sum - whole).abs() < 1e-7 * sum.abs(), "{sum} {whole}");
}

const REACTING: &str = r#"
sheet = { shape = "sphere", radius = 5.0, vertices = 150 }
material = { young = 1e4, poisson = 0.3333333333333333, thickness = 0.3 }
effect = [
    { kind = "stretching" },
    { kind = "bending", rest = "mesh" },
    { kind = "diffusion", species = "c", coefficient = 0.5 },
    { kind = "pressure", value = 20.0 },
]
time = { until = 60.0, policy = "quasi-static", stop_when_steady = 1e-6 }
equilibrium = { tolerance = 1e-10 }
[kinetics]
rates.c = "k*(1 + 2*mean_curvature) - c"
parameters = { k = { formula = "0.3 + 0.02*z" }, b = 1.0 }
length_factor = "1 + 0.3*b*c"
species.c = { typical = 0.3 }
initial.c = 0.3
"#;

const OF_REACTION: [&str; 4] = [
    "kinetics.parameters.b",
    "effect.diffusion.coefficient",
    "effect.pressure.value",
    "material.thickness",
];

#[test]
fn a_steady_state_of_shape_and_chemistry_by_law_transport_and_mechanics() {
    let measures = ["mean(c*c)", "0.001*volume"];
    let fields = ["kinetics.parameters.k"];
    let found = error(&mut objective(REACTING, &measures, &OF_REACTION, &fields), 2e-3);
    assert!(found < 1e-6, "{found:e}");
    let found = error(&mut objective(REACTING, &measures, &[], &["material.thickness"]), 2e-3);
    assert!(found < 1e-6, "{found:e}");
}

#[test]
fn the_first_equilibrium_by_what_species_are_there() {
    let measures = ["volume", "mean(c^3)"];
    let found =
        error(&mut start(REACTING, &measures, &OF_REACTION[2..], &["kinetics.initial.c"]), 2e-3);
    assert!(found < 1e-6, "{found:e}");
}

#[test]
fn pins_that_are_displaced_move_what_they_hold() {
    let pinned = PLATE.replace(
        "axes = \"xyz\"",
        "axes = \"xyz\"\ndisplacement = [0.1, 0.0, 0.2]\nramp = { formula = \"t\" }",
    );
    let numbers = ["effect.pin.displacement[0]", "effect.pin.displacement[2]"];
    let found = error(&mut objective(&pinned, &["mean(uz*ux)"], &numbers, &[]), 4e-3);
    assert!(found < 1e-6, "{found:e}");
}

#[test]
fn an_obstacle_that_is_pressed_on_is_part_of_the_equilibrium() {
    let obstacle = "[[effect]]\nkind = \"obstacle\"\nshape = { plane = { point = [0, 0, 2.5], normal = [0, 0, -1] } }\n";
    let scene = format!("{PLATE}{obstacle}");
    let found = error(&mut objective(&scene, &["mean(ux)"], &MATERIAL, &[]), 1e-3);
    assert!(found < 1e-5, "{found:e}");
}

#[test]
fn what_is_at_rest_nowhere_has_no_gradient() {
    let refused = |scene: &str, expected: &str| {
        let mut objective = objective(scene, &["mean(c)"], &["material.thickness"], &[]);
        let values = objective.values();
        let said = objective.evaluate(&values).map(drop).unwrap_err().to_string();
        assert!(said.contains(expected), "{said}");
    };
    let early = REACTING
        .replace("until = 60.0", "until = 0.01")
        .replace("initial.c = 0.3", "initial.c = 0.9");
    refused(&early, "the species still change there");
    let constrained =
        REACTING.replace("kind = \"pressure\", value = 20.0", "kind = \"volume\", exact = true");
    refused(&constrained, "is a constraint");
}
