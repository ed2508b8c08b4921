//! Policy, integrator, relaxation, stability; what is written; and what the scene does not list.

use serde::Serialize;

use crate::effects::{self, EnergyTerm};
use crate::model::{AtBoundary, Policy, Start};
use crate::num::real;
use crate::run::Simulation;
use crate::scene::Scene;

pub(super) fn lines(scene: &Scene, simulation: &Simulation) -> Vec<Line> {
    let model = simulation.model();
    let (storage, integrator) = (model.storage(), &scene.time.integrator);
    let by = |time_scale: f64, moving: &'static str, still| {
        if time_scale > 0.0 { moving } else { still }
    };
    let shape = by(storage.mechanics, "the shape moves under drag", "the shape is in equilibrium");
    let rates = by(storage.chemistry, "species follow their rates", "species are steady");
    let present = [(model.moves(), shape), (model.chemistry().is_some(), rates)];
    let means: Vec<&str> = present.into_iter().filter(|(is, _)| *is).map(|(_, of)| of).collect();
    let means = if means.is_empty() { "nothing moves".to_owned() } else { means.join(", ") };
    let chosen = |path: &str| if scene.written(path).is_some() { "" } else { "the default" };
    let line = |what, path: &str| Line::new(what, chosen(path)).at(scene, path);
    let mut lines = vec![
        line(format!("policy {}: {means}", scene.time.policy.name()), "time.policy"),
        line(format!("integrator: {}", integrator.name()), "time.integrator"),
    ];
    let plain = scene.time.span.stabilisation.is_some_and(|share| f64::from(share) == 0.0);
    for part in integrator.parts(storage) {
        let (subject, _) = part.split_once(':').unwrap_or_default();
        let idle = subject == "shape" && (!model.moves() || plain)
            || subject == "species" && model.chemistry().is_none();
        lines.extend((!idle).then(|| Line::new(format!("  {part}"), "")));
    }
    if !model.moves() {
        return lines;
    }
    lines.extend(stabilisation(scene));
    let start = match scene.time.span.start {
        Start::Equilibrium => "  start: the equilibrium that the shape of the scene moves to",
        Start::Given => "  start: the shape of the scene",
    };
    lines.push(line(start.to_owned(), "time.start"));
    let (method, moving) = (&scene.equilibrium, storage.mechanics > 0.0);
    let tolerance = simulation.force_tolerance();
    lines.push(line(
        format!("equilibrium: {}, tolerance {tolerance:e}", method.name()),
        "equilibrium",
    ));
    let linear = method.linear_systems(model.mechanics(), moving);
    if linear.is_empty() {
        lines.push(Line::new("no linear systems", "the method takes forces alone"));
        return lines;
    }
    lines.push(matrix(simulation));
    lines.extend(linear.into_iter().map(|text| match text.split_once(", as ") {
        Some((what, why)) => Line::new(what, why),
        None => Line::new(text, ""),
    }));
    lines.extend(corrections(simulation));
    if let Some(stability) = scene.stability.as_ref().filter(|s| s.watch) {
        let modes = stability.modes.get();
        let what = format!(
            "stability of every accepted shape: inertia by one LDLᵀ factor; modes at events: {modes}"
        );
        lines.push(Line::new(what, "").at(scene, "stability"));
    }
    lines
}

/// The drag that stabilises a quasi-static shape.
pub(in crate::run) fn stabilisation(scene: &Scene) -> Option<Line> {
    let (time, integrator) = (&scene.time, &scene.time.integrator);
    if time.policy != Policy::QuasiStatic || integrator.needs_sparse_motion() {
        return None;
    }
    let given = time.span.stabilisation.map(f64::from);
    let share = given.or(integrator.rtol()).map_or("rtol".to_owned(), |share| share.to_string());
    let text = match given {
        Some(0.0) => "  stabilisation: none, one relaxation a step".to_owned(),
        _ => format!(
            "  stabilisation: a drag that takes up at most {share} of the energy supplied in a step"
        ),
    };
    let why = if given.is_some() { "" } else { "the relative tolerance" };
    Some(Line::new(text, why).at(scene, "time.stabilisation"))
}

