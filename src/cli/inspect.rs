//! `rumple inspect SCENE --state FILE`: looks into one state.

use std::path::PathBuf;

use clap::Args;

use super::SceneArgs;
use crate::Result;
use crate::output::{Compression, atomic, vtu};
use crate::sheet::read;
use crate::simulation;
use crate::simulation::inspect;
use crate::simulation::stability::{StabilityReport, add_modes};

/// Arguments of `inspect`.
#[derive(Debug, Args)]
pub(super) struct InspectArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// The state: points are positions, arrays are species by name; the scene's start if absent.
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// Where to write the numbers; standard output if none of --json,
    /// --vtu and --stability is given.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Where to write a frame with the scene's output fields, and the modes if asked for.
    #[arg(long, visible_alias = "out", value_name = "FILE")]
    vtu: Option<PathBuf>,
    /// Relax the state before looking at it.
    #[arg(long)]
    relax: bool,
    /// Tell whether the state is a minimum or a saddle, with the smallest eigenvalues of the
    /// energy's Hessian; their modes go to the frame as vector fields.
    #[arg(long)]
    stability: bool,
    /// How many eigenvalues and modes.
    #[arg(long, value_name = "K", default_value_t = 4, requires = "stability",
          value_parser = clap::value_parser!(u16).range(1..))]
    modes: u16,
}

pub(super) fn run(args: &InspectArgs) -> Result<()> {
    let (scene, search) = args.scene.load()?;
    let mut setup = simulation::prepare(&scene, &search)?;
    if let Some(path) = &args.state {
        inspect::take_state(&mut setup, &read::surface(path)?)?;
    }
    if args.relax {
        setup.system.relax(&mut setup.state)?;
    }
    let stability = match args.stability {
        true => Some(StabilityReport::of(&mut setup, args.modes.into())?),
        false => None,
    };
    if let Some(report) = &stability {
        say!("{}", report.to_string().trim_end());
    }
    let mut result = inspect::inspect(&mut setup)?;
    if let (Some(report), Some(all)) = (&stability, result.as_object_mut()) {
        all.insert("stability".into(), report.to_json());
    }
    let text = serde_json::to_string(&result).unwrap_or_default();
    match &args.json {
        Some(path) => atomic::replace(path, |writer| writeln!(writer, "{text}"))?,
        None if args.vtu.is_none() && stability.is_none() => say!("{text}"),
        None => {}
    }
    if let Some(path) = &args.vtu {
        let mut frame = setup.fields.frame(&mut setup.system, &setup.sheet, &setup.state)?;
        if let Some(report) = &stability {
            add_modes(&mut frame, &report.spectrum.modes);
        }
        vtu::write(path, &frame, Compression::default())?;
    }
    Ok(())
}
