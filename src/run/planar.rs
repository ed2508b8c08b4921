//! Planar scenes: states out of the plane, and what has no effect in it.

use crate::Vec3;
use crate::kinetics::{Kinetics, Signal};
use crate::model::Potential;

/// Forces along z below this share of the force at unit strain are round-off.
const ROUND_OFF: f64 = 1e-12;

/// The first of `points` that is not at the z of the first of `rest`, its z, and the right one.
pub(super) fn first_out_of_plane(rest: &[Vec3], points: &[Vec3]) -> Option<(usize, f64, f64)> {
    let plane = rest.first()?.z;
    let vertex = points.iter().position(|x| x.z != plane)?;
    Some((vertex, points[vertex].z, plane))
}

/// Reports a law that reads curvatures: in a plane they are 0.
pub(super) fn note_curvature_signals(kinetics: Option<&dyn Kinetics>, notes: &mut Vec<String>) {
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
