//! The run: relax the start, then step until the end, showing every accepted state to the
//! observers (frames, ledger, stop rules).

use std::time::{Duration, Instant};

use super::checkpoint::{Checkpoint, Checkpoints, Place};
use super::costs::{Costs, peak_resident};
use super::forecast::{Clock, Outlook, Told};
use super::invariants::Invariants;
use super::observe::{Frames, LedgerRows, Observer, StepInfo, StopRules};
use super::reported::{Reported, Shrinking};
use super::self_intersection::Intersections;
pub use super::summary::{Ending, Failure, Summary, with_status};
use super::watch::{self, Watch};
use super::{Error, Result, Simulation, failure, laws, notes, report};
use crate::model::State;
use crate::num::real;
use crate::output::events::{Event, Events};
use crate::output::{Interrupt, Progress, ProgressLine, ResultDirectory};
use crate::scene::Scene;
use crate::solve::{Control, SolveError, StepReport};

/// Runs `simulation` and writes into `directory`.
///
/// Steady means: the largest |dc/dt| over all points, in units of each species' typical
/// magnitude, is below `time.stop_when_steady`.
///
/// # Errors
/// [`Error::Stopped`] if a step cannot be made; output that cannot be written.
pub fn run(
    scene: &Scene,
    simulation: &mut Simulation,
    directory: &ResultDirectory,
    progress: &mut Progress,
    interrupt: Interrupt,
) -> Result<Summary> {
    observed(scene, simulation, directory, progress, interrupt, (None, &mut []))
}

/// [`run`], from the checkpoint `from` that `simulation` has been brought to, if there is one, and showing every
/// accepted state to `others` as well.
///
/// # Errors
/// As [`run`], those of the observers, and results that are not those of that checkpoint.
pub fn observed(
    scene: &Scene,
    simulation: &mut Simulation,
    directory: &ResultDirectory,
    progress: &mut Progress,
    interrupt: Interrupt,
    (from, others): (Option<&Checkpoint>, &mut [&mut dyn Observer]),
) -> Result<Summary> {
    let outcome = stepped(scene, simulation, directory, progress, interrupt, (from, others));
    directory.claim().tell(|reached| {
        // A last step that failed included.
        reached.spent = simulation.spent();
        reached.peak_resident_bytes = peak_resident(None);
    });
    let written = Costs::of(scene, simulation).write(directory);
    // The first failure is the one to report.
    let summary = outcome?;
    written?;
    Ok(summary)
}

