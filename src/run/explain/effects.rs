//! Unknowns, effects, laws and signals.

use super::{Line, listed, place, verb};
use crate::effects::{Coupling, EffectParts, EnergyTerm, InternalVariables, TransportTerm};
use crate::kinetics::Descriptor;
use crate::model::{Chemistry, Model};
use crate::run::Simulation;
use crate::scene::Scene;

/// The effects whose contribution has something, by their names.
pub(super) fn contributing(
    scene: &Scene,
    simulation: &Simulation,
    what: impl Fn(&EffectParts) -> bool,
) -> Vec<String> {
    let all = scene.effects.iter().zip(&simulation.setup.effects).enumerate();
    all.filter(|(_, (_, contribution))| what(&contribution.parts))
        .map(|(number, (spec, _))| match scene.written(&format!("effect[{number}]")) {
            Some(written) => format!("{} ({written})", spec.name()),
            None => spec.name(),
        })
        .collect()
}

/// The energies of which something is true, by name.
pub(super) fn energies(simulation: &Simulation, what: impl Fn(Coupling) -> bool) -> Vec<String> {
    let mechanics = simulation.model().mechanics();
    let all = mechanics.terms().iter().zip(mechanics.names());
    all.filter(|(term, _)| what(term.coupling())).map(|(_, name)| name.to_owned()).collect()
}

pub(super) fn unknowns(scene: &Scene, simulation: &Simulation) -> Vec<Line> {
    let model = simulation.model();
    let (mechanics, vertices) = (model.mechanics(), model.sheet().vertex_count());
    let mut lines = Vec::new();
    if model.moves() {
        let axes = mechanics.pattern().axes();
        let fixed = mechanics.pins().iter().flat_map(|fixed| &fixed[..axes]);
        let fixed = fixed.filter(|fixed| **fixed).count();
        let moving = contributing(scene, simulation, |b| b.energies > 0);
        let mut why = format!("{} {} energies", listed(&moving), verb(&moving, "has", "have"));
        let fixing = contributing(scene, simulation, |b| b.pins[0] > 0);
        if !fixing.is_empty() {
            let verb = verb(&fixing, "fixes", "fix");
            why = format!("{why}; {} {verb} {fixed} directions", listed(&fixing));
        }
        let what = format!(
            "{} positions: {vertices} vertices × {axes}{}",
            axes * vertices - fixed,
            if fixed > 0 { format!(", less {fixed} fixed") } else { String::new() }
        );
        lines.push(Line::new(what, format!("because {why}")));
        let motions = mechanics.free_motions();
        if motions > 0 {
            lines.push(Line::new(
                format!("{motions} rigid motions of the sheet are free"),
                "because no pin fixes them: the relaxation keeps them as they are",
            ));
        }
    } else {
        let why = "because no effect has an energy: nothing relaxes it, and no geometry changes";
        lines.push(Line::new("no positions: the shape is fixed", why));
    }
    match model.chemistry() {
        Some(chemistry) => {
            let (points, place) = (chemistry.points(model.sheet()), chemistry.location());
            let d = chemistry.descriptor();
            let names: Vec<&str> = d.species.iter().map(|s| s.name.as_str()).collect();
            let at = match vertices {
                1 => "at one point".to_owned(),
                _ => format!("on {}", place.nouns()),
            };
            let what =
                format!("{} values of species: {}, {at}", points * names.len(), listed(&names));
            let line = Line::new(what, format!("because they are the species of {}", d.title()));
            lines.push(line.at(scene, &scene.kinetics_path(0)));
        }
        None => lines.push(Line::new("no species", "because [kinetics] is absent")),
    }
    for term in model.internal() {
        let what = format!("{} values of {}", term.count(model.sheet()), term.name());
        let owners = contributing(scene, simulation, |b| b.internal > 0);
        let why = format!(
            "because {} {} internal variables",
            listed(&owners),
            verb(&owners, "owns", "own")
        );
        lines.push(Line::new(what, why));
    }
    lines
}

