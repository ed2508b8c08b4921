//! A scene as text, checked and looked into without running: what `rumple check` does.
//!
//! `cargo run --release --example 02_scene_from_code`

use rumple::Simulation;
use rumple::kinetics::PluginSearch;
use rumple::scene::Scene;

const SCENE: &str = r#"
sheet = { shape = "annulus", inner = 5.0, outer = 20.0, vertices = 800 }
material = { young = 1e6, poisson = 0.3333, thickness = 0.5 }
effect = [
    { kind = "stretching" },
    { kind = "bending" },
    { kind = "pin", where = "rim", axes = "xyz" },
]
time = { until = 1.0 }
"#;

/// Prepares the scene, relaxes it (nothing moves: it is at rest) and shows a mistake's message.
///
/// # Errors
/// None is expected.
pub fn main() -> rumple::Result<()> {
    let scene = Scene::parse(SCENE, "annulus.toml", &[])?;
    let mut simulation = Simulation::new(&scene, &PluginSearch::in_directories(Vec::new()))?;
    let done = simulation.relax()?;
    println!("{} vertices, residual {:.1e}", simulation.sheet().vertex_count(), done.residual);
    assert_eq!(done.iterations, 0);

    let mistake = SCENE.replace("\"bending\"", "\"bendign\"");
    match Scene::parse(&mistake, "annulus.toml", &[]) {
        Ok(_) => unreachable!("the effect does not exist"),
        Err(error) => println!("{}", error.rendered(false)),
    }
    Ok(())
}
