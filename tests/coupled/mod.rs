//! The coupled system: its residual, its Jacobian, and the ways to integrate it.

mod branches;
mod chemistry;
mod conserved;
mod curvature;
mod first_steps;
mod floating;
mod folds;
mod hazards;
mod jacobian;
mod motion;
mod negative;
mod policies;
mod quasi_static;
pub mod ranks;
mod rotated;
mod short_steps;
mod stiff;
mod threads;
mod transactions;
mod turing;
mod unstable;

use rumple::Simulation;
use rumple::model::State;

use crate::common::prepare;

/// A dome under pressure with a gentle curvature feedback: smooth at all times, far from buckling.
pub const DOME: &str = r#"
[sheet]
shape = "disc"
radius = 20.0
vertices = 250

[material]
young = 1e3
poisson = 0.3333333333333333
thickness = 2.0
drag = 10.0

[[effect]]
kind = "stretching"
[[effect]]
kind = "bending"
[[effect]]
kind = "pin"
where = "rim"
axes = "z"
[[effect]]
kind = "pressure"
value = 0.5
[[effect]]
kind = "diffusion"
species = "c"
coefficient = 1.0

[kinetics]
plugin = "curvature-feedback"
parameters = { c_star = 0.4, b = 3.0, w = 2.0, H_s = 0.5, lambda_min = 0.95 }
initial.c = { gaussian = { width = 8.0, amplitude = 0.3 } }

[equilibrium]
method = "lbfgs"
tolerance = 1e-11

[time]
policy = "simultaneous"
until = 1.0
"#;

/// The state at the end time.
pub fn final_state(text: &str, overrides: &[&str]) -> State {
    finished(text, overrides).state().clone()
}

/// A run to the end time.
pub fn finished(text: &str, overrides: &[&str]) -> Simulation {
    let (scene, mut simulation) = prepare(text, overrides);
    let until = scene.time.span.until.get();
    simulation.prepare().unwrap_or_else(|e| panic!("{e}"));
    while simulation.state().time < until {
        let done = simulation.step(until);
        done.unwrap_or_else(|e| panic!("{overrides:?}, time {}: {e}", simulation.state().time));
    }
    simulation
}

/// Largest differences of heights and species, each relative to the largest in `b`.
pub fn distance(a: &State, b: &State) -> (f64, f64) {
    let heights = |s: &State| -> Vec<f64> { s.x.iter().map(|x| x.z).collect() };
    let relative = |a: &[f64], b: &[f64]| {
        let size = b.iter().fold(0.0f64, |m, b| m.max(b.abs()));
        a.iter().zip(b).fold(0.0f64, |m, (a, b)| m.max((a - b).abs())) / size
    };
    (relative(&heights(a), &heights(b)), relative(&a.species.concat(), &b.species.concat()))
}
