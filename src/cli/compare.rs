//! `rumple compare SCENE`: the same scene under several policies and integrators.

use clap::Args;

use super::SceneArgs;
use super::sweep::HowArgs;
use super::sweep::begin::{begin, configure_members};
use crate::run::Result;
use crate::study::{Purpose, compare};

/// Arguments of `compare`.
#[derive(Debug, Args)]
#[command(after_help = HELP)]
#[command(mut_arg("jobs", |jobs| jobs.help("Runs at once, 1 by default.")))]
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
    #[command(flatten)]
    how: HowArgs,
}

const HELP: &str = "\
Runs are made one at a time, with one thread each if --threads is not given, so that they do not disturb one
another's times. The same command again continues an interrupted comparison; rumple sweep collect DIR gathers
what there is. Exit code 1 if members failed.";

pub(super) fn run(args: &CompareArgs) -> Result<()> {
    let (scene, how) = (&args.scene, &args.how);
    let (_, search) = scene.load()?;
    let lists = [&args.policies[..], &args.integrators[..]];
    let say = |text: &str| how.say(text);
    let mut plan = compare::plan(&scene.scene, &scene.overrides, lists, &search, &say)?;
    configure_members(&mut plan, scene)?;
    begin(Purpose::Compare, plan, how, Some(1))
}
