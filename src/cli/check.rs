//! `rumple check SCENE`: says whether a scene can run, and what it calls for.

use clap::Args;

use super::SceneArgs;
use crate::Result;
use crate::kinetics::Location;
use crate::sheet::MeshReport;
use crate::simulation;

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
    let (scene, search) = args.scene.load()?;
    let mut setup = simulation::prepare(&scene, &search)?;
    // The start must be one that every effect and the plugin can evaluate.
    setup.system.follow(&setup.state)?;
    setup.notes.extend(simulation::laws::try_out(&mut setup.system, &setup.state)?);
    if args.resolved {
        print!("{}", scene.resolved()?);
        return Ok(());
    }
    println!("{}: ready to run", scene.name());
    if setup.sheet.triangles().is_empty() {
        println!("sheet      none: one point");
    } else {
        println!("sheet\n{}", MeshReport::new(&setup.sheet));
    }
    if scene.material.is_some() {
        let material = simulation::material(&scene);
        println!(
            "material   Y = {:.6e} force/length, B = {:.6e} energy",
            material.stretching_modulus(),
            material.bending_rigidity()
        );
    }
    for effect in &scene.effects {
        println!("effect     {}", effect.name());
    }
    if let Some(chemistry) = setup.system.chemistry() {
        let d = chemistry.descriptor();
        println!("kinetics   {} {} ({})", d.name, d.version, d.id);
        for species in &d.species {
            println!("species    {} on {}", species.name, chemistry.location().nouns());
        }
        for signal in chemistry.signals().wanted() {
            println!("signal     {} [{}]", signal.name(), signal.unit());
        }
        if chemistry.location() == Location::Face && !chemistry.transport().is_empty() {
            println!(
                "warning    the Green-Gauss scheme hardly damps half of the face modes and does \
                 not converge on irregular meshes; it is meant for comparison with the paper"
            );
        }
    }
    println!("policy     {}", scene.time.policy.name());
    println!("integrator {}", scene.time.integrator.name());
    if setup.system.moves() {
        println!(
            "relaxation {}, tolerance {:e}",
            scene.equilibrium.name(),
            scene.equilibrium.tolerance()
        );
        let held: usize =
            setup.system.mechanics().pins().iter().flatten().filter(|held| **held).count();
        let free = 3 * setup.sheet.vertex_count() - held;
        println!("unknowns   {free} positions free, {held} held");
    } else {
        println!("mechanics  none: the shape does not move");
    }
    if let Some(chemistry) = setup.system.chemistry() {
        let (points, species) =
            (chemistry.points(&setup.sheet), chemistry.descriptor().species.len());
        println!("unknowns   {} values of species", points * species);
    }
    let flat = setup.state.x.iter().all(|x| x.z == setup.state.x[0].z);
    if flat && !setup.system.mechanics().is_empty() {
        println!(
            "warning    the start is perfectly flat: only forces out of the plane leave it, even where \
             it is a saddle; give sheet.imperfection or sheet.bump to say how the symmetry is broken"
        );
    }
    for note in &setup.notes {
        println!("note       {note}");
    }
    Ok(())
}
