//! The main job: scenes through the library and through the program.

mod bits;
mod breakpoints;
mod coupling;
mod courses;
mod diagnosed;
mod ends;
mod explain;
mod failed;
mod files;
mod follow;
mod inspect;
mod invariants;
mod json;
mod notes;
mod outputs;
mod over_ranks;
mod paraview;
pub mod program;
mod rest_shapes;
pub mod resumed;
mod self_intersection;
mod shipped;
mod stability;
mod start_time;
mod steady;
mod typical;
mod work;

use std::path::PathBuf;

pub(crate) use program::rumple;
use rumple::Simulation;
use rumple::scene::Scene;

use crate::common;

/// A disc of 400 vertices with Model I, seeded in the centre.
pub const SMALL: &str = r#"
[sheet]
shape = "disc"
radius = 14.0
vertices = 400
imperfection = { amplitude = 1e-3, seed = 7 }
bump = { amplitude = 0.3, width = 4.0 }

[material]
young = 1e6
poisson = 0.3333333333333333
thickness = 0.5

[[effect]]
kind = "stretching"
[[effect]]
kind = "bending"
[[effect]]
kind = "pin"
where = "rim"
axes = "z"

# more effects

[kinetics]
plugin = "curvature-feedback"
parameters = { c_star = 0.1, b = 20.0 }
initial.c = { gaussian = { width = 4.0, amplitude = 0.08 } }

[time]
integrator = { kind = "staggered", step = 0.01, rtol = 0.02, atol = 0.02 }
until = 0.5

[output]
every = 0.25
"#;

/// The small scene; an override that starts with `[[effect]]` is one more effect.
pub fn prepare(overrides: &[&str]) -> (Scene, Simulation) {
    let (effects, keys): (Vec<&str>, Vec<&str>) =
        overrides.iter().partition(|o| o.starts_with("[[effect]]"));
    common::prepare(&SMALL.replace("# more effects", &effects.join("\n")), &keys)
}

/// The state at the end time, by steps alone.
pub fn final_state(overrides: &[&str]) -> rumple::model::State {
    let (scene, mut simulation) = prepare(overrides);
    simulation.relax().unwrap();
    let until = scene.time.span.until.get();
    while simulation.state().time < until {
        simulation.step(until).unwrap();
    }
    simulation.state().clone()
}

pub fn program() -> PathBuf {
    env!("CARGO_BIN_EXE_rumple-tested").into()
}
