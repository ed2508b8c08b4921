//! A run that is resumed from its last checkpoint.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::fingerprint::{Fingerprint, STOP_WHEN_STEADY};
use super::ranks::checkpoints::{self, UsableCheckpoint};
use super::{Checkpoint, Ending, Error, Result, Simulation};
use crate::kinetics::PluginSearch;
use crate::num::checked::AtLeast;
use crate::output::checkpoint::{self, Unusable};
use crate::output::provenance::digest_of;
use crate::output::{ResultDirectory, RunStatus, Standing};
use crate::record::Malformed;
use crate::reduction::Communicator;
use crate::scene::Scene;

/// A run set up to continue.
pub struct Resumed {
    /// Its scene.
    pub scene: Scene,
    /// Where it is.
    pub simulation: Simulation,
    /// The checkpoint it continues from.
    pub checkpoint: Checkpoint,
    /// What a person should know: checkpoints that could not be used.
    pub notes: Vec<String>,
}

/// Sets up the run in `directory` to continue from its last usable checkpoint, with the `overrides` of its scene, as
/// `time.until=2`, which may change when it ends and its checkpoints; plugins are looked for as `search` says. Nothing
/// is changed yet.
///
/// # Errors
/// [`Error::Refused`] with what is in the way and what helps; a scene, mesh or plugin that cannot be read.
pub fn resume(
    directory: &ResultDirectory,
    overrides: &[String],
    search: &PluginSearch,
) -> Result<Resumed> {
    resume_on(directory.root(), directory, overrides, search, None)
}

/// The same of a run in `root` on one of several ranks, which writes to `directory`; on another number of ranks than
/// the run had solvers restart.
///
/// # Errors
/// As for [`resume`], on any rank.
pub fn resume_on(
    root: &Path,
    directory: &ResultDirectory,
    overrides: &[String],
    search: &PluginSearch,
    of: Option<Arc<dyn Communicator>>,
) -> Result<Resumed> {
    let refused = |what: String| Error::Refused(format!("{}: {what}", root.display()));
    let refuse = |what: String| Err(refused(what));
    let standing = Standing::read(root);
    let path = ResultDirectory::resolved_in(root);
    if !path.is_file() {
        return refuse(
            "it holds no run (no resolved.toml); a sweep or an accuracy study continues with the command \
             that began it"
                .into(),
        );
    }
    let scene = Scene::load(&path, overrides)?;
    let found = last(root, directory, of.as_deref());
    let (UsableCheckpoint { checkpoint, parts }, notes) =
        found.map_err(|notes| refused(without_checkpoint(&notes, standing.as_ref())))?;
    let reached = last_row(&directory.ledger()).unwrap_or((checkpoint.step(), checkpoint.time()));
    check_end(&checkpoint, (&scene, overrides), standing.as_ref(), reached).map_err(refused)?;
    if let (Some(name), None) = (checkpoint.fingerprint.host_law(), search.host_law()) {
        return refuse(format!(
            "the law `{name}` is a function of the program that began the run, which its directory does not have; \
             give it again where the run is resumed, as law={name} in Python"
        ));
    }
    let mut simulation = match of {
        None => Simulation::new(&scene, search)?,
        Some(ranks) => Simulation::over(&scene, search, ranks)?,
    };
    let now = Fingerprint::new(&scene, &simulation)?;
    if let Err(Error::Refused(changed)) = checkpoint.fingerprint.check(&now) {
        return refuse(format!(
            "what the run is made from has changed:\n{changed}\nundo that, or begin a new run; `rumple run \
             --from FRAME` starts one from a frame's state"
        ));
    }
    if restore(&checkpoint, &parts, &mut simulation).is_err() {
        return refuse(
            "its checkpoint does not fit its scene: it was written by another build of the program; resume \
             with that, or begin again"
                .into(),
        );
    }
    Ok(Resumed { scene, simulation, checkpoint, notes })
}

/// That no checkpoint is usable, why by `notes`, and what helps; a run that is complete has nothing to resume either.
fn without_checkpoint(notes: &[String], standing: Option<&Standing>) -> String {
    let why = match notes {
        [] => "it has no checkpoint: it was short, or ended before the first one".to_owned(),
        notes => notes.join("; "),
    };
    let again = "with `rumple run`, where `--from FRAME` starts from a frame's state";
    match standing.filter(|standing| standing.status == RunStatus::Complete) {
        Some(Standing { time, .. }) => {
            format!(
                "the run is complete, at time {time}, and cannot go further: {why}; begin another {again}"
            )
        }
        None => format!("{why}; begin again {again}"),
    }
}

/// Takes over a checkpoint, or where the run had another number of ranks the state from those of all its `parts`.
fn restore(
    checkpoint: &Checkpoint,
    parts: &[PathBuf],
    simulation: &mut Simulation,
) -> Result<(), Malformed> {
    if parts.is_empty() {
        return checkpoint.restore(simulation);
    }
    let part = simulation.rank_part.as_ref().map(|rank_part| &rank_part.part);
    let state = checkpoints::state_of(parts, part).ok_or(Malformed)?;
    checkpoint.continue_from(state, simulation);
    Ok(())
}