/// The run itself.
fn stepped(
    scene: &Scene,
    simulation: &mut Simulation,
    directory: &ResultDirectory,
    progress: &mut Progress,
    interrupt: Interrupt,
    (from, others): (Option<&Checkpoint>, &mut [&mut dyn Observer]),
) -> Result<Summary> {
    let clock = Clock::start();
    let place = from.map(|from| &from.place);
    let wall_before = place.map_or(0.0, |place| place.wall);
    let aside = progress.aside();
    simulation.set_control(Control::new(move || interrupt.requested(), move |t| aside.report(t)));
    let fields = simulation.fields.clone();
    let model = simulation.model().clone();
    let mut frames = Frames::create(directory, &model, &fields, &scene.output)?;
    let mut watch = Watch::of(scene, simulation, directory, place.and_then(|place| place.watch))?;
    let mut events = match place {
        None => Events::new(directory.events()),
        Some(place) => Events::reopen(directory.events(), place.events)?,
    };
    let watched = watch.is_some();
    if watched {
        events.begin()?;
    }
    let laws = simulation.invariants.as_ref().map(Invariants::columns).unwrap_or_default();
    let columns = report::columns(&model, watched, &laws);
    let mut ledger = match from {
        None => LedgerRows::create(directory, &columns)?,
        Some(from) => LedgerRows::reopen(directory, &columns, from.step())?,
    };
    if let Some(place) = place {
        frames = frames.map(|f| f.after(&place.frames, &place.digests)).transpose()?;
        directory.cut_back(place.frames.len(), place.watch.map_or(0, |(modes, _)| modes))?;
    }
    let mut rules = StopRules::of(scene);
    let (first, mut negative) = match from {
        None => begin(scene, simulation, &mut watch, directory, (&mut events, progress))?,
        Some(_) => (StepReport::default(), None),
    };
    let start = place.map_or(simulation.spent(), |place| place.start);
    let mut checkpoints = Checkpoints::of(scene, simulation, directory)?;
    let (mut outlook, mut told) = (Outlook::new(scene, clock), Told::default());
    directory.claim().tell(|reached| reached.start = start);
    let mut summary = Summary {
        ending: Ending::Reached,
        time: 0.0,
        frames: 0,
        resumable: None,
        step: 0,
        spent: start,
        start,
        wall: Duration::ZERO,
        output: Duration::ZERO,
        predicted: None,
        laws: Vec::new(),
        intersection: None,
    };
    let mut intersections = Intersections::default();
    let until = scene.time.span.until.get();
    let every = scene.output.every.map_or(until, |e| e.get().min(until));
    let mut written = 0usize;
    let mut latest = first;
    let (mut shown, mut framed) = (None, None);
    // Whether solvers are as the last accepted step has left them; not even the start, or the look at it, may have
    // come to its end.
    let whole = from.is_some() || !interrupt.requested();
    let mut clean = whole && !latest.relaxation.residual.is_nan();
    if from.is_some() {
        shown = Some(simulation.state.step);
        let last = place.and_then(|place| place.frames.last());
        framed = shown.filter(|_| last == Some(&simulation.state.time));
        while real(written) * every <= simulation.state.time {
            written += 1;
        }
    }
    let (mut reported, mut shrinking, mut failed) = (Reported::default(), Shrinking::default(), 0);
    loop {
        let stopwatch = Instant::now();
        let due = shown != Some(simulation.state.step) && checkpoints.renew(simulation);
        let frames_before = frames.as_ref().map_or(0, |frames| frames.times().len());
        let mut observers: Vec<&mut dyn Observer> =
            vec![&mut ledger, &mut rules, &mut intersections];
        observers.extend(others.iter_mut().map(|other| -> &mut dyn Observer { &mut **other }));
        observers.extend(frames.as_mut().map(|frames| -> &mut dyn Observer { frames }));
        let spent = simulation.spent();
        let Simulation { workspace, state, invariants, .. } = &mut *simulation;
        let laws = invariants.as_ref().map(Invariants::row).unwrap_or_default();
        let state = &*state;
        let mut at = workspace.at(state);
        directory.claim().tell(|reached| (reached.time, reached.spent) = (state.time, spent));
        (summary.time, summary.step) = (state.time, state.step);
        let mut scheduled = false;
        let mut see = || -> Result<Option<Ending>> {
            let mut ending = None;
            for observer in &mut observers {
                ending = ending.or(observer.stop(&mut at)?);
            }
            // What has come to its end cannot be interrupted any more, unless the look at its stability was cut short.
            let open = ending.is_none_or(|ending| ending == Ending::Steady)
                || negative.is_some_and(f64::is_nan);
            if open && interrupt.requested() {
                ending = Some(Ending::Interrupted);
            }
            // Output times are multiples of `every` counted in integers; steps hit them exactly.
            scheduled = state.time >= real(written) * every;
            let frame = scheduled || ending.is_some();
            let frame = frame && framed != Some(state.step);
            // After an interrupted try the state is the one shown before.
            let new = shown.replace(state.step) != Some(state.step);
            if new || frame {
                let wall = wall_before + clock.wall();
                let laws = laws.as_slice();
                let info = StepInfo { report: &latest, frame, new, negative, laws, wall };
                for observer in &mut observers {
                    observer.observe(&mut at, &info)?;
                }
            }
            if frame {
                framed = Some(state.step);
            }
            Ok(ending)
        };
        let ending = match see() {
            Ok(ending) => ending,
            Err(error) => return Err(stopped(scene, simulation, directory, (error, None))),
        };
        drop(observers);
        summary.intersection = intersections.last();
        directory.claim().tell(|reached| reached.intersection = summary.intersection);
        if let Some(text) = intersections.news() {
            progress.message(&text);
        }
        while real(written) * every <= simulation.state.time {
            written += 1;
        }
        let place = || {
            let (times, digests) = frames
                .as_ref()
                .map_or((&[][..], &[][..]), |frames| (frames.times(), frames.digests()));
            // One of an interruption is not of the run without it.
            let extra = ending == Some(Ending::Interrupted) && !scheduled;
            let count = if extra { frames_before } else { times.len() };
            let (frames, digests) = (times[..count].to_vec(), digests[..count].to_vec());
            let wall = wall_before + clock.wall();
            let watch = watch.as_ref().map(Watch::seen);
            Place { start, wall, frames, digests, events: events.count(), watch }
        };
        match ending {
            None => checkpoints.accepted(simulation, place, due, progress),
            Some(Ending::Interrupted) => {
                summary.resumable = checkpoints.interrupted(simulation, place, clean, progress);
            }
            Some(_) => checkpoints.ended(simulation, place, progress),
        }
        summary.output += stopwatch.elapsed();
        if let Some(ending) = ending {
            summary.ending = ending;
            break;
        }
        let target = (real(written) * every).min(until);
        match simulation.step(target) {
            Ok(report) => latest = report,
            Err(Error::Solve(SolveError::Interrupted)) => {
                clean = false;
                continue;
            }
            Err(error) => return Err(stopped(scene, simulation, directory, (error, None))),
        }
        note_snap(&mut events, simulation, &latest)?;
        if let Some(watch) = &mut watch {
            let seen = look(watch, simulation, &mut latest, (&mut events, progress));
            let seen = seen.map_err(|error| stopped(scene, simulation, directory, (error, None)));
            negative = Some(seen?);
            // It may have been cut short.
            clean &= !interrupt.requested();
        }
        for fault in reported.new_faults(simulation) {
            progress.message(&fault);
            simulation.faults.push(fault);
        }
        let time = simulation.state.time;
        let cut = time == target || simulation.breakpoints.include(time);
        if let Some(text) = shrinking.after(&latest, time, cut) {
            progress.message(&text);
        }
        if let Some(reason) = latest.reason.take() {
            failed += 1;
            if failed == REPORT_AFTER {
                progress.message(&format!("step size repeatedly reduced: {reason}"));
            }
        }
        summary.spent = simulation.spent();
        // What a run forecasts begins with its start.
        if from.is_none() {
            outlook.step(&latest, time, cut);
        }
        if let Some((predicted, words)) = told.now(&outlook) {
            directory.claim().tell(|reached| reached.predicted = Some(predicted));
            progress.message(&words);
        }
        progress.update(&ProgressLine {
            time: simulation.state.time,
            step: simulation.state.step,
            dt: latest.step,
            residual: latest.relaxation.residual,
            left: outlook.left().unwrap_or_default(),
            note: format!("{} iterations", latest.relaxation.iterations),
        });
    }
    summary.frames = frames.map_or(0, |frames| frames.times().len());
    summary.predicted = told.judged(&outlook);
    directory.claim().tell(|reached| reached.predicted = summary.predicted);
    summary.laws = simulation.invariants.as_ref().map(Invariants::worst).unwrap_or_default();
    summary.wall = Duration::from_secs_f64(clock.wall());
    Ok(summary)
}

