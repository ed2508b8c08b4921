//! `rumple compare SCENE`: the same scene under several policies and integrators.

use std::path::PathBuf;
use std::time::SystemTime;

use clap::Args;

use super::SceneArgs;
use crate::output::{Interrupt, Mode, Progress, ResultDirectory};
use crate::run::Result;
use crate::scene::Scene;
use crate::study::compare::{Comparison, Reports};

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub(super) struct CompareArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Policies, as in `quasi-static,simultaneous`; without it, that of the scene.
    #[arg(long, value_delimiter = ',', value_name = "NAME,…")]
    policies: Vec<String>,
    /// An integrator: a name, with its defaults, or a table as in `{ kind = "monolithic", method =
    /// "tr-bdf2" }`; may be repeated. Without it, that of the scene with its settings.
    #[arg(long = "integrator", value_name = "NAME|TABLE")]
    integrators: Vec<String>,
    /// Directory for the results, one folder per member; by default the scene's name with the time.
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the results of an earlier comparison in that directory.
    #[arg(long)]
    force: bool,
    /// Print only the table.
    #[arg(long)]
    quiet: bool,
}

pub(super) fn run(args: &CompareArgs) -> Result<()> {
    args.scene.with_threads(|| run_in_pool(args))
}

fn run_in_pool(args: &CompareArgs) -> Result<()> {
    let (_, search) = args.scene.load()?;
    let comparison = Comparison {
        scene: &args.scene.scene,
        set: &args.scene.overrides,
        policies: &args.policies,
        integrators: &args.integrators,
        search: &search,
        force: args.force,
    };
    let say = |text: &str| say!("{text}");
    let planned = comparison.plan(&say)?;
    let stamp = || ResultDirectory::default_path(&args.scene.scene, SystemTime::now());
    // A plugin may change the working directory.
    let root = super::absolute(&args.out.clone().unwrap_or_else(stamp))?;
    let (scene, simulation) = comparison.start(&root)?;
    let interrupt = Interrupt::install()?;
    let claim = comparison.open(&root)?;
    let progress = |scene: &Scene| {
        let mode = if args.quiet { Mode::Silent } else { Mode::detect() };
        Progress::new(mode, scene.time.span.until.get())
    };
    let reports = Reports { progress: &progress, say: &say };
    let ended = comparison.on((planned, simulation), (&root, &claim), &reports, interrupt);
    super::view::write_report(&root, scene.output.report);
    ended
}