/// What one coupling makes of the matrix.
fn coupled(coupling: Coupling) -> String {
    let mut all = vec![match coupling.rings {
        0 => "second derivatives couple no two vertices".to_owned(),
        1 => "second derivatives couple neighbours".to_owned(),
        2 => "second derivatives couple neighbours of neighbours".to_owned(),
        rings => format!("second derivatives couple vertices up to {rings} edges apart"),
    }];
    if coupling.low_rank {
        all.push("and all vertices with one another, by terms of low rank".into());
    }
    if coupling.pairs {
        all.push("and pairs that depend on the shape".into());
    }
    if coupling.limits_steps {
        all.push("limits steps".into());
    }
    all.join(", ")
}

/// What the energy `name` couples, the species that it reads, and its largest applied force.
fn energy(term: &EnergyTerm, name: &str, law: Option<&Descriptor>) -> String {
    let species = law.map_or(&[][..], |law| &law.species);
    let read: Vec<&str> = term.species().iter().map(|s| species[*s].name.as_str()).collect();
    let reads = if read.is_empty() { String::new() } else { format!(", reads {}", listed(&read)) };
    let timed = if term.depends_on_time() { ", depends on time" } else { "" };
    let applied = term.largest_applied_force();
    let load = if applied > 0.0 {
        format!(", applies up to {applied:.3e} to a vertex at rest")
    } else {
        String::new()
    };
    format!("energy `{name}`: {}{reads}{timed}{load}", coupled(term.coupling()))
}

pub(super) fn lines(scene: &Scene, simulation: &Simulation) -> Vec<Line> {
    let mut remaining = Remaining::of(simulation.model());
    let mut lines = Vec::new();
    for (number, (spec, contribution)) in
        scene.effects.iter().zip(&simulation.setup.effects).enumerate()
    {
        let mut parts = remaining.take(&contribution.parts);
        if parts.is_empty() {
            parts.push("has no effect here: no energy, no fixed direction, no transport".into());
        }
        let path = format!("effect[{number}]");
        lines.push(Line::new(spec.name(), parts.join("; ")).at(scene, &path));
    }
    if lines.is_empty() {
        lines.push(Line::new("none", "because the scene lists none"));
    }
    lines
}

/// The parts of a model in the order in which effects contributed them, as far as no line has described them.
struct Remaining<'a> {
    model: &'a Model,
    terms: Box<dyn Iterator<Item = (&'a EnergyTerm, &'a str)> + 'a>,
    constraints: Box<dyn Iterator<Item = &'a str> + 'a>,
    transports: Box<dyn Iterator<Item = &'a str> + 'a>,
    /// The species that the coefficients of transports read.
    coefficients: Box<dyn Iterator<Item = &'a [usize]> + 'a>,
    internal: std::slice::Iter<'a, Box<dyn InternalVariables>>,
    law: Option<&'a Descriptor>,
}

impl<'a> Remaining<'a> {
    fn of(model: &'a Model) -> Self {
        let mechanics = model.mechanics();
        let transports = model.chemistry().into_iter().flat_map(Chemistry::transport_names);
        Self {
            model,
            terms: Box::new(mechanics.terms().iter().zip(mechanics.names())),
            constraints: Box::new(mechanics.constraint_names()),
            transports: Box::new(transports),
            coefficients: Box::new(
                model
                    .chemistry()
                    .into_iter()
                    .flat_map(Chemistry::transports)
                    .map(TransportTerm::read_by_coefficient),
            ),
            law: model.chemistry().map(Chemistry::descriptor),
            internal: model.internal().iter(),
        }
    }

