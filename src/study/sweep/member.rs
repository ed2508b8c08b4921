//! One member of a sweep: run in a process of its own, and read back by whoever gathers.

mod continued;
mod limited;

use std::fs;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use self::continued::{continued, open_measures};
use self::limited::Limited;
pub use self::limited::limit_of;
use super::plan::Plan;
use super::timing::Timing;
use crate::model::Evaluation;
use crate::num::real;
use crate::output::{
    Claim, Compression, Field, Frame, Interrupt, Ledger, OutputError, Progress, ResultDirectory,
    RunStatus, SelfIntersection, Standing, vtu,
};
use crate::run::resume::Resumed;
use crate::run::run::{self, Ending, Summary};
use crate::run::{Checkpoint, Error, Observer, Result, Simulation, StepInfo};
use crate::scene::Scene;
use crate::sheet::read::surface;
use crate::study::measures::{Measures, measure};
use crate::study::states::{self, StateFile};
use crate::tally::Work;

/// How a member stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MemberStatus {
    /// It has not begun.
    NotBegun,
    /// A process works on it.
    Running,
    /// It came to its end.
    Complete,
    /// It was asked to end before.
    Interrupted,
    /// Its process ended without a word.
    Killed,
    /// It could not go on.
    Failed,
    /// It came to its end, and a file of its results is missing or cut short since: it is to be made again.
    Damaged,
}

impl std::fmt::Display for MemberStatus {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::NotBegun => "not begun",
            Self::Running => "running",
            Self::Complete => "complete",
            Self::Interrupted => "interrupted",
            Self::Killed => "killed",
            Self::Failed => "failed",
            Self::Damaged => "damaged",
        })
    }
}

/// How the member in `directory` of a sweep stands, and why.
#[must_use]
pub fn status(plan: &Plan, directory: &Path) -> (MemberStatus, String) {
    let Some(standing) = Standing::of(directory) else {
        return (MemberStatus::NotBegun, String::new());
    };
    let status = match standing.status {
        RunStatus::Running if standing.in_use => MemberStatus::Running,
        RunStatus::Running => MemberStatus::Killed,
        RunStatus::Complete => MemberStatus::Complete,
        RunStatus::Interrupted => MemberStatus::Interrupted,
        RunStatus::Failed => MemberStatus::Failed,
    };
    if status == MemberStatus::Complete
        && let Some(damage) = damage(plan, directory)
    {
        return (MemberStatus::Damaged, damage);
    }
    (status, standing.reason)
}

/// What is wrong with the files of a member that is complete, if anything is.
fn damage(plan: &Plan, directory: &Path) -> Option<String> {
    let times: Vec<f64> = read_measures(directory).iter().map(|m| m.time).collect();
    let wrong =
        |name: &str| Some(format!("{name} is missing or cut short: it is to be made again"));
    if times.is_empty() {
        return wrong(ResultDirectory::MEASURES);
    }
    if plan.states && states::times(&directory.join(ResultDirectory::STATES)) != times {
        return wrong(ResultDirectory::STATES);
    }
    if plan.repeats > 0 && Timing::read(directory).is_none() {
        return wrong(ResultDirectory::TIMING);
    }
    None
}

/// What is known of a member from its folder.
#[derive(Debug, Clone)]
pub struct Found {
    /// Its keys and values.
    pub name: String,
    /// Which value of every axis it has.
    pub at: Vec<usize>,
    /// How it stands.
    pub status: MemberStatus,
    /// Why; the first line.
    pub reason: String,
    /// Measures at the output times, as far as it came.
    pub measures: Vec<Measures>,
    /// The time at which no species changed any more, if the run ended for that.
    pub steady: Option<f64>,
    /// Processor time of relaxing the start and of all steps, s.
    pub seconds: Option<f64>,
    /// Largest resident memory, bytes.
    pub memory: Option<u64>,
    /// The work of that.
    pub work: Option<Work>,
    /// That of the start.
    pub start: Option<Work>,
    /// How long its steps take.
    pub timing: Option<Timing>,
    /// Whether its sheet passes through itself in its last state, where its shape moves.
    pub intersection: Option<SelfIntersection>,
    /// What its picture shows.
    pub shown: Option<Shown>,
}

/// The last output state of a member.
#[derive(Debug, Clone)]
pub struct Shown {
    /// Positions.
    pub x: Vec<crate::Vec3>,
    /// Vertices of the triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Name and values of the first species at the vertices, if there is one.
    pub species: Option<(String, Vec<f64>)>,
}

