//! `rumple explain SCENE`: what a scene calls for and why; `rumple explain DIR`: what a run cost.

use clap::Args;

use super::SceneArgs;
use crate::run::{Costs, Explanation, Result, Simulation};

/// Arguments of `explain`.
#[derive(Debug, Args)]
pub(super) struct ExplainArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Print it as JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &ExplainArgs) -> Result<()> {
    if args.scene.scene.is_dir() {
        let costs = Costs::read(&args.scene.scene)?;
        show(args.json, &costs);
        return Ok(());
    }
    let (scene, search) = args.scene.load()?;
    let simulation = Simulation::new(&scene, &search)?;
    let explanation = Explanation::new(&scene, &simulation);
    show(args.json, &explanation);
    Ok(())
}

fn show<T: serde::Serialize + std::fmt::Display>(json: bool, what: &T) {
    if json {
        say!("{}", serde_json::to_string_pretty(what).unwrap_or_default());
    } else {
        say!("{}", what.to_string().trim_end());
    }
}