/// Whether a run with this checkpoint, of `scene` with `overrides`, has anywhere to go from the last row of its ledger, or
/// why not. Results are cut back to the checkpoint: those beyond an end before that row would be lost.
fn check_end(
    checkpoint: &Checkpoint,
    (scene, overrides): (&Scene, &[String]),
    standing: Option<&Standing>,
    (steps, reached): (u64, f64),
) -> Result<(), String> {
    let span = &scene.time.span;
    let end = span.until.get();
    let most = span.max_steps.map_or(u64::MAX, |most| AtLeast::get(most) as u64);
    let complete = standing.filter(|standing| standing.status == RunStatus::Complete);
    if complete.is_none() || !overrides.is_empty() {
        let rate = span.stop_when_steady.map_or(0.0, f64::from);
        let looser = steps > checkpoint.step() && rate > checkpoint.fingerprint.steady_rate();
        let ends = [
            (end < reached, format!("after {end}"), UNTIL),
            (most < steps, format!("after step {most}"), MAX_STEPS),
            (looser, format!("after the first rates below {rate}"), STEADY),
        ];
        if let Some((_, lost, remedy)) = ends.into_iter().find(|(loses, ..)| *loses) {
            return Err(format!(
                "it has results up to time {reached}, step {steps}, and those {lost} would be lost; {remedy} lets it go \
                 further"
            ));
        }
    }
    let Some(standing) = complete else { return Ok(()) };
    let remedy = remedies(standing, (end <= reached, most <= steps), overrides);
    if overrides.is_empty() || !remedy.is_empty() {
        let remedy = if remedy.is_empty() { UNTIL } else { &remedy };
        return Err(format!(
            "the run is complete, at time {reached}, step {steps}: {}; {remedy} lets it go further",
            standing.reason
        ));
    }
    Ok(())
}

const UNTIL: &str = "`--until T`";
const MAX_STEPS: &str = "`--set time.max_steps=N` with a larger N";
const STEADY: &str = "`--set time.stop_when_steady=RATE` with a smaller RATE";

/// Options without which a complete run would end again at once: where the end time, or the number of steps, is
/// `reached`, and where it was steady. Empty where it has somewhere to go.
fn remedies(standing: &Standing, reached: (bool, bool), overrides: &[String]) -> String {
    let steady = standing.reason == Ending::Steady.to_string()
        && !overrides.iter().any(|set| set.starts_with(STOP_WHEN_STEADY));
    let all = [(reached.0, UNTIL), (reached.1, MAX_STEPS), (steady, STEADY)];
    let needed: Vec<&str> = all.iter().filter(|(needed, _)| *needed).map(|one| one.1).collect();
    needed.join(" together with ")
}

/// The last checkpoint that can be used, and what is wrong with later ones; if there is none, what is wrong
/// with all.
fn last(
    root: &Path,
    directory: &ResultDirectory,
    of: Option<&dyn Communicator>,
) -> Result<(UsableCheckpoint, Vec<String>), Vec<String>> {
    if of.is_some() || checkpoints::ranks_of(root) > 1 {
        let fits = |found: &Checkpoint| missing(directory, found).is_none();
        return match checkpoints::last(root, of, &fits) {
            Ok(found) => Ok((found, Vec::new())),
            Err(why) => Err(why.into_iter().collect()),
        };
    }
    let found = directory.checkpoints_found().map_err(|error| vec![error.to_string()])?;
    let mut notes = Vec::new();
    for (_, path) in found.into_iter().rev() {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let read = checkpoint::read(&path).and_then(|content| {
            content.read::<Checkpoint>().map_err(|_| Unusable::Damaged("it holds something else"))
        });
        match read {
            Ok(checkpoint) => match missing(directory, &checkpoint) {
                None => return Ok((UsableCheckpoint { checkpoint, parts: Vec::new() }, notes)),
                Some(what) => notes.push(format!("{name} does not fit the results: {what}")),
            },
            Err(error) => notes.push(format!("{name} {error}")),
        }
    }
    Err(notes)
}

/// What of the results up to a checkpoint is not there.
fn missing(directory: &ResultDirectory, checkpoint: &Checkpoint) -> Option<String> {
    let rows = rows(&directory.ledger(), checkpoint.step());
    if rows != Some(checkpoint.step() + 1) {
        return Some(format!("ledger.csv ends before step {}", checkpoint.step()));
    }
    // The frames up to then are part of the results.
    checkpoint.results.digests.iter().enumerate().find_map(|(k, digest)| {
        let frame = directory.frame(k);
        match digest_of(&frame) {
            Ok(found) if found == *digest => None,
            Ok(_) => Some(format!(
                "{} is not as the run wrote it: its bytes have changed",
                frame.display()
            )),
            Err(error) => Some(error.to_string()),
        }
    })
}

/// Whole rows of a ledger up to a step.
fn rows(path: &Path, step: u64) -> Option<u64> {
    let text = whole_rows(path)?;
    let steps = text.lines().skip(1).map_while(|row| row.split(',').next()?.parse::<u64>().ok());
    Some(steps.filter(|other| *other <= step).count() as u64)
}

/// Step and time of the last whole row of a ledger.
fn last_row(path: &Path) -> Option<(u64, f64)> {
    let text = whole_rows(path)?;
    let mut cells = text.lines().last()?.split(',');
    Some((cells.next()?.parse().ok()?, cells.next()?.parse().ok()?))
}

fn whole_rows(path: &Path) -> Option<String> {
    let mut text = fs::read_to_string(path).ok()?;
    text.truncate(text.rfind('\n').unwrap_or(0));
    Some(text)
}
