//! A comparison in a directory: its members planned, run one after the other, and drawn.

use std::path::Path;

use super::{Member, Timescales, csv, figure, member, table};
use crate::kinetics::PluginSearch;
use crate::output::plot::{self, Block, Plot};
use crate::output::{Claim, Interrupt, Progress, ResultDirectory};
use crate::run::{Error, Result, Simulation, provenance, run};
use crate::scene::Scene;
use crate::solve::{Control, SolveError};
use crate::study::directory::{claim, names, refuse, remove_file, remove_run};
use crate::study::plan::integrator::{quoted, settings, table_of};
use crate::study::write_files;

/// What a comparison is of.
#[derive(Debug, Clone, Copy)]
pub struct Comparison<'a> {
    /// The scene file.
    pub scene: &'a Path,
    /// Overrides that hold for all members.
    pub set: &'a [String],
    /// Names of policies; that of the scene if there are none.
    pub policies: &'a [String],
    /// Integrators, names or tables; that of the scene if there are none.
    pub integrators: &'a [String],
    /// Where plugins are looked for.
    pub search: &'a PluginSearch,
    /// Whether an earlier comparison in the directory is replaced.
    pub force: bool,
}

/// A member to be run.
pub struct Planned {
    name: String,
    scene: Scene,
}

/// How a comparison shows its progress.
pub struct Reports<'a> {
    /// Makes the progress of the member of a scene.
    pub progress: &'a dyn Fn(&Scene) -> Progress,
    /// Called with lines of results.
    pub say: &'a dyn Fn(&str),
}

impl Comparison<'_> {
    /// Every pairing, read before the first runs: a name that nothing has ends the comparison, a
    /// pairing that makes no sense does not.
    ///
    /// # Errors
    /// A scene, a policy or an integrator that is not valid.
    pub fn plan(&self, say: &dyn Fn(&str)) -> Result<Vec<Planned>> {
        let one = |list: &[String]| -> Vec<Option<String>> {
            if list.is_empty() { vec![None] } else { list.iter().cloned().map(Some).collect() }
        };
        let integrators = one(self.integrators);
        let pairs = one(self.policies).into_iter().flat_map(|policy| {
            integrators.iter().map(move |integrator| (policy.clone(), integrator))
        });
        let mut planned: Vec<Planned> = Vec::new();
        for (policy, integrator) in pairs {
            let policy = policy.map(|policy| format!("time.policy={}", quoted(&policy)));
            let table = integrator.as_ref().map(|i| format!("time.integrator={}", table_of(i)));
            // Those of the user hold for all members.
            let users = self.set.iter().cloned();
            let overrides: Vec<String> = policy.into_iter().chain(table).chain(users).collect();
            let scene = Scene::load(self.scene, &overrides)?;
            let mut name =
                format!("{}, {}", scene.time.policy.name(), scene.time.integrator.name());
            if let Some(table) = integrator.as_ref().filter(|i| i.trim_start().starts_with('{')) {
                name += &settings(table, &[]);
            }
            if planned.iter().any(|p| p.name == name) {
                say(&format!("{name}: listed twice, run once"));
            } else {
                planned.push(Planned { name, scene });
            }
        }
        Ok(planned)
    }

    /// The scene set up with a policy and an integrator that go with every sheet.
    ///
    /// # Errors
    /// A scene that cannot be set up; inputs of it that lie in `root`.
    pub fn start(&self, root: &Path) -> Result<(Scene, Simulation)> {
        let mut overrides = self.set.to_vec();
        let plain = [r#"time.policy="quasi-static""#, r#"time.integrator="staggered""#];
        overrides.extend(plain.map(str::to_owned));
        let scene = Scene::load(self.scene, &overrides)?;
        let simulation = Simulation::new(&scene, self.search)?;
        provenance::inputs(&scene, simulation.plugins()).outside(root)?;
        Ok((scene, simulation))
    }

    /// Makes room in `root`, and the directory where there is none: what a comparison would write over
    /// is refused, or removed if that is wanted. Whatever else is there stays.
    ///
    /// # Errors
    /// A directory that is refused, and why; from the operating system.
    pub fn open(&self, root: &Path) -> Result<Claim> {
        let (claim, ours) = claim(root, || check(root, self.force))?;
        for path in ours.iter().map(|name| root.join(name)) {
            if is_member(&path) { remove_run(&path)? } else { remove_file(&path)? }
        }
        claim.begin()?;
        Ok(claim)
    }

    /// Runs the members `planned` in `root`, which `claim` has [opened](Self::open), after the time scales of `start`; the
    /// members.
    ///
    /// # Errors
    /// An interruption, results that cannot be written, a member that died, or no member that ran.
    pub fn on(
        &self,
        (planned, start): (Vec<Planned>, Simulation),
        (root, claim): (&Path, &Claim),
        reports: &Reports<'_>,
        interrupt: Interrupt,
    ) -> Result<()> {
        let outcome = announce(start, reports, interrupt)
            .and_then(|()| self.members(planned, root, reports, interrupt));
        run::end(claim, outcome)
    }

    /// Runs all members; says how many came to their end.
    fn members(
        &self,
        planned: Vec<Planned>,
        root: &Path,
        Reports { progress, say }: &Reports<'_>,
        interrupt: Interrupt,
    ) -> Result<String> {
        let mut members: Vec<Member> = Vec::new();
        for Planned { name, scene } in planned {
            let directory = root.join(folder(&name, members.len()));
            let mut progress = progress(&scene);
            progress.message(&name);
            let outcome = member(
                &scene,
                self.search,
                &mut || ResultDirectory::prepare(&directory, self.force),
                &|simulation, directory| provenance::record(&scene, None, simulation, directory),
                &mut progress,
                interrupt,
            );
            progress.finish();
            if interrupt.requested() {
                if !members.is_empty() {
                    say(table(&members).trim_end());
                }
                say(&format!("{name}: interrupted; what it did is in {}", directory.display()));
                return Err(Error::Solve(SolveError::Interrupted));
            }
            if let Err(error @ Error::Output(_)) = outcome {
                return Err(error);
            }
            members.push(Member { name, outcome });
            write(root, &members)?;
        }
        say(table(&members).trim_end());
        say(&format!("tables of every output time and plots are in {}", root.display()));
        finished(members, say)
    }
}

