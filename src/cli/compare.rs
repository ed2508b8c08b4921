//! `rumple compare SCENE`: the same scene under several policies and integrators.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use clap::Args;

use super::output_directory::{claim, names, refuse, remove_file, remove_run};
use super::{SceneArgs, end};
use crate::kinetics::Search;
use crate::output::{Claim, Interrupt, Mode, Progress, ResultDirectory};
use crate::run::{Error, Result, Simulation};
use crate::scene::Scene;
use crate::solve::{Control, SolveError};
use crate::study::compare::{Member, Timescales, contact_sheet, csv, figure, member, table};
use crate::study::plan::integrator::{quoted, settings, table_of};
use crate::study::{draw, write_files};

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
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the results of an earlier comparison in that directory.
    #[arg(long)]
    force: bool,
    /// Print only the table.
    #[arg(long)]
    quiet: bool,
}

/// A member to be run.
struct Planned {
    name: String,
    scene: Scene,
}

pub(super) fn run(args: &CompareArgs) -> Result<()> {
    args.scene.with_threads(|| run_here(args))
}

fn run_here(args: &CompareArgs) -> Result<()> {
    let (_, search) = args.scene.load()?;
    let planned = plan(args)?;
    let stamp = || ResultDirectory::default_path(&args.scene.scene, SystemTime::now());
    // A plugin may change the working directory.
    let root = super::absolute(&args.out.clone().unwrap_or_else(stamp))?;
    let (scene, simulation) = start(args, &search)?;
    super::inputs(&scene, simulation.plugins()).outside(&root)?;
    let interrupt = Interrupt::install()?;
    let claim = make_room(&root, args.force)?;
    let outcome = announce(simulation, interrupt)
        .and_then(|()| work(args, &search, planned, &root, interrupt));
    let ended = end(&claim, outcome);
    super::view::report(&root, scene.output.report);
    ended
}

/// Runs all members; says how many came to their end.
fn work(
    args: &CompareArgs,
    search: &Search,
    planned: Vec<Planned>,
    root: &Path,
    interrupt: Interrupt,
) -> Result<String> {
    let mut members: Vec<Member> = Vec::new();
    for Planned { name, scene } in planned {
        let directory = root.join(folder(&name, members.len()));
        let mode = if args.quiet { Mode::Silent } else { Mode::detect() };
        let mut progress = Progress::new(mode, 0.0, scene.time.span.until.get());
        progress.message(&name);
        let outcome = member(
            &scene,
            search,
            &mut || ResultDirectory::prepare(&directory, args.force),
            &|simulation, directory| super::record(&scene, None, simulation, directory),
            &mut progress,
            interrupt,
        );
        progress.finish();
        if interrupt.requested() {
            if !members.is_empty() {
                say!("{}", table(&members).trim_end());
            }
            say!("{name}: interrupted; what it did is in {}", directory.display());
            return Err(Error::Solve(SolveError::Interrupted));
        }
        if let Err(error @ Error::Output(_)) = outcome {
            return Err(error);
        }
        members.push(Member { name, outcome });
        write(root, &members)?;
    }
    say!("{}", table(&members).trim_end());
    say!("tables of every output time, plots and pictures are in {}", root.display());
    let (all, ran) = (members.len(), members.iter().filter(|m| m.outcome.is_ok()).count());
    // A member that died ends the comparison as a run ends. Pairings that make no sense are expected
    // where all are tried; but if nothing ran there is nothing to compare.
    let expected = |error: &Error| {
        let pairing = matches!(error, Error::Scene(_) | Error::Solve(SolveError::Pairing(_)));
        ran > 0 && pairing
    };
    let mut errors = members.into_iter().filter_map(|m| m.outcome.err());
    if let Some(error) = errors.find(|error| !expected(error)) {
        if ran > 0 {
            say!("{ran} of {all} members finished; the first that did not:");
        }
        return Err(error);
    }
    Ok(format!("{ran} of {all} members finished"))
}

