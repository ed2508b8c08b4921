//! `rumple check SCENE`: says whether a scene can run, and what it calls for.

use std::sync::Arc;

use clap::Args;
use serde_json::json;

use super::{Findings, SceneArgs};
use crate::kinetics::{Location, PluginSearch};
use crate::reduction::Communicator;
use crate::run::ranks::agreed;
use crate::run::{self, Result, Simulation, explain, laws, stiffness};
use crate::scene::Scene;
use crate::sheet::MeshReport;

/// Arguments of `check`.
#[derive(Debug, Args)]
pub(super) struct CheckArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Print the scene with every default written out instead of the summary.
    #[arg(long)]
    resolved: bool,
    /// Print the summary as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &CheckArgs) -> Result<()> {
    let ranks = super::ranks::all()?;
    let threads = args.scene.threads.or(ranks.is_some().then_some(1));
    let (scene, search) = SceneArgs { threads, ..args.scene.clone() }.load()?;
    if let Some(ranks) = ranks {
        return on_ranks(args, (&scene, &search), &ranks);
    }
    let mut simulation = Simulation::new(&scene, &search)?;
    // The start must be one that every effect and the plugin can evaluate.
    let faults = laws::validate(&mut simulation.evaluate())?;
    simulation.notes.extend(faults);
    simulation.evaluate().potential()?;
    let stiffness = stiffness::lines(&scene, &mut simulation)?;
    if args.resolved {
        say!("{}", scene.resolved()?.trim_end());
        return Ok(());
    }
    let mut found = Findings::new(LABEL_WIDTH);
    found.line(format!("{}: ready to run", scene.name()));
    found.set("scene", scene.name());
    add_sheet(&mut found, &scene, &simulation)?;
    add_law(&mut found, &scene, &simulation);
    found.one("policy", scene.time.policy.name());
    found.one("integrator", scene.time.integrator.name());
    if simulation.model().moves() {
        explain::stabilisation(&scene).iter().for_each(|line| found.more("stabilisation", line));
    }
    for (k, line) in stiffness.iter().enumerate() {
        match k {
            0 => found.each("stiffness", line, line.to_string()),
            _ => found.more("stiffness", line),
        }
    }
    if let Some(after) = simulation.stepper.integrator.renewed_after() {
        found.more(
            "checkpoints",
            format!(
                "the history of past steps cannot be checkpointed: it restarts from the state every {after} steps, \
                 and checkpoints are written there"
            ),
        );
    }
    add_unknowns(&mut found, &scene, &simulation);
    add_warnings(&mut found, &simulation);
    found.print(args.json);
    Ok(())
}

/// Characters before the text of a line.
const LABEL_WIDTH: usize = 11;

/// Sets up the parts of all ranks, which refuse what they cannot run; the first one prints.
fn on_ranks(
    args: &CheckArgs,
    (scene, search): (&Scene, &PluginSearch),
    ranks: &Arc<dyn Communicator>,
) -> Result<()> {
    let simulation = agreed(Some(&**ranks), Simulation::over(scene, search, Arc::clone(ranks)))?;
    if ranks.rank() > 0 {
        return Ok(());
    }
    if args.resolved {
        say!("{}", scene.resolved()?.trim_end());
        return Ok(());
    }
    let mut found = Findings::new(LABEL_WIDTH);
    found.line(format!("{}: ready to run on {} ranks", scene.name(), ranks.size()));
    found.set("scene", scene.name());
    found.set("ranks", ranks.size());
    found.more(
        "ranks_checked",
        "`rumple check` in one process describes the whole sheet, its laws and unknowns",
    );
    add_notes(&mut found, &simulation);
    found.print(args.json);
    Ok(())
}

/// Adds warnings, times at which steps end, and notes.
fn add_warnings(found: &mut Findings, simulation: &Simulation) {
    let flat = simulation.stepper.state.x.iter().all(|x| x.z == simulation.stepper.state.x[0].z);
    let mechanics = simulation.model().mechanics();
    let pushed = mechanics.applied_forces().into_iter().any(|force| force > 0.0);
    if flat && !pushed && !mechanics.is_planar() && !mechanics.is_empty() {
        let text = "the initial shape is perfectly flat, and only forces out of the plane move it out of it, even from a \
                    saddle; give sheet.imperfection or sheet.bump to break the symmetry";
        found.each("warning", text, text);
    }
    if let Some(listed) = simulation.stepper.breakpoints.describe() {
        found.one("steps", listed);
    }
    add_notes(found, simulation);
}

fn add_notes(found: &mut Findings, simulation: &Simulation) {
    for note in &simulation.notes {
        let (label, text) = match note.strip_prefix("warning: ") {
            Some(warning) => ("warning", warning),
            None => ("note", note.as_str()),
        };
        found.each(label, text, text);
    }
}

