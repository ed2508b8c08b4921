//! Policy, integrator, relaxation, stability; and what is written.

use super::effects::energies;
use super::{Line, listed, verb};
use crate::model::{Policy, Start};
use crate::num::real;
use crate::run::Simulation;
use crate::scene::Scene;

pub(super) fn lines(scene: &Scene, simulation: &Simulation) -> Vec<Line> {
    let model = simulation.model();
    let storage = model.storage();
    let mut lines = Vec::new();
    let means = match (storage.mechanics > 0.0, storage.chemistry > 0.0) {
        (false, true) => "the shape is in equilibrium with the species at every time",
        (true, true) => "the shape moves under drag, the species by their rates",
        (true, false) => "the shape moves under drag, the species are steady at every time",
        (false, false) => "both are in equilibrium",
    };
    let means = match (model.moves(), model.chemistry().is_some()) {
        (true, true) => means,
        (false, true) => "the shape stays, so that only the species matter",
        (true, false) => match storage.mechanics > 0.0 {
            true => "the shape moves under drag",
            false => "the shape is in equilibrium at every time",
        },
        (false, false) => "nothing moves",
    };
    let chosen = |path: &str, default: &str| match scene.written(path) {
        Some(_) => String::new(),
        None => default.to_owned(),
    };
    lines.push(
        Line::new(
            format!("policy {}: {means}", scene.time.policy.name()),
            chosen("time.policy", "the default"),
        )
        .at(scene, "time.policy"),
    );
    let integrator = &scene.time.integrator;
    lines.push(
        Line::new(
            format!("integrator: {}", integrator.name()),
            chosen("time.integrator", "the default under this policy"),
        )
        .at(scene, "time.integrator"),
    );
    for part in integrator.parts(storage) {
        let (subject, _) = part.split_once(':').unwrap_or_default();
        let idle = subject == "shape" && !model.moves()
            || subject == "species" && model.chemistry().is_none();
        if !idle {
            lines.push(Line::new(format!("  {part}"), String::new()));
        }
    }
    if model.moves() {
        lines.extend(stabilisation(scene));
        relaxation(scene, simulation, &mut lines);
    }
    lines
}

/// The drag that stabilises a quasi-static shape.
fn stabilisation(scene: &Scene) -> Option<Line> {
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
    Some(Line::new(text, why.to_owned()).at(scene, "time.stabilisation"))
}

/// The method of relaxation, its linear systems, and what effects add to them.
fn relaxation(scene: &Scene, simulation: &Simulation, lines: &mut Vec<Line>) {
    let (model, method) = (simulation.model(), &scene.equilibrium);
    let mechanics = model.mechanics();
    let moving = model.storage().mechanics > 0.0;
    let when = match (moving, scene.time.span.start) {
        (true, Start::Equilibrium) => "the start is relaxed, later shapes move under drag",
        (true, Start::Given) => "the start is given, later shapes move under drag",
        (false, _) => "the start is relaxed, and later shapes where an equilibrium is near",
    };
    let default = if scene.written("equilibrium").is_some() { "" } else { "; the default" };
    lines.push(
        Line::new(
            format!("equilibrium: {}, tolerance {:e}", method.name(), simulation.force_tolerance()),
            format!("because the shape moves: {when}{default}"),
        )
        .at(scene, "equilibrium"),
    );
    let linear = method.linear_systems(mechanics, moving);
    if linear.is_empty() {
        let what = "no linear systems";
        lines.push(Line::new(what, "because the method takes forces alone: no Hessian, no factor"));
        return;
    }
    lines.push(matrix(simulation));
    lines.extend(linear.into_iter().map(|text| match text.split_once(", as ") {
        Some((what, why)) => Line::new(what, format!("because {why}")),
        None => Line::new(text, String::new()),
    }));
    lines.extend(corrections(simulation));
    if let Some(stability) = scene.stability.as_ref().filter(|s| s.watch) {
        let what = format!(
            "stability analysis of every accepted shape: inertia by one LDLᵀ factor; modes at events: {}",
            stability.modes.get()
        );
        lines.push(Line::new(what, "because [stability] is listed").at(scene, "stability"));
    }
}