/// Size and sparsity of the Hessian, with the effects that determine its pattern.
fn matrix(simulation: &Simulation) -> Line {
    let mechanics = simulation.model().mechanics();
    let pattern = mechanics.pattern();
    let (rows, axes) = (pattern.rows(), pattern.axes());
    let blocks: usize = (0..rows).map(|i| pattern.row(i).len()).sum();
    let rings = mechanics.terms().iter().map(|term| term.coupling().rings).max().unwrap_or(0);
    let row = real(blocks) / real(rows.max(1));
    Line::new(
        format!(
            "matrix of {rows} × {rows} blocks {axes} × {axes}, {blocks} stored, {row:.1} a row"
        ),
        format!(
            "{}: couples {}",
            energies(simulation, |c| c.coupling().rings == rings),
            reach(rings)
        ),
    )
}

/// Additions to the sparse factor and to the line search, with the effects that ask for them.
fn corrections(simulation: &Simulation) -> impl Iterator<Item = Line> {
    let constraints: Vec<&str> = simulation.model().mechanics().constraint_names().collect();
    let all = [
        (
            "Woodbury correction of every solution with the factor",
            energies(simulation, |term| term.coupling().low_rank),
        ),
        (
            "augmented Lagrangian until every constraint is below 1e-9, and Woodbury correction",
            constraints.join(", "),
        ),
        (
            "pattern analysed again where pairs have changed",
            energies(simulation, |term| term.interaction().pairs),
        ),
        (
            "every step is shortened until it is allowed",
            energies(simulation, |term| term.interaction().limits_steps),
        ),
    ];
    all.into_iter().filter(|(_, of)| !of.is_empty()).map(|(what, of)| Line::new(what, of))
}

pub(super) fn output(scene: &Scene, simulation: &Simulation) -> Vec<Line> {
    if simulation.model().sheet().triangles().is_empty() {
        let what = "no frames: the species at every step are in the ledger";
        return vec![Line::new(what, "the sheet is one point").at(scene, "sheet")];
    }
    let mut fields = vec!["positions".to_owned(), "displacement".to_owned()];
    fields.extend_from_slice(simulation.fields.names());
    let until = scene.time.span.until.get();
    let frames = match scene.output.every.map(f64::from) {
        Some(every) => {
            let most = (until / every).floor() + 1.0;
            format!("frames every {every} to time {until}: {most:.0} at most")
        }
        None => "two frames: the first and the last state".to_owned(),
    };
    let mut lines = vec![
        Line::new(format!("each frame: {}", fields.join(", ")), "").at(scene, "output.fields"),
        Line::new(frames, "").at(scene, "output.every"),
        Line::new("a row of the ledger for every accepted step", ""),
    ];
    lines.extend(boundary(scene, simulation));
    lines
}

/// What curvatures are at the boundary, where some are read or written and the sheet has a boundary.
#[must_use]
pub fn boundary(scene: &Scene, simulation: &Simulation) -> Vec<Line> {
    let model = simulation.model();
    let curved = |names: &[&str]| names.iter().any(|name| name.contains("_curvature"));
    let read = model.chemistry().into_iter().flat_map(|c| c.signals().wanted());
    let read: Vec<&str> = read.map(|signal| signal.name()).collect();
    let written: Vec<&str> = simulation.fields.names().iter().map(String::as_str).collect();
    let rule = |rule| match rule {
        AtBoundary::Zero => "0 at the boundary",
        AtBoundary::OneSided => "extrapolated to the boundary from within",
    };
    let line = |what: &str, at: AtBoundary, path: &str| {
        let why = if scene.written(path).is_some() { "" } else { "the default" };
        Line::new(format!("{what} are {}", rule(at)), why).at(scene, path)
    };
    let mut lines = Vec::new();
    if !model.sheet().boundary().contains(&true) || model.sheet().triangles().is_empty() {
        return lines;
    }
    if let Some(law) = scene.kinetics.first().filter(|_| curved(&read)) {
        let path = format!("{}.boundary", scene.kinetics_path(0));
        lines.push(line("curvatures that laws read", law.boundary, &path));
    }
    if curved(&written) {
        lines.push(line("curvatures of frames", scene.output.boundary, "output.boundary"));
    }
    lines
}