/// Adds the sheet, its material and the effects on it.
fn add_sheet(found: &mut Findings, scene: &Scene, simulation: &Simulation) -> Result<()> {
    let model = simulation.model();
    let sheet = model.sheet();
    if sheet.triangles().is_empty() {
        found.one("sheet", "none: one point");
    } else {
        found.line(format!("sheet\n{}", MeshReport::new(sheet)));
        let [vertices, triangles] = sheet.counts_of_whole();
        found.set("sheet", json!({ "vertices": vertices, "triangles": triangles }));
    }
    if model.mechanics().is_planar() {
        found.more("planar", "planar: vertices move in their plane, two unknowns each");
    }
    if let Some(material) = run::material(scene, sheet)? {
        let (modulus, rigidity) = (material.stretching_modulus(), material.bending_rigidity());
        let text = format!("Y = {modulus:.6e} force/length, B = {rigidity:.6e} energy");
        found.one("material", text);
    }
    let contributions = explain::contributions(simulation);
    for (number, (effect, parts)) in scene.effects.iter().zip(&contributions).enumerate() {
        let place = scene.written(&format!("effect[{number}]"));
        let place = place.map(|written| format!(" ({written})")).unwrap_or_default();
        let text = format!("{}{place}: {}", effect.name(), parts.join("; "));
        found.each("effect", text, effect.name());
    }
    Ok(())
}

/// Adds the law, its species, parameters and signals.
fn add_law(found: &mut Findings, scene: &Scene, simulation: &Simulation) {
    let Some(chemistry) = simulation.model().chemistry() else { return };
    let d = chemistry.descriptor();
    let version =
        if d.version.is_empty() { String::new() } else { format!(" {} ({})", d.version, d.id) };
    found.one("kinetics", format!("{}{version}", d.title()));
    let place = chemistry.location().nouns();
    for species in &d.species {
        found.each("species", format!("{} on {place}", species.name), species.name.as_str());
    }
    for (parameter, field) in d.parameters.iter().zip(&chemistry.parameters().at_points) {
        if field.len() > 1 {
            let text = format!("{} = {}", parameter.name, super::plugin::describe_field(field));
            found.each("parameter", &text, text.as_str());
        }
    }
    for signal in chemistry.signals().wanted() {
        found.each("signal", format!("{} [{}]", signal.name(), signal.unit()), signal.name());
    }
    for (what, _) in explain::boundary(scene, simulation) {
        found.each("boundary", &what, what.as_str());
    }
    if chemistry.location() == Location::Face && !chemistry.transports().is_empty() {
        let text = "the Green-Gauss scheme barely damps half of the face modes and does not converge on irregular \
                    meshes; it is meant for comparison with the paper";
        found.each("warning", text, text);
    }
}

/// Adds what is solved for.
fn add_unknowns(found: &mut Findings, scene: &Scene, simulation: &Simulation) {
    let model = simulation.model();
    if model.moves() {
        let (method, tolerance) = (scene.equilibrium.name(), simulation.force_tolerance());
        found.one("relaxation", format!("{method}, tolerance {tolerance:e}"));
        // On a planar sheet z is not a degree of freedom that a pin could fix.
        let (axes, rigid) = if model.mechanics().is_planar() { (2, 3) } else { (3, 6) };
        let pins = model.mechanics().pins();
        // Images of a periodic sheet move as their owners do.
        let pins = &pins[..model.sheet().reduction().owned(pins.len())];
        let fixed: usize = pins.iter().flat_map(|p| &p[..axes]).filter(|fixed| **fixed).count();
        let free = axes * pins.len() - fixed;
        let value = json!({ "positions": free, "fixed": fixed });
        found.each("unknowns", format!("{free} positions free, {fixed} fixed"), value);
        let motions = model.mechanics().free_motions();
        if motions > 0 {
            let text = format!(
                "pins leave {motions} of {rigid} rigid motions free: positions are \
                 determined up to these; strains and curvatures are unaffected"
            );
            found.more("free_motions", text);
        }
    } else {
        found.one("mechanics", "none: the shape does not move");
    }
    if let Some(chemistry) = model.chemistry() {
        let points = model.sheet().reduction().owned(chemistry.points(model.sheet()));
        let count = points * chemistry.descriptor().species.len();
        found.each("unknowns", format!("{count} values of species"), json!({ "species": count }));
    }
    for term in model.internal() {
        let (count, name) = (term.count(model.sheet()), term.name());
        found.each("unknowns", format!("{count} values of {name}"), json!({ name: count }));
    }
}