/// Relaxes the start and looks at what it is; the work, and the directions that lower the energy where
/// the run watches them.
fn begin(
    scene: &Scene,
    simulation: &mut Simulation,
    watch: &mut Option<Watch>,
    directory: &ResultDirectory,
    (events, progress): (&mut Events, &mut Progress),
) -> Result<(StepReport, Option<f64>)> {
    let start = simulation.state.clone();
    if simulation.model().moves() && !simulation.at_rest {
        progress.message("relaxing the initial shape");
    }
    let mut first = StepReport::default();
    match simulation.prepare() {
        Ok(done) => first.relaxation = done,
        // The start is then shown as far as it got, not as an equilibrium.
        Err(Error::Solve(SolveError::Interrupted)) => first.relaxation.residual = f64::NAN,
        Err(error) => return Err(stopped(scene, simulation, directory, (error, Some(&start)))),
    }
    first.work = simulation.spent().work;
    if let Err(error) = look_again(simulation, progress) {
        return Err(stopped(scene, simulation, directory, (error, Some(&start))));
    }
    note_snap(events, simulation, &first)?;
    let at_rest = !first.relaxation.residual.is_nan();
    if at_rest
        && !simulation.at_rest
        && let Some(note) =
            notes::on_start(scene, simulation.sheet(), &start.x, &simulation.state.x)
    {
        progress.message(&note);
    }
    if at_rest && let Some(note) = notes::on_explicit_step(scene, simulation)? {
        progress.message(&note);
    }
    let negative = match watch {
        Some(watch) if at_rest => match look(watch, simulation, &mut first, (events, progress)) {
            Ok(seen) => Some(seen),
            Err(error) => {
                return Err(stopped(scene, simulation, directory, (error, Some(&start))));
            }
        },
        Some(_) => Some(f64::NAN),
        None => {
            if at_rest {
                watch::warn_of_flat_start(simulation, progress)?;
            }
            None
        }
    };
    Ok((first, negative))
}

