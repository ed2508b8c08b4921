//! `rumple inspect SCENE --state FILE`: looks into one state.

use std::path::PathBuf;

use clap::Args;

use super::SceneArgs;
use crate::Result;
use crate::output::{Compression, atomic, vtu};
use crate::sheet::read;
use crate::simulation;
use crate::simulation::inspect;

/// Arguments of `inspect`.
#[derive(Debug, Args)]
pub(super) struct InspectArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// The state: points are positions, arrays are species by name; the scene's start if absent.
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    /// Where to write the numbers; standard output if neither --json nor --vtu is given.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Where to write a frame with the scene's output fields.
    #[arg(long, value_name = "FILE")]
    vtu: Option<PathBuf>,
}

pub(super) fn run(args: &InspectArgs) -> Result<()> {
    let (scene, search) = args.scene.load()?;
    let mut setup = simulation::prepare(&scene, &search)?;
    if let Some(path) = &args.state {
        inspect::take_state(&mut setup, &read::surface(path)?)?;
    }
    let result = inspect::inspect(&mut setup)?;
    let text = serde_json::to_string(&result).unwrap_or_default();
    match &args.json {
        Some(path) => atomic::replace(path, |writer| writeln!(writer, "{text}"))?,
        None if args.vtu.is_none() => println!("{text}"),
        None => {}
    }
    if let Some(path) = &args.vtu {
        let frame = setup.fields.frame(&mut setup.system, &setup.sheet, &setup.state)?;
        vtu::write(path, &frame, Compression::default())?;
    }
    Ok(())
}
