//! What a scene calls for, in words: the contributions of its effects, its stabilisation, its boundary.
//!
//! Everything is read from what the scene was built into: what an effect is said to couple, fix, grow or
//! transport is what it contributes to the model, so that a new effect explains itself.

use super::Simulation;
use crate::effects::{EffectParts, EnergyTerm};
use crate::kinetics::Descriptor;
use crate::model::{AtBoundary, Chemistry, Model, Policy};
use crate::scene::Scene;

/// What each effect contributes, in words.
#[must_use]
pub fn contributions(simulation: &Simulation) -> Vec<Vec<String>> {
    simulation.effects.iter().map(descriptions(simulation.model())).collect()
}

/// What the energy `name` couples and reads.
fn energy(term: &EnergyTerm, name: &str, law: Option<&Descriptor>) -> String {
    let reads = term.reads();
    let reach = match term.coupling().rings {
        0 => "no two vertices".to_owned(),
        1 => "neighbours".to_owned(),
        2 => "neighbours of neighbours".to_owned(),
        rings => format!("vertices up to {rings} edges apart"),
    };
    let mut text = format!("energy `{name}` couples {reach}");
    if term.interaction().pairs {
        text += " and pairs that depend on the shape";
    }
    for species in reads.species.iter().filter_map(|s| law?.species.get(*s)) {
        text += &format!(", reads {}", species.name);
    }
    if reads.time {
        text += ", depends on time";
    }
    text
}

/// Describes the contributions of the effects of `model`, which are asked for one after another.
fn descriptions(model: &Model) -> impl FnMut(&EffectParts) -> Vec<String> {
    let mechanics = model.mechanics();
    let law = model.chemistry().map(Chemistry::descriptor);
    let mut terms = mechanics.terms().iter().zip(mechanics.names());
    let mut constraints = mechanics.constraint_names();
    let mut transports = model.chemistry().into_iter().flat_map(Chemistry::transport_names);
    let mut internal = model.internal().iter();
    move |parts| {
        let mut all: Vec<String> = Vec::new();
        let energies = terms.by_ref().take(parts.energies);
        all.extend(energies.map(|(term, name)| energy(term, name, law)));
        let names = constraints.by_ref().take(parts.constraints);
        all.extend(names.map(|name| format!("constraint `{name}`")));
        let names = transports.by_ref().take(parts.transports);
        all.extend(names.map(|name| format!("transport `{name}`")));
        let terms = internal.by_ref().take(parts.internal);
        all.extend(terms.map(|term| format!("internal variables `{}`", term.name())));
        let [directions, vertices] = parts.pins;
        let others = [
            (directions, format!("fixes {directions} directions of {vertices} vertices")),
            (parts.prescribed, "prescribes positions of fixed directions in time".into()),
            (parts.growth, "multiplies optimal lengths".into()),
            (parts.directs.into(), "directs the length factor of the law".into()),
            (parts.held, format!("holds the species at {} points", parts.held)),
        ];
        all.extend(others.into_iter().filter(|(count, _)| *count > 0).map(|(_, what)| what));
        if all.is_empty() {
            all.push("contributes nothing here".into());
        }
        all
    }
}

/// How a quasi-static shape is stabilised, in words; nothing where no drag is.
#[must_use]
pub fn stabilisation(scene: &Scene) -> Option<String> {
    let (time, integrator) = (&scene.time, &scene.time.integrator);
    if time.policy != Policy::QuasiStatic || integrator.needs_sparse_motion() {
        return None;
    }
    let given = time.span.stabilisation.map(f64::from);
    let share = given.or(integrator.rtol()).map_or("rtol".to_owned(), |share| share.to_string());
    Some(match given {
        Some(0.0) => "stabilisation: none, one relaxation a step".to_owned(),
        _ => format!(
            "stabilisation: a drag that takes up at most {share} of the energy supplied in a step"
        ),
    })
}

/// What curvatures are at the boundary, where some are read or written and the sheet has a boundary, with their keys.
#[must_use]
pub fn boundary(scene: &Scene, simulation: &Simulation) -> Vec<(String, String)> {
    let model = simulation.model();
    let curved = |name: &str| name.contains("_curvature");
    let read = model.chemistry().into_iter().flat_map(|c| c.signals().wanted());
    let rules = [
        (
            read.map(|signal| signal.name()).any(curved),
            "curvatures that laws read",
            scene.kinetics.first().map(|law| law.boundary),
            format!("{}.boundary", scene.kinetics_path(0)),
        ),
        (
            simulation.fields.names().iter().any(|name| curved(name)),
            "curvatures of frames",
            Some(scene.output.boundary),
            "output.boundary".to_owned(),
        ),
    ];
    let bounded = model.sheet().boundary().contains(&true) && !model.sheet().triangles().is_empty();
    let listed = rules.into_iter().filter(|(present, ..)| bounded && *present);
    let line = |(_, what, rule, path): (bool, &str, Option<AtBoundary>, String)| {
        let rule = match rule? {
            AtBoundary::Zero => "0 at the boundary",
            AtBoundary::OneSided => "extrapolated to the boundary from within",
        };
        Some((format!("{what} are {rule}"), path))
    };
    listed.filter_map(line).collect()
}
