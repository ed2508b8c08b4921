//! Begins a study or resumes it, as the command line says.

use std::path::{Path, PathBuf};

use super::{HowArgs, PlanArgs, gathered};
use crate::cli::{SceneArgs, warn};
use crate::kinetics::PluginSearch;
use crate::output::Interrupt;
use crate::run::{Error, Result};
use crate::scene::{Scene, SheetSource};
use crate::study::plan::{Axis, Plan, seed_axis};
use crate::study::refinement;
use crate::study::run::{self, Settings, SlurmSettings};

pub(super) fn run(args: &PlanArgs) -> Result<()> {
    let scene = &args.scene;
    let varied = |set: &&String| {
        args.refine && set.split('=').next().is_some_and(|key| key.trim() == refinement::KEY)
    };
    let set: Vec<String> = scene.overrides.iter().filter(|set| !varied(set)).cloned().collect();
    let mut plan = Plan::new(&scene.scene, &set, axes(args)?)?;
    plan.level = args.level;
    configure_members(&mut plan, scene)?;
    let (how, check, prepare) = (&args.how, &|_: &Plan| Ok(()), &|_: &Path| Ok(()));
    let gather = &|plan: &Plan, root: &Path| gathered(plan, root, how.quiet, true);
    Runs { command: "sweep", how, jobs: None, check, prepare, gather }.on(plan)
}

/// Gives members what the command line says of threads and plugins.
pub(in crate::cli) fn configure_members(plan: &mut Plan, scene: &SceneArgs) -> Result<()> {
    let directories = PluginSearch::from_environment(&scene.plugin_path).directories().to_vec();
    plan.threads = scene.threads.unwrap_or(1);
    plan.plugin_path =
        directories.iter().map(|path| crate::cli::absolute(path)).collect::<Result<_>>()?;
    Ok(())
}

/// Runs of many members that a command makes, and what is made of them.
pub(in crate::cli) struct Runs<'a> {
    /// The command that makes them.
    pub(in crate::cli) command: &'a str,
    /// Options of the command line.
    pub(in crate::cli) how: &'a HowArgs,
    /// Default count of simultaneous runs; as many as there are cores for, if not given.
    pub(in crate::cli) jobs: Option<usize>,
    /// Refuses a plan before anything is written.
    pub(in crate::cli) check: &'a dyn Fn(&Plan) -> Result<()>,
    /// Prepares the directory before any is run.
    pub(in crate::cli) prepare: &'a dyn Fn(&Path) -> Result<()>,
    /// Gathers what there is of a plan in a directory; says how it stands.
    pub(in crate::cli) gather: &'a dyn Fn(&Plan, &Path) -> Result<String>,
}

impl Runs<'_> {
    /// Begins `plan`, or resumes it.
    pub(in crate::cli) fn on(&self, mut plan: Plan) -> Result<()> {
        let Self { command, how, check, prepare, gather, .. } = *self;
        let root = how.out.clone().unwrap_or_else(|| {
            let stem = plan.scene.file_stem().unwrap_or("scene".as_ref()).to_string_lossy();
            PathBuf::from(format!("{stem}-{command}"))
        });
        let root = crate::cli::absolute(&root)?;
        let program = std::env::current_exe().map_err(|error| {
            Error::Refused(format!("the program does not find itself: {error}"))
        })?;
        let member = [program.as_os_str(), "sweep".as_ref(), "member".as_ref(), "--leash".as_ref()];
        let runs = run::Runs {
            command,
            member: member.map(ToOwned::to_owned).to_vec(),
            settings: Settings {
                jobs: how.jobs.map(usize::from).or(self.jobs.filter(|_| !how.slurm)),
                memory: how.memory,
                retry_failed: how.retry_failed,
                force: how.force,
                slurm: how.slurm.then(|| SlurmSettings {
                    program,
                    options: how.slurm_option.clone(),
                    submit: !how.no_submit,
                }),
            },
            check,
            prepare,
            gather,
            happens: &|text| {
                if !how.quiet {
                    warn(text)
                }
            },
            submitted: &|text| {
                if !how.quiet {
                    say!("{text}")
                }
            },
        };
        let first = runs.seal(&mut plan, &root)?;
        let interrupt = Interrupt::install()?;
        let claim = runs.open(&plan, &root)?;
        let ended = runs.on(&plan, (&root, &claim), interrupt);
        // Before the members of an array job have run there is nothing to be seen.
        crate::cli::view::write_report(&root, first.output.report && !how.slurm);
        ended
    }
}

/// Meshes with up to four times the vertices of the scene with the first values of `axes`.
fn refined(args: &SceneArgs, axes: &[Axis]) -> Result<Axis> {
    let first: Vec<String> = axes.iter().flat_map(|axis| axis.overrides(0)).collect();
    match Scene::varied(&args.scene, &args.overrides, &first)?.sheet.source {
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