/// Says how many of `members` came to their end. A member that died ends the comparison as a run ends. Pairings that make no
/// sense are expected where all are tried; but if nothing ran there is nothing to compare.
fn finished(members: Vec<Member>, say: &dyn Fn(&str)) -> Result<String> {
    let (all, ran) = (members.len(), members.iter().filter(|m| m.outcome.is_ok()).count());
    let expected = |error: &Error| {
        let pairing = matches!(error, Error::Scene(_) | Error::Solve(SolveError::Pairing(_)));
        ran > 0 && pairing
    };
    let mut errors = members.into_iter().filter_map(|m| m.outcome.err());
    if let Some(error) = errors.find(|error| !expected(error)) {
        if ran > 0 {
            say(&format!("{ran} of {all} members finished; the first that did not:"));
        }
        return Err(error);
    }
    Ok(format!("{ran} of {all} members finished"))
}

/// Says the time scales at the start, whatever the scene's own pairing.
fn announce(mut start: Simulation, reports: &Reports<'_>, interrupt: Interrupt) -> Result<()> {
    start.set_control(Control::new(move || interrupt.requested(), |_| ()));
    start.relax()?;
    match Timescales::of(&mut start) {
        Ok(Some(timescales)) => (reports.say)(&timescales.verdict()),
        Ok(None) => {}
        Err(error) => (reports.say)(&format!("the timescales are not known: {error}")),
    }
    Ok(())
}

/// Writes numbers and plots.
fn write(root: &Path, members: &[Member]) -> Result<()> {
    let name = "compare".to_owned();
    let plot = Plot { name, caption: CAPTION.to_owned(), figure: figure(members) };
    plot::write(root, &[Block::Code(table(members)), Block::Plot(plot)])?;
    write_files(root, vec![(TABLE.to_owned(), csv(members).into_bytes())])
}

fn folder(name: &str, number: usize) -> String {
    let plain: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    let words: Vec<&str> = plain.split('-').filter(|word| !word.is_empty()).collect();
    format!("{}-{}", number + 1, words.join("-").to_lowercase())
}

/// Name of the table.
pub const TABLE: &str = "compare.csv";
/// Caption of the plots.
const CAPTION: &str = "Distances, measures and costs of all members along time.";
/// Names of plots and pictures of earlier versions.
const OLD: [&str; 3] = ["compare.svg", "compare.png", "pictures.png"];

/// The names in `root` of what a comparison writes, members first.
fn check(root: &Path, force: bool) -> Result<Vec<String>> {
    let report = ResultDirectory::REPORT;
    let written = [TABLE, ResultDirectory::PLOTS, report, Claim::STATUS];
    let written = |name: &str| written.contains(&name) || OLD.contains(&name);
    let ours = |name: &String| written(name) || is_member(&root.join(name));
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
