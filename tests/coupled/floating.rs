//! A sheet that nothing holds does not drift in one system with its species.

use rumple::Vec3;
use rumple::model::State;

use crate::common::prepare;

/// A free disc with Model I, which starts beside its centre.
const DISC: &str = r#"
effect = [
    { kind = "stretching" },
    { kind = "bending" },
    { kind = "diffusion", species = "c", coefficient = 0.1 },
]
sheet = { shape = "disc", radius = 10.0, vertices = 400, bump = { amplitude = 0.5, width = 4.0 } }
material = { young = 1e4, poisson = 0.3333333333333333, thickness = 0.5, drag = 10.0 }
time = { until = 0.05, integrator = "monolithic" }
[kinetics]
plugin = "curvature-feedback"
parameters = { c_star = 0.1 }
initial.c = { gaussian = { width = 3.0, amplitude = 0.3, centre = [2.0, 1.0, 0.0] } }
"#;

fn centre(x: &[Vec3]) -> Vec3 {
    x.iter().sum::<Vec3>() / x.len() as f64
}

/// How far the sheet goes between two states, and by which angle it turns: its net motion over its extent.
fn motion(from: &State, to: &State) -> (Vec3, Vec3) {
    let middle = centre(&from.x);
    let (mut moment, mut extent) = (Vec3::zeros(), 0.0);
    for (a, b) in from.x.iter().zip(&*to.x) {
        moment += (a - middle).cross(&(b - a));
        extent += (a - middle).norm_squared();
    }
    (centre(&to.x) - middle, moment / extent)
}

#[test]
fn a_free_disc_has_no_net_motion() {
    for policy in ["quasi-static", "simultaneous"] {
        let (_, mut simulation) = prepare(DISC, &[&format!("time.policy=\"{policy}\"")]);
        simulation.prepare().unwrap();
        let first = simulation.state().clone();
        let (mut turned, mut moved) = (0.0, 0.0f64);
        while simulation.state().time < 0.05 {
            let before = simulation.state().clone();
            simulation.step(0.05).unwrap_or_else(|e| panic!("{policy}: {e}"));
            turned += motion(&before, simulation.state()).1.norm();
            let shift = (centre(&simulation.state().x) - centre(&first.x)).norm();
            moved = moved.max(shift / 20.0);
        }
        assert!(moved < 1e-10, "{policy}: {moved:e}");
        // Under drag Newton's method leaves a turn of the order of its tolerance.
        assert!(
            turned < if policy == "quasi-static" { 1e-8 } else { 1e-3 },
            "{policy}: {turned:e}"
        );
        // It does move, and is not held.
        let last = simulation.state();
        let shape = first.x.iter().zip(&*last.x).map(|(a, b)| (b - a).norm()).fold(0.0, f64::max);
        assert!(shape > 1e-2, "{policy}: {shape}");
    }
}

/// A foundation of stiffness k per area hinders what no pin does: under a load p per area the disc sinks by p/k. Held at
/// six coordinates, as a sheet that floats is, it went 0.82 of that way.
#[test]
fn a_foundation_is_no_pin() {
    let text = DISC
        .replace(
            "    { kind = \"diffusion\"",
            "    { kind = \"foundation\", where = \"all\", stiffness = 2.0 },
    { kind = \"load\", where = \"all\", force = { per-area = [0.0, 0.0, 0.1] }, ramp = { formula = \"20*t\" } },
    { kind = \"diffusion\"",
        )
        .replace(", bump = { amplitude = 0.5, width = 4.0 }", "")
        .replace("plugin = \"curvature-feedback\"", "rates.c = \"1 - c\"")
        .replace("parameters = { c_star = 0.1 }", "");
    let (_, mut simulation) = prepare(&text, &["time.policy=\"quasi-static\""]);
    simulation.prepare().unwrap();
    while simulation.state().time < 0.05 {
        simulation.step(0.05).unwrap();
    }
    let height = centre(&simulation.state().x).z;
    assert!((height / 0.05 - 1.0).abs() < 1e-3, "{height}");
}