    /// Describes the contribution of the next effect.
    fn take(&mut self, contribution: &EffectParts) -> Vec<String> {
        let law = self.law;
        let energies = self.terms.by_ref().take(contribution.energies);
        let mut parts: Vec<String> = energies.map(|(term, name)| energy(term, name, law)).collect();
        if contribution.pins[0] > 0 {
            let [directions, vertices] = contribution.pins;
            parts.push(format!(
                "fixes {directions} directions of {vertices} vertices: no unknowns, nothing to evaluate"
            ));
        }
        if contribution.prescribed > 0 {
            parts.push("prescribes the positions of fixed directions in time".into());
        }
        for name in self.constraints.by_ref().take(contribution.constraints) {
            parts.push(format!("constraint `{name}`: zero at every equilibrium, kept by a force"));
        }
        if contribution.growth > 0 {
            parts.push("multiplies optimal lengths by a factor of position and time".into());
        }
        if contribution.directs {
            parts.push("gives the length factor of the law a direction in the sheet".into());
        }
        for name in self.transports.by_ref().take(contribution.transports) {
            let moves = self.model.moves();
            let when = if moves {
                "on every shape that the species see"
            } else {
                "once, as the shape stays"
            };
            let species = self.law.map_or(&[][..], |law| &law.species);
            let read = self.coefficients.next().unwrap_or_default();
            let read: Vec<&str> = read.iter().map(|s| species[*s].name.as_str()).collect();
            let reads = match read.is_empty() {
                true => String::new(),
                false => format!("; its coefficient reads {}", listed(&read)),
            };
            parts.push(format!("transport `{name}`: a sparse operator, made {when}{reads}"));
        }
        if contribution.held > 0 {
            parts.push(format!(
                "holds the species at {} points: their rates are 0, other rates see their values",
                contribution.held
            ));
        }
        parts.extend(
            self.internal.by_ref().take(contribution.internal).map(|term| internal(&**term)),
        );
        parts
    }
}

/// Where the internal variables of an effect live, and what they do.
fn internal(term: &dyn InternalVariables) -> String {
    let lengths = if term.multiplies_lengths() { "; they multiply optimal lengths" } else { "" };
    let (name, noun) = (term.name(), term.location().noun());
    format!("internal variables `{name}`: one per {noun}, integrated with the shape{lengths}")
}

pub(super) fn laws(scene: &Scene, simulation: &Simulation) -> Vec<Line> {
    let model = simulation.model();
    let Some(chemistry) = model.chemistry() else {
        return vec![Line::new("none", "because [kinetics] is absent: no signal is computed")];
    };
    let (d, location) = (chemistry.descriptor(), chemistry.location().nouns());
    let mut lines = Vec::new();
    let path = scene.kinetics_path(0);
    let species: Vec<&str> = d.species.iter().map(|s| s.name.as_str()).collect();
    lines.push(
        Line::new(
            format!("{}: rates of {}", d.title(), listed(&species)),
            match chemistry.points(model.sheet()) {
                1 => "evaluated at one point".to_owned(),
                points => format!("evaluated at {points} points"),
            },
        )
        .at(scene, &path),
    );
    if d.capabilities.length_factor {
        let what = "length factor: optimal lengths follow the species";
        let why =
            "because the law gives one: evaluated at every edge whenever species have changed";
        lines.push(Line::new(what, why).at(scene, &path));
    }
    if d.capabilities.curvature {
        let what = "spontaneous curvature: bending follows the species";
        let why =
            "because the law gives one: evaluated at every vertex whenever species have changed";
        lines.push(Line::new(what, why).at(scene, &path));
    }
    let slopes = scene.time.integrator.uses_jacobian() && model.moves();
    for signal in chemistry.signals().wanted() {
        let with = if slopes && *signal != crate::kinetics::Signal::Time {
            "with derivatives by positions, which the integrator solves with"
        } else {
            "values alone, no derivatives"
        };
        let what = format!("signal {} on {location}", signal.name());
        lines.push(Line::new(what, format!("because the rates read it; {with}")).at(scene, &path));
    }
    if chemistry.signals().wanted().is_empty() {
        lines.push(Line::new("no signal", "because the rates read none of them"));
    }
    if let Some(observed) = simulation.fields.observed() {
        let names: Vec<&str> = observed.wanted().iter().map(|s| s.name()).collect();
        let what = match names.is_empty() {
            true => "observables, which read no signal".to_owned(),
            false => format!("observables, which read {}", listed(&names)),
        };
        let why = "because output.fields asks for them; for frames only";
        lines.push(Line { place: place(scene, "output.fields"), ..Line::new(what, why) });
    }
    lines
}
