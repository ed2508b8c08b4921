//! Scene files: what is accepted, and how wrong ones are answered.

mod accepted;
mod by_region;
mod distance;
mod effects;
mod errors;
pub(crate) mod fields;
mod hostile;
mod kinds;
mod later;
mod overrides;
mod reference;
mod regions;
mod unknown;

/// A scene that uses every table; the places of its parts are what the tests check.
pub const SCENE: &str = r#"# spots on a disc
[sheet]
shape = "disc"
radius = 100.0
vertices = 20000
imperfection = { amplitude = 1e-3, seed = 7 }
bump = { amplitude = -0.5, width = 3, centre = [1, 2, 0] }

[material]
young = 1e6
poisson = 0.3333333333333333
thickness = 0.5

[[effect]]
kind = "test-spring"
stiffness = 2
weight = "paper"
anchors = [[0, 0, 0], [1.5, -2, 3]]

[[effect]]
kind = "test-weightless"

[kinetics]
plugin = "curvature-feedback"
parameters = { c_star = 0.1, b = 100 }
initial.c = { gaussian = { width = 5.0, amplitude = 0.5 } }
initial.m = 0.25

[time]
policy = "simultaneous"
integrator = { kind = "monolithic", rtol = 1e-3 }
until = 500.0
stop_when_steady = 1e-6

[equilibrium]
method = "descent"

[output]
every = 5.0
fields = ["c", "mean_curvature"]
compression = "none"
"#;

/// Parses a scene that must be wrong.
pub fn refused(text: &str, overrides: &[&str]) -> rumple::scene::SceneError {
    let overrides: Vec<String> = overrides.iter().map(|o| (*o).to_owned()).collect();
    match rumple::scene::Scene::parse(text, "s.toml", &overrides) {
        Ok(_) => panic!("accepted, but is wrong:\n{text}\n{overrides:?}"),
        Err(error) => error,
    }
}

/// Line and column of the first `needle` in `text`, from 1.
pub fn position(text: &str, needle: &str) -> (usize, usize) {
    let before = &text[..text.find(needle).expect("the needle is in the text")];
    let start = before.rfind('\n').map_or(0, |at| at + 1);
    (before.matches('\n').count() + 1, before[start..].chars().count() + 1)
}
