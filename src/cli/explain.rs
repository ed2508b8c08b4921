//! `rumple explain SCENE`: what a scene calls for and why; `rumple explain DIR`: what a run cost.

use std::time::Duration;

use clap::Args;

use super::SceneArgs;
use crate::run::{Costs, Explanation, Result, Simulation};

/// Arguments of `explain`.
#[derive(Debug, Args)]
pub(super) struct ExplainArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Seconds that may be spent on first steps, which say how long a run takes; 0 for none.
    #[arg(long, value_name = "S", default_value_t = 3.0, value_parser = seconds)]
    predict: f64,
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
    let mut simulation = Simulation::new(&scene, &search)?;
    let mut explanation = Explanation::of(&scene, &mut simulation)?;
    if args.predict > 0.0 {
        explanation.predict(&scene, &mut simulation, Duration::from_secs_f64(args.predict));
    }
    show(args.json, &explanation);
    Ok(())
}

/// A number of seconds, not negative, for which one may wait.
fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| (0.0..1e6).contains(seconds));
    seconds.ok_or_else(|| format!("{text:?} is not a number of seconds from 0 on"))
}

fn show<T: serde::Serialize + std::fmt::Display>(json: bool, what: &T) {
    if json {
        say!("{}", serde_json::to_string_pretty(what).unwrap_or_default());
    } else {
        say!("{}", what.to_string().trim_end());
    }
}
