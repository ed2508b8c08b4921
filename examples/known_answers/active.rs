//! Active tension that a species sets.
//!
//! * A1: an annulus a < r < b, free, whose fibres pull along φ with the force τ per width. `dm/dt = -k m`, τ = T m. With
//!   `D = Y/(1-ν²)`, `N_r = D (u' + ν u/r)`, `N_φ = D (u/r + ν u') + τ` and `(r N_r)' = N_φ`,
//!
//! ```text
//! u'' + u'/r - u/r² = τ/(D r)        u = A r + B/r + τ/(2D) r ln r,   N_r = 0 at a and b
//! ```
//!
//!   in the limit of small strains, here 1e-4. Computed is u(b) at t = 1, for T exp(-k).
//! * A2: the same in a steady state, `dm/dt = s - m`, at s = 1, at the end of the branch over s from 0.
//!
//! The ring is Lamé's problem with an active stress: e.g. Timoshenko & Goodier, Theory of Elasticity (1970), section 28.

use std::sync::Arc;

use rumple::Simulation;
use rumple::kinetics::PluginSearch;
use rumple::num::real;
use rumple::scene::Scene;
use rumple::sheet::Sheet;

use super::steady::{Scenes, points};
use super::{Outcome, Sample};

/// a and b.
const RADII: [f64; 2] = [3.0, 5.0];
/// Two-dimensional Young's modulus Y, which is E h/(1-ν²) here, and ν.
const ELASTIC: [f64; 2] = [100.0, 0.3];
/// T.
const TENSION: f64 = 0.01;
/// k of A1.
const DECAY: f64 = 0.7;

/// An integrator of small errors in time.
pub const FINE: &str = "{ kind = \"staggered\", rtol = 1e-5, atol = 1e-6 }";

/// u(b) for τ.
fn exact(tension: f64) -> f64 {
    let ([a, b], [y, nu]) = (RADII, ELASTIC);
    let c = 0.5 * tension * (1.0 - nu * nu) / y;
    // A (1+ν) - B (1-ν)/r² = -c ((1+ν) ln r + 1) at both radii.
    let side = |r: f64| -c * ((1.0 + nu) * r.ln() + 1.0);
    let by = (side(b) - side(a)) / ((1.0 - nu) * (1.0 / (a * a) - 1.0 / (b * b)));
    let along = (side(b) + by * (1.0 - nu) / (b * b)) / (1.0 + nu);
    along * b + by / b + c * b * b.ln()
}

/// The annulus with this rate of m and `time`.
fn text(vertices: usize, rate: &str, initial: f64, time: &str) -> String {
    let ([a, b], [y, nu]) = (RADII, ELASTIC);
    let young = y * (1.0 - nu * nu);
    format!(
        "sheet = {{ shape = \"annulus\", inner = {a:?}, outer = {b:?}, vertices = {vertices}, seed = 1, planar = true }}\n\
         material = {{ young = {young:?}, poisson = {nu:?}, thickness = 1.0, drag = 1e-6 }}\n\
         equilibrium = {{ method = \"newton\", tolerance = 1e-10 }}\ntime = {time}\n\
         effect = [\n{{ kind = \"stretching\", model = \"stvk\" }},\n\
         {{ kind = \"active-tension\", value = \"{TENSION:?}*m\", fibre = [\"-y\", \"x\", 0] }},\n]\n\
         [kinetics]\nrates.m = \"{rate}\"\ninitial.m = {initial:?}\n"
    )
}

/// Mean radial displacement of the outer boundary.
fn outer(sheet: &Sheet, x: &[rumple::Vec3]) -> f64 {
    let all = sheet.rest().iter().zip(x).filter(|(rest, _)| rest.norm() > RADII[1] - 1e-6);
    let moved: Vec<f64> = all.map(|(rest, x)| (x - rest).dot(rest) / rest.norm()).collect();
    moved.iter().sum::<f64>() / real(moved.len())
}

/// A1 under a policy with an integrator.
pub fn ring(vertices: usize, (policy, integrator): (&str, &str)) -> Outcome<Sample> {
    let time = format!("{{ policy = \"{policy}\", until = 1.0, integrator = {integrator} }}");
    let text = text(vertices, &format!("-{DECAY:?}*m"), 1.0, &time);
    let scene = Scene::parse(&text, "known_answers", &[])?;
    let mut simulation = Simulation::new(&scene, &PluginSearch::in_directories(Vec::new()))?;
    simulation.prepare()?;
    while simulation.state().time < 1.0 {
        simulation.step(1.0)?;
    }
    let computed = outer(simulation.sheet(), &simulation.state().x);
    Ok(Sample::new(simulation.sheet(), computed, exact(TENSION * (-DECAY).exp())))
}

/// A2.
pub fn followed(vertices: usize) -> Outcome<Sample> {
    let scenes = Scenes(move |s: f64| text(vertices, &format!("{s:?} - m"), s, "{ until = 1.0 }"));
    let sheet = Arc::clone(scenes.simulation(0.0)?.sheet());
    let all = points(scenes, [0.0, 1.0])?;
    let last = all.last().ok_or("no point")?;
    if last.parameter != 1.0 {
        return Err(format!("the branch ends at {}", last.parameter).into());
    }
    Ok(Sample::new(&sheet, outer(&sheet, &last.at.x), exact(TENSION)))
}
