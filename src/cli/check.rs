//! `rumple check SCENE`: says whether a scene can run, and what it calls for.

use std::sync::Arc;

use clap::Args;

use super::SceneArgs;
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
    say!("{}: ready to run", scene.name());
    print_sheet(&scene, &simulation)?;
    print_law(&simulation);
    say!("policy     {}", scene.time.policy.name());
    say!("integrator {}", scene.time.integrator.name());
    if simulation.model().moves() {
        explain::stabilisation(&scene).iter().for_each(|line| say!("           {line}"));
    }
    for (k, line) in stiffness.iter().enumerate() {
        say!("{:<10} {line}", if k == 0 { "stiffness" } else { "" });
    }
    if let Some(after) = simulation.stepper.integrator.renewed_after() {
        say!(
            "           the history of past steps cannot be checkpointed: it restarts from the state every {after} steps, \
             and checkpoints are written there"
        );
    }
    print_unknowns(&scene, &simulation);
    let flat = simulation.stepper.state.x.iter().all(|x| x.z == simulation.stepper.state.x[0].z);
    let mechanics = simulation.model().mechanics();
    let pushed =
        mechanics.names().any(|name| name.starts_with("pressure") || name.starts_with("load"));
    if flat && !pushed && !mechanics.is_planar() && !mechanics.is_empty() {
        say!(
            "warning    the initial shape is perfectly flat, and only forces out of the plane \
             move it out of it, even from a saddle; give sheet.imperfection or sheet.bump to \
             break the symmetry"
        );
    }
    if let Some(listed) = simulation.stepper.breakpoints.listed() {
        say!("steps      {listed}");
    }
    print_notes(&simulation);
    Ok(())
}

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
    say!("{}: ready to run on {} ranks", scene.name(), ranks.size());
    say!(
        "           `rumple check` in one process describes the whole sheet, its laws and unknowns"
    );
    print_notes(&simulation);
    Ok(())
}

fn print_notes(simulation: &Simulation) {
    for note in &simulation.notes {
        match note.strip_prefix("warning: ") {
            Some(warning) => say!("warning    {warning}"),
            None => say!("note       {note}"),
        }
    }
}

/// Prints the sheet, its material and the effects on it.
fn print_sheet(scene: &Scene, simulation: &Simulation) -> Result<()> {
    let model = simulation.model();
    if model.sheet().triangles().is_empty() {
        say!("sheet      none: one point");
    } else {
        say!("sheet\n{}", MeshReport::new(model.sheet()));
    }
    if model.mechanics().is_planar() {
        say!("           planar: vertices move in their plane, two unknowns each");
    }
    if let Some(material) = run::material(scene, model.sheet())? {
        say!(
            "material   Y = {:.6e} force/length, B = {:.6e} energy",
            material.stretching_modulus(),
            material.bending_rigidity()
        );
    }
    for effect in &scene.effects {
        say!("effect     {}", effect.name());
    }
    Ok(())
}

/// Prints the law, its species, parameters and signals.
fn print_law(simulation: &Simulation) {
    let Some(chemistry) = simulation.model().chemistry() else { return };
    let d = chemistry.descriptor();
    say!(
        "kinetics   {}{}",
        d.title(),
        if d.version.is_empty() { String::new() } else { format!(" {} ({})", d.version, d.id) }
    );
    for species in &d.species {
        say!("species    {} on {}", species.name, chemistry.location().nouns());
    }
    for (parameter, field) in d.parameters.iter().zip(&chemistry.parameters().at_points) {
        if field.len() > 1 {
            say!("parameter  {} = {}", parameter.name, super::plugin::describe_field(field));
        }
    }
    for signal in chemistry.signals().wanted() {
        say!("signal     {} [{}]", signal.name(), signal.unit());
    }
    if chemistry.location() == Location::Face && !chemistry.transports().is_empty() {
        say!(
            "warning    the Green-Gauss scheme barely damps half of the face modes and does \
             not converge on irregular meshes; it is meant for comparison with the paper"
        );
    }
}

/// Prints what is solved for.
fn print_unknowns(scene: &Scene, simulation: &Simulation) {
    let model = simulation.model();
    if model.moves() {
        say!(
            "relaxation {}, tolerance {:e}",
            scene.equilibrium.name(),
            simulation.force_tolerance()
        );
        // On a planar sheet z is not a degree of freedom that a pin could fix.
        let (axes, rigid) = if model.mechanics().is_planar() { (2, 3) } else { (3, 6) };
        let pins = model.mechanics().pins();
        // Images of a periodic sheet move as their owners do.
        let pins = &pins[..model.sheet().reduction().owned(pins.len())];
        let fixed: usize = pins.iter().flat_map(|p| &p[..axes]).filter(|fixed| **fixed).count();
        let free = axes * pins.len() - fixed;
        say!("unknowns   {free} positions free, {fixed} fixed");
        let motions = model.mechanics().free_motions();
        if motions > 0 {
            say!(
                "           pins leave {motions} of {rigid} rigid motions free: positions are \
                 determined up to these; strains and curvatures are unaffected"
            );
        }
    } else {
        say!("mechanics  none: the shape does not move");
    }
    if let Some(chemistry) = model.chemistry() {
        let points = model.sheet().reduction().owned(chemistry.points(model.sheet()));
        let species = chemistry.descriptor().species.len();
        say!("unknowns   {} values of species", points * species);
    }
}