/// Reads what there is of member `number` of the sweep in `root`, with `picture` what that shows.
#[must_use]
pub fn read(plan: &Plan, root: &Path, number: usize, picture: bool) -> Found {
    let directory = plan.directory(root, number);
    let (status, reason) = status(plan, &directory);
    // What goes on, or was killed, has left no word of that.
    let ended = |standing: &Standing| standing.status != RunStatus::Running;
    let spent = Standing::of(&directory).filter(ended);
    let measures = read_measures(&directory);
    let last = measures.last().map(|m: &Measures| m.time);
    let steady = status == MemberStatus::Complete && reason == Ending::Steady.to_string();
    Found {
        name: plan.name(number),
        at: plan.members.get(number).map(|point| point.at.clone()).unwrap_or_default(),
        status,
        reason: reason.lines().next().unwrap_or_default().to_owned(),
        steady: last.filter(|_| steady),
        seconds: spent.as_ref().and_then(|s| s.cpu_seconds),
        memory: spent.as_ref().and_then(|s| s.peak_resident_bytes),
        work: spent.as_ref().and_then(|s| s.work),
        start: spent.as_ref().and_then(|s| s.start),
        intersection: spent.and_then(|s| s.intersection),
        measures,
        timing: Timing::read(&directory),
        shown: if picture { read_shown(&directory) } else { None },
    }
}

fn read_shown(directory: &Path) -> Option<Shown> {
    let surface = surface(directory.join(ResultDirectory::SHOWN)).ok()?;
    // Of a damaged file nothing is shown.
    let exists = |vertex: &u32| (*vertex as usize) < surface.points.len();
    if !surface.triangles.iter().flatten().all(exists) {
        return None;
    }
    let species = surface.point_arrays.into_iter().find(|array| array.components == 1);
    Some(Shown {
        x: surface.points,
        triangles: surface.triangles,
        species: species.map(|array| (array.name, array.values)),
    })
}

/// Columns of `measures.csv`.
const COLUMNS: [&str; 10] = [
    "step",
    "time",
    "spots",
    "separation d [length]",
    "nearest centres [length]",
    "share",
    "amplitude [length]",
    "deflection [length]",
    "energy [energy]",
    "fastest rate [1/time]",
];

fn row(step: u64, m: &Measures) -> [f64; 10] {
    let none = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let step = real(usize::try_from(step).unwrap_or(usize::MAX));
    let (d, nearest) = (none(m.separation), none(m.nearest));
    [step, m.time, real(m.spots), d, nearest, m.share, m.amplitude, m.deflection, m.energy, m.rate]
}

/// The time of the last output of the member in `directory`.
pub(super) fn reached(directory: &Path) -> Option<f64> {
    read_measures(directory).last().map(|m| m.time)
}

fn read_measures(directory: &Path) -> Vec<Measures> {
    let text = fs::read_to_string(directory.join(ResultDirectory::MEASURES)).unwrap_or_default();
    let some = |value: f64| (!value.is_nan()).then_some(value);
    let read = |line: &str| {
        let row: Vec<f64> = line.split(',').filter_map(|cell| cell.parse().ok()).collect();
        let [_, time, spots, d, nearest, share, amplitude, deflection, energy, rate] = row[..]
        else {
            return None;
        };
        let spots = crate::num::whole(spots);
        let (separation, nearest) = (some(d), some(nearest));
        Some(Measures {
            time,
            energy,
            amplitude,
            deflection,
            spots,
            separation,
            nearest,
            share,
            rate,
        })
    };
    // A last line without its end may be a part of one.
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    whole.lines().skip(1).filter_map(read).collect()
}

/// Writes measures and what the picture shows, at every output time.
struct Record<'a> {
    directory: &'a ResultDirectory,
    level: Option<f64>,
    measures: Ledger,
}

impl Observer for Record<'_> {
    fn observe(&mut self, at: &mut Evaluation<'_>, info: &StepInfo<'_>) -> Result<()> {
        if !info.frame {
            return Ok(());
        }
        let measures = measure(at, self.level)?;
        let (model, state) = (at.model(), at.state());
        if model.sheet().triangle_count() > 0 {
            let names = model.chemistry().map(|c| c.descriptor().species.first());
            let name = names.flatten().map(|species| species.name.clone());
            let values = at.species_at_vertices().into_iter().next();
            let field = name.zip(values).map(|(name, values)| Field::scalar(name, values));
            let frame = Frame {
                time: state.time,
                step: state.step,
                points: &state.x,
                triangles: model.sheet().triangles(),
                point: field.into_iter().collect(),
                cell: Vec::new(),
                field_data: Vec::new(),
            };
            let path = self.directory.root().join(ResultDirectory::SHOWN);
            vtu::write(&path, &frame, Compression::default())?;
        }
        // The row is last: whoever sees it finds the picture too.
        Ok(self.measures.append(&row(state.step, &measures))?)
    }
}