/// What a scene does not list, and so does not pay for.
pub(super) fn absent(scene: &Scene, simulation: &Simulation) -> Vec<Line> {
    let model = simulation.model();
    let (moves, mechanics, chemistry) = (model.moves(), model.mechanics(), model.chemistry());
    let listed: Vec<&str> = scene.effects.iter().map(|spec| spec.typetag_name()).collect();
    let others = effects::kinds().into_iter().filter(|name| !listed.contains(name));
    let others: Vec<&str> = others.collect();
    let grows = chemistry.is_some_and(|c| c.descriptor().capabilities.length_factor)
        || model.internal().iter().any(|term| term.multiplies_lengths())
        || model.growth_names().next().is_some();
    let observables = chemistry.is_some_and(|c| !c.descriptor().observables.is_empty());
    let stability = match &scene.stability {
        None => (true, "[stability] is absent"),
        Some(spec) => (!spec.watch, "stability.watch is false"),
    };
    let all = [
        (!others.is_empty(), others.join(", "), "not listed: neither built nor evaluated"),
        (!moves, "no relaxation, no Hessian, no factor".into(), "no effect has an energy"),
        (
            chemistry.is_some_and(|c| c.transports().is_empty()),
            "no transport".into(),
            "no effect transports a species",
        ),
        (
            moves && !grows,
            "optimal lengths stay those at rest".into(),
            "neither the law nor an effect changes them",
        ),
        (
            moves && !mechanics.depends_on_time(),
            "no energy depends on time".into(),
            "no ramp is listed",
        ),
        (stability.0, "no stability analysis".into(), stability.1),
        (
            observables && simulation.fields.observed().is_none(),
            "no observables".into(),
            "output.fields does not list them",
        ),
    ];
    all.into_iter().filter(|(is, ..)| *is).map(|(_, what, why)| Line::new(what, why)).collect()
}

/// One thing that the scene calls for, or spares.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Line {
    /// Description.
    pub what: String,
    /// What calls for it, or spares it.
    pub because: String,
    /// The key or table of the scene, with its line where it is written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub place: Option<String>,
}

impl Line {
    pub(super) fn new(what: impl Into<String>, because: impl Into<String>) -> Self {
        Self { what: what.into(), because: because.into(), place: None }
    }

    /// Called for by the key or table at `path`, where the scene has it: `[stability], line 12`, or `effect[0], line 7`.
    pub(super) fn at(mut self, scene: &Scene, path: &str) -> Self {
        self.place = scene.written(path).map(|written| match path.contains(['.', '[']) {
            true => format!("{path}, {written}"),
            false => format!("[{path}], {written}"),
        });
        self
    }
}

/// The energies of which something is true.
pub(super) fn energies(simulation: &Simulation, what: impl Fn(&EnergyTerm) -> bool) -> String {
    let mechanics = simulation.model().mechanics();
    let all = mechanics.terms().iter().zip(mechanics.names());
    let names: Vec<&str> = all.filter(|(term, _)| what(term)).map(|(_, name)| name).collect();
    names.join(", ")
}

/// How far second derivatives reach.
pub(super) fn reach(rings: usize) -> String {
    match rings {
        0 => "no two vertices".to_owned(),
        1 => "neighbours".to_owned(),
        2 => "neighbours of neighbours".to_owned(),
        rings => format!("vertices up to {rings} edges apart"),
    }
}
