//! The run: relax the start, then step until the end, showing every accepted state to the
//! observers (frames, ledger, stop rules).

use std::path::Path;
use std::time::Instant;

use super::checkpoint::Checkpoint;
use super::costs::{Costs, peak_resident};
pub use super::error::Failure;
use super::incidents::RunEvents;
use super::observe::Observer;
use super::recorder::{Recorder, RunClock, RunObservers};
use super::resume::Resumed;
use super::session::Session;
pub(crate) use super::summary::end;
pub use super::summary::{Ending, Summary, with_status};
use super::{Error, Result, Simulation, lints, provenance, stability_monitor};
use crate::model::Start;
use crate::num::Short;
use crate::output::{Interrupt, Progress, ResultDirectory, Standing};
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

/// [`observed`] as a command makes it: with the record of what the run is made from, of which the file `state` is the
/// start if that is not the scene's; laws tried out at the start; and the status of how it ended.
///
/// # Errors
/// As [`observed`], and a record that cannot be written.
pub fn recorded(
    (scene, state): (&Scene, Option<&Path>),
    simulation: &mut Simulation,
    directory: &ResultDirectory,
    progress: &mut Progress,
    interrupt: Interrupt,
    others: &mut [&mut dyn Observer],
) -> Result<Summary> {
    with_status(directory, || {
        provenance::record(scene, state, simulation, directory)?;
        simulation.try_laws()?;
        for note in simulation.notes.iter().chain(&simulation.faults) {
            progress.message(note);
            directory.claim().note(note);
        }
        observed(scene, simulation, directory, progress, interrupt, (None, others))
    })
}

/// Continues the run in `directory` that was set up as `resumed`, showing every accepted state to `others` as well.
///
/// # Errors
/// As [`observed`], and a record that cannot be written.
pub fn continued(
    resumed: &mut Resumed,
    directory: &ResultDirectory,
    progress: &mut Progress,
    interrupt: Interrupt,
    others: &mut [&mut dyn Observer],
) -> Result<Summary> {
    let Resumed { scene, simulation, checkpoint, notes } = resumed;
    let earlier = Standing::of(directory.root()).map(|standing| standing.notes);
    directory.claim().begin()?;
    earlier.iter().flatten().for_each(|note| directory.claim().note(note));
    with_status(directory, || {
        if simulation.sheet().reduction().is_first() {
            provenance::record_resumed(scene, checkpoint, directory)?;
        }
        notes.iter().for_each(|note| progress.message(note));
        let (time, step) = (Short(checkpoint.time()), checkpoint.step());
        progress.message(&format!("going on from time {time}, step {step}"));
        let from = (Some(&*checkpoint), others);
        observed(scene, simulation, directory, progress, interrupt, from)
    })
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
    let results = from.map(|from| &from.results);
    let clock =
        RunClock { began: Instant::now(), before: results.map_or(0.0, |results| results.wall) };
    let aside = progress.aside();
    simulation.set_control(Control::new(move || interrupt.requested(), move |t| aside.report(t)));
    let mut session = Session { scene, directory, progress, interrupt };
    let mut incidents = RunEvents::open(&session, simulation, results)?;
    let outputs = RunObservers::open(&session, simulation, from, incidents.monitor.is_some())?;
    let mut latest = match from {
        None => start(&mut session, simulation, &mut incidents)?,
        Some(_) => StepReport::default(),
    };
    let records = (outputs, incidents);
    let mut recorder = Recorder::new(session, simulation, records, (from, &latest), clock)?;
    loop {
        if let Some(ending) = recorder.record(simulation, &latest, others)? {
            return Ok(recorder.finish(simulation, ending));
        }
        match simulation.step(recorder.target()) {
            Ok(report) => {
                latest = report;
                recorder.step_accepted(simulation, &mut latest)?;
            }
            Err(Error::Solve(SolveError::Interrupted)) => recorder.note_interruption(),
            Err(error) => return Err(recorder.step_failed(simulation, error)),
        }
    }
}

/// Brings the start to rest, with warnings and an analysis of its stability; the work.
fn start(
    session: &mut Session<'_>,
    simulation: &mut Simulation,
    incidents: &mut RunEvents,
) -> Result<StepReport> {
    let start = simulation.stepper.state.clone();
    if simulation.model().moves() && session.scene.time.span.start == Start::Equilibrium {
        session.progress.message("relaxing the initial shape");
    }
    let mut first = StepReport::default();
    match simulation.prepare() {
        Ok(done) => first.relaxation = done,
        // The start is then shown as far as it got, not as an equilibrium.
        Err(Error::Solve(SolveError::Interrupted)) => first.relaxation.residual = f64::NAN,
        Err(error) => return Err(session.report_failure(simulation, error, Some(&start))),
    }
    let (pairs, moved) = first.relaxation.separated;
    if pairs > 0 {
        session.note(&format!(
            "contact: {pairs} pairs of the start crossed or were too near, and were moved apart by at most {moved:.3e}"
        ));
    }
    first.work = simulation.spent().work;
    if let Err(error) = try_laws(simulation, session) {
        return Err(session.report_failure(simulation, error, Some(&start)));
    }
    incidents.note_snap(simulation, &first)?;
    if first.relaxation.residual.is_nan() {
        incidents.negative = incidents.monitor.is_some().then_some(f64::NAN);
        return Ok(first);
    }
    let (sheet, x) = (simulation.sheet(), &simulation.stepper.state.x);
    if let Some(note) = lints::on_start(session.scene, sheet, &start.x, x) {
        session.note(&note);
    }
    if let Some(note) = lints::on_explicit_step(session.scene, simulation)? {
        session.note(&note);
    }
    if simulation.sheet().reduction().ranks().is_some() {
        return Ok(first);
    }
    if incidents.monitor.is_none() {
        stability_monitor::warn_of_flat_start(simulation, session.progress)?;
    } else if let Err(error) = incidents.analyse(simulation, &mut first, session.progress) {
        return Err(session.report_failure(simulation, error, Some(&start)));
    }
    Ok(first)
}

/// Evaluates the laws where signals are those of a relaxed sheet, if nothing was found before.
fn try_laws(simulation: &mut Simulation, session: &mut Session<'_>) -> Result<()> {
    if simulation.faults.is_empty() && simulation.model().moves() {
        simulation.try_laws()?.iter().for_each(|fault| session.note(fault));
    }
    Ok(())
}
