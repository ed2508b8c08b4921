//! Begins a study or resumes it, as the command line says.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use crate::cli::{SceneArgs, warn};
use crate::output::Interrupt;
use crate::run::{Error, Result};
use crate::scene::{OVER, Scene, SheetSource};
use crate::study::gather::gather;
use crate::study::plan::{Axis, Plan, seed_axis};
use crate::study::run::{Runs, Settings};
use crate::study::{Purpose, refinement};

pub(super) fn run(args: &PlanArgs) -> Result<()> {
    let scene = &args.scene;
    let varied = |set: &&String| {
        args.refine && set.split('=').next().is_some_and(|key| key.trim() == refinement::KEY)
    };
    let set: Vec<String> = scene.overrides.iter().filter(|set| !varied(set)).cloned().collect();
    let mut plan = Plan::new(&scene.scene, &set, axes(args)?)?;
    plan.level = args.level;
    configure_members(&mut plan, scene)?;
    begin(Purpose::Sweep, plan, &args.how, None)
}

/// Gives members what the command line says of threads and plugins.
pub(in crate::cli) fn configure_members(plan: &mut Plan, scene: &SceneArgs) -> Result<()> {
    let directories = crate::cli::defaults().search(&scene.plugin_path).directories().to_vec();
    plan.threads = scene.threads.unwrap_or(1);
    plan.plugin_path =
        directories.iter().map(|path| crate::cli::absolute(path)).collect::<Result<_>>()?;
    Ok(())
}

/// Begins `plan` with the options `how` of the command line, or resumes it; `jobs` runs at once if that is not given, or as
/// many as there are cores for.
pub(in crate::cli) fn begin(
    purpose: Purpose,
    mut plan: Plan,
    how: &HowArgs,
    jobs: Option<usize>,
) -> Result<()> {
    let root = how.out.clone().unwrap_or_else(|| {
        let stem = plan.scene.file_stem().unwrap_or("scene".as_ref()).to_string_lossy();
        PathBuf::from(format!("{stem}-{}", purpose.command()))
    });
    let root = crate::cli::absolute(&root)?;
    let program = std::env::current_exe()
        .map_err(|error| Error::Refused(format!("the program does not find itself: {error}")))?;
    let member = [program.as_os_str(), "sweep".as_ref(), "member".as_ref(), "--leash".as_ref()];
    let runs = Runs {
        purpose,
        member: member.map(ToOwned::to_owned).to_vec(),
        settings: Settings {
            jobs: how.jobs.map(usize::from).or(jobs),
            retry_failed: how.retry_failed,
            force: how.force,
            plan_only: how.plan,
        },
        happens: &|text| {
            if !how.quiet {
                warn(text)
            }
        },
        say: &|text| how.say(text),
    };
    let first = runs.seal(&mut plan, &root)?;
    let interrupt = Interrupt::install()?;
    let claim = runs.open(&plan, &root)?;
    let ended = runs.on(&plan, (&root, &claim), interrupt);
    // Before members have run there is nothing to be seen.
    crate::cli::view::write_report(&root, first.output.report && !how.plan);
    if how.json {
        let members = gather(&plan, &root).into_iter().map(|member| {
            json!({ "name": member.name, "status": member.status.to_string(), "reason": member.reason })
        });
        crate::cli::run::print_standing(&root, &[("members", members.collect())]);
    }
    ended
}

/// Meshes with up to four times the vertices of the scene with the first values of `axes`.
fn refined(args: &SceneArgs, axes: &[Axis]) -> Result<Axis> {
    if axes.iter().any(|axis| axis.key == refinement::KEY) {
        let message = "--refine varies sheet.vertices, as --over does; give one of the two";
        return Err(Error::Refused(message.into()));
    }
    let first: Vec<String> = axes.iter().flat_map(|axis| axis.overrides(0)).collect();
    match Scene::varied(&args.scene, &args.overrides, &first, OVER)?.sheet.source {
        SheetSource::Generated(shape) => Ok(refinement::axis(shape.vertices())),
        SheetSource::File { file } => Err(Error::Refused(format!(
            "--refine: the mesh is the file {}, which is not refined; give finer files: --over sheet.file=A,B,C",
            file.display()
        ))),
        SheetSource::Point { .. } => {
            Err(Error::Refused("--refine: the scene is a point, it has no mesh".into()))
        }
    }
}

/// The keys that are varied; seeds last.
fn axes(args: &PlanArgs) -> Result<Vec<Axis>> {
    let axes = args.over.iter().map(|text| Axis::parse(text).map_err(Error::Refused));
    let mut axes = axes.collect::<Result<Vec<_>>>()?;
    if args.refine {
        axes.push(refined(&args.scene, &axes)?);
    }
    if let Some(count) = args.seeds {
        let SceneArgs { scene, overrides, .. } = &args.scene;
        axes.push(seed_axis(scene, overrides, &axes, count.into())?);
    }
    Ok(axes)
}

/// Arguments that begin a sweep, or resume it; they are there with the scene.
#[derive(Debug, Args)]
#[group(args = ["scene"])]
pub(in crate::cli) struct PlanArgs {
    #[command(flatten)]
    pub(in crate::cli) scene: SceneArgs,
    /// A key of the scene and the values that it takes (see below); may be repeated.
    #[arg(long, value_name = "KEY=VALUES")]
    pub(in crate::cli) over: Vec<String>,
    /// Repeat every member on meshes of 1, 2 and 4 times as many vertices, for the order of convergence of every
    /// measure.
    #[arg(long)]
    pub(in crate::cli) refine: bool,
    /// Repeat every member with seeds 1 to N for everything random in the scene: mesh, imperfection,
    /// random starts.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(in crate::cli) seeds: Option<u16>,
    /// Value of the first species above which there is a spot; by default half way between its least and
    /// largest values.
    #[arg(long, value_name = "VALUE", allow_hyphen_values = true, value_parser = crate::cli::finite)]
    pub(in crate::cli) level: Option<f64>,
    #[command(flatten)]
    pub(in crate::cli) how: HowArgs,
}

/// Options of the runs of many members.
#[derive(Debug, Args)]
pub(in crate::cli) struct HowArgs {
    /// Directory for the results; by default named after the scene and the command.
    #[arg(short, long, value_name = "DIR")]
    pub(in crate::cli) out: Option<PathBuf>,
    /// Members at once; by default as many as there are cores for their --threads, which are 1 each if
    /// not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(in crate::cli) jobs: Option<u16>,
    /// Run members again that failed.
    #[arg(long)]
    pub(in crate::cli) retry_failed: bool,
    /// Replace an earlier sweep in that directory.
    #[arg(long)]
    pub(in crate::cli) force: bool,
    /// Print how the study ended as JSON, as status.json has it, with the directory and the members, in place of tables.
    #[arg(long)]
    pub(in crate::cli) json: bool,
    /// Print nothing but errors.
    #[arg(long)]
    pub(in crate::cli) quiet: bool,
    /// Write the plan and run nothing: `rumple sweep member DIR NUMBER` runs one member, as a task of an array job does.
    #[arg(long)]
    pub(in crate::cli) plan: bool,
}

impl HowArgs {
    /// Prints lines of results.
    pub(in crate::cli) fn say(&self, text: &str) {
        if !self.quiet && !self.json {
            say!("{text}");
        }
    }
}