/// Size and sparsity of the Hessian, with the effects that determine its pattern.
fn matrix(simulation: &Simulation) -> Line {
    let mechanics = simulation.model().mechanics();
    let pattern = mechanics.pattern();
    let (rows, axes) = (pattern.rows(), pattern.axes());
    let blocks: usize = (0..rows).map(|i| pattern.row(i).len()).sum();
    let rings = mechanics.terms().iter().map(|term| term.coupling().rings).max().unwrap_or(0);
    let reaching = energies(simulation, |c| c.rings == rings);
    Line::new(
        format!(
            "matrix of {rows} × {rows} blocks {axes} × {axes}, {blocks} of them stored, {:.1} a row",
            real(blocks) / real(rows.max(1))
        ),
        format!(
            "because {} {} {}; of a symmetric matrix, half is stored",
            listed(&reaching),
            verb(&reaching, "couples", "couple"),
            match rings {
                0 => "no two vertices".to_owned(),
                1 => "neighbours".to_owned(),
                2 => "neighbours of neighbours".to_owned(),
                rings => format!("vertices up to {rings} edges apart"),
            }
        ),
    )
}

/// Additions to the sparse factor and to the line search: the effects concerned, verbs for one and for several, and
/// their object.
fn corrections(simulation: &Simulation) -> impl Iterator<Item = Line> {
    let kept = simulation.model().mechanics().constraint_names().map(str::to_owned).collect();
    let all: [(&str, Vec<String>, [&str; 2], &str); 4] = [
        (
            "Woodbury correction of every solution with the factor",
            energies(simulation, |c| c.low_rank),
            ["couples", "couple"],
            " all vertices",
        ),
        (
            "augmented Lagrangian: relaxations until every constraint is below 1e-9; Woodbury correction of every \
             solution with the factor",
            kept,
            ["is a constraint", "are constraints"],
            "",
        ),
        (
            "pattern analysed again where pairs have changed",
            energies(simulation, |c| c.pairs),
            ["couples", "couple"],
            " pairs that depend on the shape",
        ),
        (
            "every step is shortened until it is allowed",
            energies(simulation, |c| c.limits_steps),
            ["limits", "limit"],
            " steps",
        ),
    ];
    let present = all.into_iter().filter(|(_, names, ..)| !names.is_empty());
    present.map(|(what, names, [one, several], object)| {
        let verb = verb(&names, one, several);
        Line::new(what, format!("because {} {verb}{object}", listed(&names)))
    })
}

pub(super) fn output(scene: &Scene, simulation: &Simulation) -> Vec<Line> {
    let model = simulation.model();
    let mut lines = Vec::new();
    if model.sheet().triangles().is_empty() {
        let what = "no frames: the species at every step are in the ledger";
        lines.push(Line::new(what, "because the sheet is one point").at(scene, "sheet"));
        return lines;
    }
    let fields = simulation.fields.names();
    let fields_why = match scene.written("output.fields") {
        Some(_) => "because output.fields lists them",
        None => "the default: species and mean curvature",
    };
    let what = format!(
        "each frame: positions, displacement{}{}",
        if fields.is_empty() { "" } else { ", " },
        fields.join(", ")
    );
    lines.push(Line::new(what, fields_why).at(scene, "output.fields"));
    let until = scene.time.span.until.get();
    let what = match scene.output.every {
        Some(every) => format!(
            "frames every {} to time {until}: {:.0} at most",
            every.get(),
            (until / every.get()).floor() + 1.0
        ),
        None => "two frames: the first and the last state".to_owned(),
    };
    let why = if scene.output.every.is_some() { "" } else { "because output.every is absent" };
    lines.push(Line::new(what, why).at(scene, "output.every"));
    lines.push(Line::new(
        "a row of the ledger for every accepted step",
        "always: energies of the effects, work of the solvers, totals of the species",
    ));
    lines
}