/// When that many steps could only be made after a try that came to no result, the reason is reported.
const REPORT_AFTER: usize = 5;

/// Looks at the laws where signals are those of a relaxed sheet, if nothing was found before.
fn look_again(simulation: &mut Simulation, progress: &mut Progress) -> Result<()> {
    if simulation.faults.is_empty() && simulation.model().moves() && !simulation.at_rest {
        simulation.faults = laws::try_out(&mut simulation.evaluate())?;
        simulation.faults.iter().for_each(|fault| progress.message(fault));
    }
    Ok(())
}

/// Writes an event for a step in which the shape jumped from one branch of equilibria to another.
fn note_snap(events: &mut Events, simulation: &Simulation, report: &StepReport) -> Result<()> {
    let done = &report.relaxation;
    if done.jumps > 0 {
        let (time, step) = (simulation.state.time, simulation.state.step);
        let released = Some(done.released);
        events.append(&Event { time, step, kind: "snap", released, ..Event::default() })?;
    }
    Ok(())
}

/// Lets the watch look at the state that was just accepted; its directions down.
fn look(
    watch: &mut Watch,
    simulation: &mut Simulation,
    report: &mut StepReport,
    to: (&mut Events, &mut Progress),
) -> Result<f64> {
    let _scope =
        simulation.model().tally().meter("solver", "stability analysis", &["shapes"]).scope(0);
    let (seen, spent) = simulation.spend(|s| watch.look(s, &mut report.relaxation, to));
    report.work += spent.work;
    match seen {
        Ok(negative) => Ok(negative),
        // The state is then still the saddle.
        Err(Error::Solve(SolveError::Interrupted)) => Ok(f64::NAN),
        Err(error) => Err(error),
    }
}

/// What a run leaves that stopped with `error`, in the first relaxation of `start` if that is given; an error of
/// output stays as it is.
fn stopped(
    scene: &Scene,
    simulation: &mut Simulation,
    directory: &ResultDirectory,
    (error, start): (Error, Option<&State>),
) -> Error {
    if matches!(error, Error::Output(_)) {
        return error;
    }
    let error = super::located(error, simulation.sheet(), &simulation.state.x);
    let error = failure::diagnosed(scene, simulation, error);
    // A first relaxation that failed leaves the shape where it stuck, which is looked at beside it.
    if let Some(start) = start {
        simulation.state.clone_from(start);
    }
    match failure::write(scene, simulation, directory, (&error, start)) {
        // The first failure is the one to report.
        Err(_) => error,
        Ok(folder) => Error::Stopped(Failure {
            error: Box::new(error),
            time: simulation.state.time,
            step: simulation.state.step,
            folder,
        }),
    }
}
