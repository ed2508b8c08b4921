//! Planar scenes: what cannot be in a plane is refused, and what does nothing there is reported.

use super::Result;
use crate::Vec3;
use crate::kinetics::{Kinetics, Signal};
use crate::model::Potential;
use crate::scene::Scene;
use crate::sheet::Sheet;

/// Forces along z below this share of the force at unit strain are round-off.
const ROUND_OFF: f64 = 1e-12;

/// The first of `points` that is not at the z of the first of `rest`, its z, and the right one.
pub(super) fn leaving(rest: &[Vec3], points: &[Vec3]) -> Option<(usize, f64, f64)> {
    let plane = rest.first()?.z;
    let vertex = points.iter().position(|x| x.z != plane)?;
    Some((vertex, points[vertex].z, plane))
}

/// Refuses a sheet at rest that does not lie in a plane z = const, and effects that act out of it.
///
/// # Errors
/// `sheet.planar` with the first vertex that leaves the plane of vertex 0, or the key by which an effect
/// acts out of the plane.
pub(super) fn check(scene: &Scene, sheet: &Sheet) -> Result<()> {
    if let Some((vertex, z, plane)) = leaving(sheet.rest(), sheet.rest()) {
        let message = format!(
            "the sheet does not lie in a plane z = const: vertex {vertex} is at z = {z}, vertex 0 at \
             z = {plane}"
        );
        let help = "leave planar out, or turn the mesh so that all z are the same number";
        return Err(scene.error_at("sheet.planar", &message, Some(help)).into());
    }
    let found = scene.effects.iter().enumerate();
    let mut found = found.filter_map(|(k, e)| e.needs().out_of_plane.map(|key| (k, e, key)));
    if let Some((number, effect, key)) = found.next() {
        let message = format!(
            "{} acts along z, and the vertices of a planar sheet do not move there",
            effect.name()
        );
        let help = match key {
            "kind" => "leave the effect out, or sheet.planar",
            "axes" => "axes = \"x\", \"y\" or \"xy\": z is fixed already",
            _ => "give it no z component, or leave sheet.planar out",
        };
        return Err(scene
            .error_at(&format!("effect[{number}].{key}"), &message, Some(help))
            .into());
    }
    Ok(())
}

/// Reports a law that reads curvatures: in a plane they are 0.
pub(super) fn note_signals(kinetics: Option<&dyn Kinetics>, notes: &mut Vec<String>) {
    let Some(descriptor) = kinetics.map(Kinetics::descriptor) else { return };
    let mut read = descriptor.signals.iter().chain(&descriptor.observed).map(|read| read.signal);
    let curved = |s: &Signal| matches!(s, Signal::MeanCurvature | Signal::GaussianCurvature);
    if let Some(signal) = read.find(curved) {
        notes.push(format!(
            "the kinetics reads the signal {}, which is 0 everywhere on a planar sheet",
            signal.name()
        ));
    }
}

/// Reports forces along z on the sheet at rest, of effects that do not declare them.
pub(super) fn note_forces(potential: &mut Potential, notes: &mut Vec<String>) {
    let mechanics = std::sync::Arc::clone(potential.mechanics());
    let limit = ROUND_OFF * potential.force_scale();
    for (which, name) in mechanics.names().enumerate() {
        let force = potential.force_of(which, mechanics.sheet().rest());
        if let Some(vertex) = force.iter().position(|f| f.z.abs() > limit) {
            notes.push(format!(
                "effect {name} pushes vertex {vertex} along z by {:.3e}, which a planar sheet does not \
                 follow",
                force[vertex].z
            ));
        }
    }
}
