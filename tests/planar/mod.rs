//! Planar scenes: equal to their twins in space, refused where something acts out of the plane.
//!
//! The twin of a planar scene is the same scene without `sheet.planar` and with z pinned at all
//! vertices.

mod algebra;
mod files;
mod frozen;
mod pattern;
mod refused;
mod twins;

use rumple::Simulation;
use rumple::model::State;

use crate::common::prepare;

/// A strip whose motors contract it, fixed at its left end and pulled at its right one.
pub const STRIP: &str = r#"
[sheet]
shape = "rectangle"
width = 10.0
height = 6.0
vertices = 120

[material]
young = 1e3
poisson = 0.3333333333333333
thickness = 0.4
drag = 20.0

[[effect]]
kind = "stretching"
model = "stvk"
[[effect]]
kind = "pin"
where = { half-space = { point = [-4.9, 0, 0], normal = [-1, 0, 0] } }
axes = "xy"
[[effect]]
kind = "load"
where = { half-space = { point = [4.9, 0, 0], normal = [1, 0, 0] } }
force = { total = [60.0, 20.0, 0.0] }
[[effect]]
kind = "foundation"
where = "all"
stiffness = 2.0
[[effect]]
kind = "diffusion"
species = "m"
coefficient = 0.5

# more effects

[kinetics]
plugin = "tension-feedback"
parameters = { k_on = 1.0, k_off = 4.0, a = 1e-2, alpha = 0.2 }
initial.m = { gaussian = { width = 2.0, amplitude = 0.8 } }

[equilibrium]
method = "lbfgs"
tolerance = 1e-11

[time]
policy = "quasi-static"
until = 1.0

[output]
every = 0.5
"#;

/// What makes a twin of a planar scene.
pub const UPRIGHT: &str = "[[effect]]\nkind = \"pin\"\nwhere = \"all\"\naxes = \"z\"\n";

/// The strip, planar or its twin.
pub fn strip(planar: bool, overrides: &[&str]) -> Simulation {
    with(STRIP, planar, overrides)
}

/// A scene, planar or its twin.
pub fn with(text: &str, planar: bool, overrides: &[&str]) -> Simulation {
    let text = if planar {
        text.replacen("[sheet]", "[sheet]\nplanar = true", 1)
    } else {
        text.replacen("# more effects", UPRIGHT, 1)
    };
    prepare(&text, overrides).1
}

/// Steps to `until`.
pub fn run(simulation: &mut Simulation, until: f64) {
    simulation.prepare().unwrap_or_else(|e| panic!("{e}"));
    while simulation.state().time < until {
        let done = simulation.step(until);
        done.unwrap_or_else(|e| panic!("time {}: {e}", simulation.state().time));
    }
}

/// Largest differences of positions and of species.
pub fn distance(a: &State, b: &State) -> (f64, f64) {
    assert_eq!(a.time, b.time);
    let shape = a.x.iter().zip(&b.x).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    let species = a.species.iter().flatten().zip(b.species.iter().flatten());
    (shape, species.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max))
}

/// Whether all z are those of the sheet at rest, bit for bit.
pub fn stays_in_plane(simulation: &Simulation) -> bool {
    let plane = simulation.sheet().rest()[0].z.to_bits();
    simulation.state().x.iter().all(|x| x.z.to_bits() == plane)
}
