//! `rumple accuracy SCENE`: what accuracy costs, as a picture and a sentence.

use clap::Args;
use clap::parser::ValueSource;

use super::sweep::begin::{begin, configure_members};
use super::sweep::{HowArgs, show};
use super::{SceneArgs, absolute, warn};
use crate::num::Short;
use crate::num::checked::Positive;
use crate::run::{Error, Result, Simulation};
use crate::study::Purpose;
use crate::study::accuracy::{Quantity, Study, StudyOptions};
use crate::study::plan::{Axis, Plan};

/// Arguments of `accuracy`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
#[command(mut_arg("jobs", |jobs| jobs.help("Runs at once, 1 by default.")))]
pub(super) struct AccuracyArgs {
    /// A scene; or the directory of a study, to gather what there is of it.
    #[command(flatten)]
    scene: SceneArgs,
    /// An integrator: a name, or a table as in `{ kind = "monolithic", linear = "ilu" }`; may be repeated.
    /// Without it, the usual ones of the scene's policy.
    #[arg(long = "integrator", value_name = "NAME|TABLE")]
    integrators: Vec<String>,
    /// Tolerances, as values of `sweep --over`: a list or a range. Of a method with fixed steps, steps as a
    /// share of the whole time. 1e-1,1e-2,1e-3,1e-4 if not given.
    #[arg(long, value_name = "VALUES")]
    tolerances: Option<String>,
    /// The error that you can live with, as a share; 0.01 if not given.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    want: Option<f64>,
    /// Quantity whose error is measured; by default the field that changes most, or the number of regions above the level, `spots`, after
    /// the trajectories diverge.
    #[arg(long, value_name = "QUANTITY")]
    of: Option<Quantity>,
    /// An integrator for the references, 100 times tighter than the tightest tolerance; may be repeated: the first one
    /// is confirmed by the second. Without it monolithic ESDIRK34 and BDF, or staggered 10 times tighter.
    #[arg(long = "reference", value_name = "NAME|TABLE")]
    references: Vec<String>,
    /// Runs with other seeds, whose spread bounds the error that is meaningful from below; 2 by default.
    #[arg(long, value_name = "N")]
    seeds: Option<u16>,
    /// Wall time of a run, whole seconds, 300 if not given; references may take 5 times as long.
    #[arg(long, value_name = "S", value_parser = whole_seconds)]
    limit: Option<u64>,
    /// Value of the first species above which there is a spot; by default half way between its least and
    /// largest values.
    #[arg(long, value_name = "VALUE", allow_hyphen_values = true, value_parser = crate::cli::finite)]
    level: Option<f64>,
    #[command(flatten)]
    how: HowArgs,
}

const EXAMPLES: &str = "\
Examples:
  rumple accuracy scene.toml
  rumple accuracy scene.toml --want 0.05 --of spots --tolerances 1e-1..1e-3:5:log
  rumple accuracy scene.toml --set time.policy=simultaneous
  rumple accuracy scene-accuracy                                     gather what there is

Runs are made one at a time, so that they do not disturb one another's times; --jobs N makes N at once.
The same command again continues an interrupted study. Runs that fail or take too long are shown as such; exit
code 1 if no reference came to its end, or a run ended without a word.";

pub(super) fn run(args: &AccuracyArgs, command: &clap::Command) -> Result<()> {
    if let Some(want) = args.want.filter(|want| *want >= 1.0 && !args.how.quiet) {
        warn(&format!("--want {want}: an error of {} %; 0.01 is 1 %", Short(100.0 * want)));
    }
    let path = &args.scene.scene;
    if path.is_dir() {
        let root = absolute(path)?;
        let Some(study) = Study::read(&root)? else {
            let (path, file) = (path.display(), Study::FILE);
            return Err(Error::Refused(format!(
                "{path}: no {file}: expected a scene, or the directory of a study"
            )));
        };
        let plan = Plan::load(&root)?;
        refuse_for_directory(command)?;
        if let Some(of) = args.of {
            of.check(Simulation::new(&plan.scene(0)?, &plan.search())?.model())?;
        }
        let study =
            Study { of: args.of.or(study.of), wanted: args.want.unwrap_or(study.wanted), ..study };
        return show(&Purpose::Accuracy(study), &plan, &root, args.how.quiet);
    }
    let scene = &args.scene;
    let search = super::defaults().search(&scene.plugin_path);
    let (study, mut plan) = Study::plan(&scene.scene, &scene.overrides, &search, &options(args)?)?;
    plan.level = args.level;
    configure_members(&mut plan, scene)?;
    begin(Purpose::Accuracy(study), plan, &args.how, Some(1))
}

fn share(text: &str) -> std::result::Result<f64, String> {
    let number = text.parse().ok().filter(|share: &f64| *share > 0.0 && share.is_finite());
    number.ok_or_else(|| "expected a share above 0, as 0.01".to_owned())
}

fn whole_seconds(text: &str) -> std::result::Result<u64, String> {
    let number = text.parse().ok().filter(|seconds: &u64| *seconds > 0);
    number.ok_or_else(|| "expected a whole number of seconds, 1 or more".to_owned())
}

/// What was made is gathered: what would make other runs, or make runs otherwise, is refused.
fn refuse_for_directory(command: &clap::Command) -> Result<()> {
    let matches = command.clone().get_matches();
    let Some((name, given)) = matches.subcommand() else { return Ok(()) };
    let options = command.find_subcommand(name).into_iter().flat_map(clap::Command::get_arguments);
    let mut options = options.filter_map(|option| Some((option.get_id(), option.get_long()?)));
    let other = |(id, option): &(&clap::Id, &str)| {
        given.value_source(id.as_str()) == Some(ValueSource::CommandLine)
            && !["want", "of", "quiet"].contains(option)
    };
    let Some((_, option)) = options.find(other) else { return Ok(()) };
    Err(Error::Refused(format!(
        "--{option} belongs to a scene; of a study that was made --want and --of can be given"
    )))
}

fn options(args: &AccuracyArgs) -> Result<StudyOptions> {
    let usual = StudyOptions::default();
    Ok(StudyOptions {
        integrators: args.integrators.clone(),
        tolerances: args
            .tolerances
            .as_deref()
            .map_or(Ok(usual.tolerances), |text| numbers("--tolerances", text))?,
        references: args.references.clone(),
        seeds: args.seeds.unwrap_or(usual.seeds),
        limit: args.limit.unwrap_or(usual.limit),
        wanted: args.want.unwrap_or(usual.wanted),
        of: args.of,
    })
}

/// Numbers between 0 and 1 from a list or a range.
fn numbers(option: &str, text: &str) -> Result<Vec<Positive>> {
    let refuse = |what: &str| Error::Refused(format!("{option} {text}: {what}"));
    let axis = Axis::parse(&format!("{}={text}", option.trim_start_matches('-')))
        .map_err(|what| refuse(what.split_once(": ").map_or(&what, |(_, what)| what)))?;
    let number = |value: &String| match value.parse().ok().and_then(Positive::new) {
        Some(number) if number.get() < 1.0 => Ok(number),
        _ => Err(refuse(&format!("`{value}` is not a number between 0 and 1"))),
    };
    axis.values.iter().map(number).collect()
}
