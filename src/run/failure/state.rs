//! The last good state as a frame, with what acts on it.

use std::path::Path;
use std::sync::Arc;

use crate::Stepper;
use crate::Vec3;
use crate::kinetics::Location;
use crate::output::{Field, Frame, vtu};
use crate::run::fields::titled;
use crate::run::{Result, Simulation};
use crate::scene::Scene;

/// Writes it: species, the force of every effect and what is left of their sum, the rate of every species, and
/// the way to the shape where the last relaxation stuck, if it did. `rumple inspect --state` reads it.
///
/// # Errors
/// A sheet without triangles; a file that cannot be written.
pub(super) fn write(path: &Path, scene: &Scene, simulation: &mut Simulation) -> Result<()> {
    let model = Arc::clone(simulation.model());
    let stuck = simulation.stepper.workspace.stuck().cloned();
    let Stepper { workspace, state, .. } = &mut simulation.stepper;
    let state = &*state;
    let mut at = workspace.at(state);
    let (mut point, mut cell) = (Vec::new(), Vec::new());
    let rest = model.sheet().rest();
    let displacement: Vec<Vec3> = rest.iter().zip(&state.x).map(|(r, x)| x - r).collect();
    point.push(Field::vector("displacement [length]", &displacement));
    if let Some(chemistry) = model.chemistry() {
        let place = if chemistry.location() == Location::Face { &mut cell } else { &mut point };
        let rates = at.rates().map(<[_]>::to_vec).unwrap_or_default();
        let species = &chemistry.descriptor().species;
        for (s, values) in species.iter().zip(&state.species) {
            place.push(Field::scalar(titled(&s.name, &s.unit), values.clone()));
        }
        for (s, rate) in species.iter().zip(rates) {
            let unit = if s.unit == "1" || s.unit.is_empty() { "1" } else { &s.unit };
            place.push(Field::scalar(format!("rate of {} [{unit}/time]", s.name), rate));
        }
    }
    let mut field_data = Vec::new();
    if model.moves() {
        if let Ok(gradient) = at.gradient() {
            let left: Vec<Vec3> = gradient.iter().map(|g| -g).collect();
            point.push(Field::vector("force left [force]", &left));
        }
        if let Ok(potential) = at.potential() {
            for (which, name) in model.mechanics().names().enumerate() {
                let force = potential.force_of(which, &state.x);
                point.push(Field::vector(format!("force of {name} [force]"), &force));
            }
            let energies = potential.energies(&state.x);
            let named = model.mechanics().names().zip(energies);
            field_data.extend(named.map(|(name, e)| (format!("energy of {name} [energy]"), e)));
        }
    }
    let finite = |x: &[Vec3]| x.iter().all(|x| x.iter().all(|x| x.is_finite()));
    if let Some(stuck) = stuck.filter(|stuck| stuck.x.len() == state.x.len() && finite(&stuck.x)) {
        let way: Vec<Vec3> = stuck.x.iter().zip(&state.x).map(|(to, from)| to - from).collect();
        point.push(Field::vector("way to where it stuck [length]", &way));
    }
    let frame = Frame {
        time: state.time,
        step: state.step,
        points: &state.x,
        triangles: model.sheet().triangles(),
        point,
        cell,
        field_data,
    };
    Ok(vtu::write(path, &frame, scene.output.compression)?)
}
