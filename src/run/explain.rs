//! What a scene calls for, and where: unknowns, effects, laws and signals, solvers, output.
//!
//! Everything is read from what the scene was built into: what an effect is said to couple, fix, grow or
//! transport is what it contributes to the model, so that a new effect explains itself.

use serde::Serialize;

use super::Simulation;
use crate::effects::{EffectParts, EnergyTerm};
use crate::kinetics::Descriptor;
use crate::model::{AtBoundary, Chemistry, Model, Policy, Start};
use crate::scene::Scene;

/// What a scene calls for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Explanation {
    /// The name of the scene's file.
    pub scene: String,
    /// Its parts, by subject.
    pub lines: Vec<ExplanationLine>,
}

/// One thing that a scene calls for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ExplanationLine {
    /// unknowns, effect, law, signal, solver or output.
    pub subject: &'static str,
    /// Description.
    pub what: String,
    /// The key or table of the scene, with its line where it is written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<String>,
}

impl Explanation {
    /// Explains `scene`, set up as `simulation`.
    #[must_use]
    pub fn new(scene: &Scene, simulation: &Simulation) -> Self {
        let mut made = Self { scene: scene.name().to_owned(), lines: Vec::new() };
        let mut add = |subject, what: String, path: &str| {
            let written = scene.written(path);
            let place = written.map(|written| format!("{path}, {written}"));
            made.lines.push(ExplanationLine { subject, what, place });
        };
        let model = simulation.model();
        unknowns(model, &mut |what| add("unknowns", what, ""));
        let mut describe = descriptions(model);
        for (number, (spec, parts)) in scene.effects.iter().zip(&simulation.effects).enumerate() {
            let what = format!("{}: {}", spec.name(), describe(parts).join("; "));
            add("effect", what, &format!("effect[{number}]"));
        }
        if let Some(chemistry) = model.chemistry() {
            let (d, table) = (chemistry.descriptor(), scene.kinetics_path(0));
            add("law", format!("{}: rates of {}", d.title(), species(d)), &table);
            for (given, what) in [
                (d.capabilities.length_factor, "length factor: optimal lengths follow the species"),
                (d.capabilities.curvature, "spontaneous curvature: bending follows the species"),
            ] {
                given.then(|| add("law", what.to_owned(), &table));
            }
            for signal in chemistry.signals().wanted() {
                add(
                    "signal",
                    format!("{} on {}", signal.name(), chemistry.location().nouns()),
                    &table,
                );
            }
        }
        solvers(scene, simulation, &mut |what, path| add("solver", what, path));
        output(scene, simulation, &mut |what, path| add("output", what, path));
        boundary(scene, simulation).into_iter().for_each(|(what, path)| add("output", what, &path));
        made
    }
}

impl std::fmt::Display for Explanation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "{}", self.scene)?;
        for ExplanationLine { subject, what, place } in &self.lines {
            let place = place.as_ref().map(|place| format!("  ({place})"));
            writeln!(f, "{subject:<9} {what}{}", place.unwrap_or_default())?;
        }
        Ok(())
    }
}

fn unknowns(model: &Model, add: &mut dyn FnMut(String)) {
    let mechanics = model.mechanics();
    // Images move as their owners do.
    let vertices = model.sheet().reduction().owned(model.sheet().vertex_count());
    if model.moves() {
        let axes = mechanics.pattern().axes();
        let fixed = mechanics.pins().iter().take(vertices).flat_map(|fixed| &fixed[..axes]);
        let fixed = fixed.filter(|fixed| **fixed).count();
        let positions = axes * vertices - fixed;
        add(format!("{positions} positions: {vertices} vertices × {axes}, {fixed} fixed"));
    } else {
        add("no positions: no effect has an energy".into());
    }
    if let Some(chemistry) = model.chemistry() {
        let (points, d) = (chemistry.points(model.sheet()), chemistry.descriptor());
        let count = points * d.species.len();
        let (names, place) = (species(d), chemistry.location().nouns());
        add(format!("{count} values of species: {names}, on {place}"));
    }
    for term in model.internal() {
        add(format!("{} values of {}", term.count(model.sheet()), term.name()));
    }
}

/// Names of the species of a law.
fn species(law: &Descriptor) -> String {
    law.species.iter().map(|s| s.name.as_str()).collect::<Vec<_>>().join(", ")
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

fn solvers(scene: &Scene, simulation: &Simulation, add: &mut dyn FnMut(String, &str)) {
    let model = simulation.model();
    let (storage, integrator) = (model.storage(), &scene.time.integrator);
    add(format!("policy {}", scene.time.policy.name()), "time.policy");
    add(format!("integrator {}", integrator.name()), "time.integrator");
    let plain = scene.time.span.stabilisation.is_some_and(|share| f64::from(share) == 0.0);
    for part in integrator.parts(storage) {
        let (subject, _) = part.split_once(':').unwrap_or_default();
        let idle = subject == "shape" && (!model.moves() || plain)
            || subject == "species" && model.chemistry().is_none();
        if !idle {
            add(part, "time.integrator");
        }
    }
    if !model.moves() {
        return;
    }
    stabilisation(scene).into_iter().for_each(|text| add(text, "time.stabilisation"));
    let start = match scene.time.span.start {
        Start::Equilibrium => "start: the equilibrium that the shape of the scene moves to",
        Start::Given => "start: the shape of the scene",
    };
    add(start.to_owned(), "time.start");
    let (method, tolerance) = (&scene.equilibrium, simulation.force_tolerance());
    add(format!("equilibrium: {}, tolerance {tolerance:e}", method.name()), "equilibrium");
    for system in method.linear_systems(model.mechanics(), storage.mechanics > 0.0) {
        add(system, "equilibrium");
    }
    if scene.stability.as_ref().is_some_and(|s| s.watch) {
        add("stability of every accepted shape: inertia by one LDLᵀ factor".into(), "stability");
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

fn output(scene: &Scene, simulation: &Simulation, add: &mut dyn FnMut(String, &str)) {
    if simulation.sheet().triangles().is_empty() {
        return add("no frames: the species at every step are in the ledger".into(), "sheet");
    }
    let until = scene.time.span.until.get();
    let fields = simulation.fields.names().join(", ");
    add(format!("frames with positions, displacement, {fields}"), "output.fields");
    let times = match scene.output.every.map(f64::from) {
        Some(every) => format!("every {every} to time {until}"),
        None => "two: the first and the last state".to_owned(),
    };
    add(format!("frames {times}"), "output.every");
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