/// Every pairing, read before the first runs: a name that nothing has ends the comparison, a
/// pairing that makes no sense does not.
fn plan(args: &CompareArgs) -> Result<Vec<Planned>> {
    let one = |list: &[String]| -> Vec<Option<String>> {
        if list.is_empty() { vec![None] } else { list.iter().cloned().map(Some).collect() }
    };
    let integrators = one(&args.integrators);
    let pairs = one(&args.policies)
        .into_iter()
        .flat_map(|policy| integrators.iter().map(move |integrator| (policy.clone(), integrator)));
    let mut planned: Vec<Planned> = Vec::new();
    for (policy, integrator) in pairs {
        let policy = policy.map(|policy| format!("time.policy={}", quoted(&policy)));
        let table = integrator.as_ref().map(|i| format!("time.integrator={}", table_of(i)));
        // Those of the user hold for all members.
        let users = args.scene.overrides.iter().cloned();
        let overrides: Vec<String> = policy.into_iter().chain(table).chain(users).collect();
        let scene = Scene::load(&args.scene.scene, &overrides)?;
        let mut name = format!("{}, {}", scene.time.policy.name(), scene.time.integrator.name());
        if let Some(table) = integrator.as_ref().filter(|i| i.trim_start().starts_with('{')) {
            name += &settings(table, &[]);
        }
        if planned.iter().any(|p| p.name == name) {
            say!("{name}: listed twice, run once");
        } else {
            planned.push(Planned { name, scene });
        }
    }
    Ok(planned)
}

/// The scene set up with a policy and an integrator that go with every sheet.
fn start(args: &CompareArgs, search: &Search) -> Result<(Scene, Simulation)> {
    let mut overrides = args.scene.overrides.clone();
    let plain = [r#"time.policy="quasi-static""#, r#"time.integrator="staggered""#];
    overrides.extend(plain.map(str::to_owned));
    let scene = Scene::load(&args.scene.scene, &overrides)?;
    let simulation = Simulation::new(&scene, search)?;
    Ok((scene, simulation))
}

/// Prints the timescales at the start, whatever the scene's own pairing.
fn announce(mut simulation: Simulation, interrupt: Interrupt) -> Result<()> {
    simulation.set_control(Control::new(move || interrupt.requested(), |_| ()));
    simulation.relax()?;
    match Timescales::of(&mut simulation) {
        Ok(Some(timescales)) => say!("{}", timescales.verdict()),
        Ok(None) => {}
        Err(error) => say!("the timescales are not known: {error}"),
    }
    Ok(())
}

/// Writes numbers, plots and pictures.
fn write(root: &Path, members: &[Member]) -> Result<()> {
    let mut files = draw::files(PLOTS, &figure(members))?.to_vec();
    files.push((TABLE.to_owned(), csv(members).into_bytes()));
    if let Some(pictures) = contact_sheet(members)? {
        files.push((PICTURES.to_owned(), pictures.png()?));
    }
    write_files(root, files)
}

fn folder(name: &str, number: usize) -> String {
    let plain: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    let words: Vec<&str> = plain.split('-').filter(|word| !word.is_empty()).collect();
    format!("{}-{}", number + 1, words.join("-").to_lowercase())
}

const TABLE: &str = "compare.csv";
/// Name of the plots, as SVG and as PNG.
const PLOTS: &str = "compare";
const PICTURES: &str = "pictures.png";

/// Makes room in `root`, and the directory where there is none: what a comparison would write over
/// is refused, or removed with `force`. Whatever else is there stays.
fn make_room(root: &Path, force: bool) -> Result<Claim> {
    let (claim, ours) = claim(root, || check(root, force))?;
    for path in ours.iter().map(|name| root.join(name)) {
        if is_member(&path) { remove_run(&path)? } else { remove_file(&path)? }
    }
    claim.begin()?;
    Ok(claim)
}

/// The names in `root` of what a comparison writes, members first.
fn check(root: &Path, force: bool) -> Result<Vec<String>> {
    let report = ResultDirectory::REPORT;
    let written = [TABLE, "compare.svg", "compare.png", PICTURES, report, Claim::STATUS];
    let ours = |name: &String| written.contains(&name.as_str()) || is_member(&root.join(name));
    let ours: Vec<String> = names(root)?.into_iter().filter(ours).collect();
    let Some(first) = ours.first() else { return Ok(ours) };
    if !force {
        let member = is_member(&root.join(first));
        let what = if member { "an earlier comparison".into() } else { format!("`{first}`") };
        let how = "choose another with --out, or --force to replace it";
        return refuse(root, format!("it holds {what}: {how}"));
    }
    if root.is_symlink() {
        let message = "is a link, and nothing is removed through a link; give the directory itself";
        return refuse(root, message);
    }
    let link = |name: &&String| is_member(&root.join(name)) && root.join(name).is_symlink();
    match ours.iter().find(link) {
        Some(name) => refuse(root, format!("`{name}` in it is a link, which is not followed")),
        None => Ok(ours),
    }
}

/// Whether a folder is that of a member: `1-quasi-static-staggered`, with a run in it.
fn is_member(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let number = name.split('-').next().unwrap_or_default();
    !number.is_empty()
        && number.chars().all(|c| c.is_ascii_digit())
        && name.contains('-')
        && ["ledger.csv", Claim::STATUS].iter().any(|file| path.join(file).is_file())
}