/// Keeps the states at the output times.
struct Keep(StateFile);

impl Observer for Keep {
    fn observe(&mut self, at: &mut Evaluation<'_>, info: &StepInfo<'_>) -> Result<()> {
        if info.frame {
            self.0.append(at.state())?;
        }
        Ok(())
    }
}

/// Longest time that a member waits for one who still writes to its directory.
const PATIENCE: Duration = Duration::from_secs(20);

/// Runs member `number` of the sweep in `root`; `record` writes down what it was made from. One that is
/// complete is left as it is; one that was interrupted or killed goes on from its checkpoint. The results of
/// any other try are replaced.
///
/// # Errors
/// A scene or a file that is not the one that was planned; whatever ends a run.
pub fn run(
    plan: &Plan,
    root: &Path,
    number: usize,
    record: &dyn Fn(&Scene, &Simulation, &ResultDirectory) -> Result<()>,
    progress: &mut Progress,
    interrupt: Interrupt,
) -> Result<Option<Summary>> {
    let Some(point) = plan.members.get(number) else {
        let message = format!("no member {number}: there are {}, from 0", plan.members.len());
        return Err(Error::Refused(message));
    };
    let path = plan.directory(root, number);
    wait_for_others(&path, interrupt);
    if status(plan, &path).0 == MemberStatus::Complete {
        return Ok(None);
    }
    if plan.fingerprint(number)? != point.fingerprint {
        let file = plan.changed_file(number, &plan.files)?.map(|file| file.display().to_string());
        let what = file.as_deref().unwrap_or("the scene, a file that it names or a plugin");
        let message =
            format!("{}: {what} has changed since the sweep was planned", plan.name(number));
        return Err(Error::Refused(message));
    }
    let scene = plan.scene(number)?;
    let search = plan.search();
    let earlier = continued(plan, &path, &search);
    let directory = match &earlier {
        Some((directory, _)) => directory.clone(),
        None => room(&path)?,
    };
    let summary = run::with_status(&directory, || {
        let (mut simulation, from) = match earlier {
            Some((_, Resumed { simulation, checkpoint, .. })) => (simulation, Some(checkpoint)),
            None => (Simulation::new(&scene, &search)?, None),
        };
        let times = from.as_ref().map(Checkpoint::frames);
        if times.is_none() {
            record(&scene, &simulation, &directory)?;
        }
        let measures = open_measures(&directory.root().join(ResultDirectory::MEASURES), times)?;
        let states = directory.root().join(ResultDirectory::STATES);
        let mut keep = match (plan.states, times) {
            (true, None) => Some(Keep(StateFile::create(&states)?)),
            (true, Some(times)) => Some(Keep(StateFile::reopen(&states, times)?)),
            (false, _) => None,
        };
        let mut limited = Limited::watch(point.limit, scene.time.span.until.get(), interrupt);
        let mut record = Record { directory: &directory, level: plan.level, measures };
        let mut observers: Vec<&mut dyn Observer> = Vec::new();
        observers.extend(keep.as_mut().map(|keep| -> &mut dyn Observer { keep }));
        observers.push(&mut limited);
        observers.push(&mut record);
        let observers = (from.as_ref(), &mut observers[..]);
        let summary =
            run::observed(&scene, &mut simulation, &directory, progress, interrupt, observers)?;
        if summary.ending == Ending::Interrupted
            && let Some(error) = limited.error(summary.time, point.limit)
        {
            return Err(error);
        }
        if plan.repeats > 0 && summary.ending != Ending::Interrupted {
            drop(simulation);
            Timing::of(&scene, &plan.search(), &summary, plan.repeats)?.write(&directory)?;
        }
        Ok(summary)
    })?;
    Ok(Some(summary))
}

/// Waits while another process writes to the directory: a member of a sweep that was killed comes to its
/// end by itself, and may even be complete then.
fn wait_for_others(path: &Path, interrupt: Interrupt) {
    let since = Instant::now();
    while Claim::in_use(path) && since.elapsed() < PATIENCE && !interrupt.requested() {
        thread::sleep(Duration::from_millis(50));
    }
}

/// The directory, emptied of an earlier try.
fn room(path: &Path) -> Result<ResultDirectory> {
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent)
            .map_err(|source| OutputError::Write { path: parent.to_owned(), source })?;
    }
    Ok(ResultDirectory::prepare(path, true)?)
}
