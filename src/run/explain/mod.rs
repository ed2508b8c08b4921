//! What a scene calls for, and where: unknowns, effects, laws and signals, solvers, output; and what it spares.
//!
//! Everything is read from what the scene was built into: what an effect is said to couple, fix, grow or
//! transport is what it contributes to the model, so that a new effect explains itself.

mod solvers;

pub use solvers::{Line, boundary};

use serde::Serialize;

use super::{Result, Simulation};
use crate::effects::{Coupling, EffectParts, EnergyTerm, Interaction, TransportTerm};
use crate::kinetics::{Descriptor, Signal};
use crate::model::{Chemistry, Model};
use crate::run::explain::solvers::reach;
use crate::scene::Scene;

/// What a scene calls for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// The name of the scene's file.
    pub scene: String,
    /// Its parts, by subject.
    pub sections: Vec<Section>,
}

/// The lines on one subject.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Section {
    /// The subject.
    pub title: &'static str,
    /// The lines.
    pub lines: Vec<Line>,
}

impl Explanation {
    /// Of `scene`, set up as `simulation`.
    ///
    /// # Errors
    /// If a law or an effect cannot be evaluated at the start.
    pub fn of(scene: &Scene, simulation: &mut Simulation) -> Result<Self> {
        let section = |title, lines: fn(&Scene, &Simulation) -> Vec<Line>| Section {
            title,
            lines: lines(scene, simulation),
        };
        let sections = vec![
            section("unknowns", unknowns),
            section("effects", effects_of),
            section("laws and signals", laws),
            section("solvers", solvers::lines),
            section("output", solvers::output),
            section("not in this scene", solvers::absent),
        ];
        Ok(Self { scene: scene.name().to_owned(), sections })
    }
}

impl std::fmt::Display for Explanation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "{}", self.scene)?;
        for Section { title, lines } in &self.sections {
            writeln!(f, "\n{title}")?;
            for Line { what, because, place } in lines {
                let place = place.as_ref().map(|place| format!("  ({place})"));
                writeln!(f, "  {what}{}", place.unwrap_or_default())?;
                if !because.is_empty() {
                    writeln!(f, "      {because}")?;
                }
            }
        }
        Ok(())
    }
}

/// How a quasi-static shape is stabilised, in words; nothing where no drag is.
#[must_use]
pub fn stabilisation(scene: &Scene) -> Option<String> {
    solvers::stabilisation(scene).map(|line| line.what.trim_start().to_owned())
}

/// The effects whose contribution has something.
fn contributing(
    scene: &Scene,
    simulation: &Simulation,
    what: impl Fn(&EffectParts) -> bool,
) -> String {
    let all = scene.effects.iter().zip(&simulation.setup.effects);
    let names: Vec<String> =
        all.filter(|(_, c)| what(&c.parts)).map(|(spec, _)| spec.name()).collect();
    names.join(", ")
}

fn unknowns(scene: &Scene, simulation: &Simulation) -> Vec<Line> {
    let model = simulation.model();
    let mechanics = model.mechanics();
    // Images move as their owners do.
    let vertices = model.sheet().reduction().owned(model.sheet().vertex_count());
    let mut lines = Vec::new();
    if model.moves() {
        let axes = mechanics.pattern().axes();
        let fixed = mechanics.pins().iter().take(vertices).flat_map(|fixed| &fixed[..axes]);
        let fixed = fixed.filter(|fixed| **fixed).count();
        let positions = axes * vertices - fixed;
        let what = format!("{positions} positions: {vertices} vertices × {axes}, {fixed} fixed");
        let moving = contributing(scene, simulation, |parts| parts.energies > 0);
        lines.push(Line::new(what, format!("energies of {moving}")));
        let motions = mechanics.free_motions();
        if motions > 0 {
            let what = format!("{motions} rigid motions of the sheet are free");
            lines.push(Line::new(what, "no pin fixes them: the relaxation keeps them"));
        }
    } else {
        lines.push(Line::new("no positions: the shape is fixed", "no effect has an energy"));
    }
    match model.chemistry() {
        Some(chemistry) => {
            let (points, place) = (chemistry.points(model.sheet()), chemistry.location().nouns());
            let d = chemistry.descriptor();
            let at = if vertices == 1 { "at one point".into() } else { format!("on {place}") };
            let (count, names) = (points * d.species.len(), species(d));
            let line = Line::new(format!("{count} values of species: {names}, {at}"), d.title());
            lines.push(line.at(scene, &scene.kinetics_path(0)));
        }
        None => lines.push(Line::new("no species", "[kinetics] is absent")),
    }
    for term in model.internal() {
        let what = format!("{} values of {}", term.count(model.sheet()), term.name());
        let owner = contributing(scene, simulation, |parts| parts.internal > 0);
        lines.push(Line::new(what, format!("internal variables of {owner}")));
    }
    lines
}

/// Names of the species of a law.
fn species(law: &Descriptor) -> String {
    law.species.iter().map(|s| s.name.as_str()).collect::<Vec<_>>().join(", ")
}

/// `, reads c` of the species that are read.
fn reads(law: Option<&Descriptor>, read: &[usize]) -> String {
    let all = law.map_or(&[][..], |law| &law.species);
    let names: Vec<&str> = read.iter().filter_map(|s| Some(all.get(*s)?.name.as_str())).collect();
    if names.is_empty() { String::new() } else { format!(", reads {}", names.join(", ")) }
}

/// What the energy `name` couples, the species that it reads, and its largest applied force.
fn energy(term: &EnergyTerm, name: &str, law: Option<&Descriptor>) -> String {
    let (Coupling { rings, low_rank }, reading) = (term.coupling(), term.reads());
    let Interaction { pairs, limits_steps, .. } = term.interaction();
    let mut text = format!("energy `{name}`: couples {}", reach(rings));
    let applied = term.applied_force();
    let more = [
        (low_rank, ", and all vertices by terms of low rank".to_owned()),
        (pairs, ", and pairs that depend on the shape".to_owned()),
        (limits_steps, ", limits steps".to_owned()),
        (true, reads(law, reading.species)),
        (reading.time, ", depends on time".to_owned()),
        (applied > 0.0, format!(", applies up to {applied:.3e} to a vertex at rest")),
    ];
    more.into_iter().filter(|(present, _)| *present).for_each(|(_, more)| text += &more);
    text
}

fn effects_of(scene: &Scene, simulation: &Simulation) -> Vec<Line> {
    let model = simulation.model();
    let mut describe = parts_of(model);
    let mut lines = Vec::new();
    for (number, (spec, contribution)) in
        scene.effects.iter().zip(&simulation.setup.effects).enumerate()
    {
        let mut described = describe(&contribution.parts);
        if described.is_empty() {
            described
                .push("has no effect here: no energy, no fixed direction, no transport".into());
        }
        let path = format!("effect[{number}]");
        lines.push(Line::new(spec.name(), described.join("; ")).at(scene, &path));
    }
    if lines.is_empty() { vec![Line::new("none", "the scene lists none")] } else { lines }
}

/// Describes the contributions of the effects of `model`, which are asked for one after another.
fn parts_of(model: &Model) -> impl FnMut(&EffectParts) -> Vec<String> {
    let mechanics = model.mechanics();
    let law = model.chemistry().map(Chemistry::descriptor);
    let chemistry = || model.chemistry().into_iter();
    let mut terms = mechanics.terms().iter().zip(mechanics.names());
    let mut constraints = mechanics.constraint_names();
    let mut transports = chemistry().flat_map(Chemistry::transport_names);
    let coefficients = chemistry().flat_map(Chemistry::transports);
    let mut coefficients = coefficients.map(TransportTerm::read_by_coefficient);
    let mut internal = model.internal().iter();
    let made = if model.moves() { "on every shape" } else { "once" };
    move |parts| {
        let mut all: Vec<String> = Vec::new();
        let energies = terms.by_ref().take(parts.energies);
        all.extend(energies.map(|(term, name)| energy(term, name, law)));
        let [directions, vertices] = parts.pins;
        let fixed = format!("fixes {directions} directions of {vertices} vertices");
        all.extend((directions > 0).then_some(fixed));
        let prescribed = "prescribes the positions of fixed directions in time";
        all.extend((parts.prescribed > 0).then(|| prescribed.to_owned()));
        let kept = constraints.by_ref().take(parts.constraints);
        all.extend(kept.map(|name| format!("constraint `{name}`: zero at every equilibrium")));
        let grows = "multiplies optimal lengths by a factor of position and time";
        all.extend((parts.growth > 0).then(|| grows.to_owned()));
        let directs = "gives the length factor of the law a direction in the sheet";
        all.extend(parts.directs.then(|| directs.to_owned()));
        for name in transports.by_ref().take(parts.transports) {
            let read = reads(law, coefficients.next().unwrap_or_default());
            all.push(format!("transport `{name}`: a sparse operator, made {made}{read}"));
        }
        let held = format!("holds the species at {} points", parts.held);
        all.extend((parts.held > 0).then_some(held));
        all.extend(internal.by_ref().take(parts.internal).map(|term| {
            let (name, noun) = (term.name(), term.location().noun());
            let lengths =
                if term.multiplies_lengths() { "; they multiply optimal lengths" } else { "" };
            format!(
                "internal variables `{name}`: one per {noun}, integrated with the shape{lengths}"
            )
        }));
        all
    }
}

fn laws(scene: &Scene, simulation: &Simulation) -> Vec<Line> {
    let model = simulation.model();
    let Some(chemistry) = model.chemistry() else {
        return vec![Line::new("none", "[kinetics] is absent: no signal is computed")];
    };
    let (d, location) = (chemistry.descriptor(), chemistry.location().nouns());
    let path = scene.kinetics_path(0);
    let points = chemistry.points(model.sheet());
    let rates = format!("{}: rates of {}", d.title(), species(d));
    let mut lines =
        vec![Line::new(rates, format!("evaluated at {points} points")).at(scene, &path)];
    for (given, what, at) in [
        (d.capabilities.length_factor, "length factor: optimal lengths follow the species", "edge"),
        (d.capabilities.curvature, "spontaneous curvature: bending follows the species", "vertex"),
    ] {
        let why = format!("evaluated at every {at} whenever species have changed");
        lines.extend(given.then(|| Line::new(what, why).at(scene, &path)));
    }
    let slopes = scene.time.integrator.uses_jacobian() && model.moves();
    for signal in chemistry.signals().wanted() {
        let with = match slopes && *signal != Signal::Time {
            true => "the rates read it; with derivatives by positions",
            false => "the rates read it; values alone, no derivatives",
        };
        let what = format!("signal {} on {location}", signal.name());
        lines.push(Line::new(what, with).at(scene, &path));
    }
    if chemistry.signals().wanted().is_empty() {
        lines.push(Line::new("no signal", "the rates read none"));
    }
    if let Some(observed) = simulation.fields.observed() {
        let names: Vec<&str> = observed.wanted().iter().map(|s| s.name()).collect();
        let read = if names.is_empty() { "no signal".into() } else { names.join(", ") };
        let line = Line::new(format!("observables, which read {read}"), "for frames only");
        lines.push(line.at(scene, "output.fields"));
    }
    lines
}
