//! The run: relax the start, then step until the end, showing every accepted state to the
//! observers (frames, ledger, progress).

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::hearsay::Hearsay;
use super::watch::{self, Watch};
use super::{Setup, laws, notes, report};
use crate::num::real;
use crate::output::{
    Compression, Interrupt, Ledger, Progress, ProgressLine, ResultDirectory, Series, Standing,
    interrupt, vtu,
};
use crate::scene::Scene;
use crate::solve::{SolveError, StepReport};
use crate::state::State;
use crate::system::System;
use crate::{Error, Result};

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The end time was reached.
    Reached,
    /// No species changed any more.
    Steady,
    /// The scene's number of steps was reached.
    Steps,
    /// The user asked to stop.
    Interrupted,
}

impl std::fmt::Display for Ending {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Reached => "the end time is reached",
            Self::Steady => "nothing changes any more",
            Self::Steps => "the number of steps is reached",
            Self::Interrupted => "interrupted; the last accepted state is written",
        })
    }
}

/// What a run did.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// Why it ended.
    pub ending: Ending,
    /// Time reached.
    pub time: f64,
    /// Accepted steps.
    pub steps: u64,
    /// Frames written.
    pub frames: usize,
    /// All relaxation work.
    pub iterations: usize,
    /// Numeric factorisations.
    pub factorisations: usize,
    /// Rejected steps.
    pub rejected: usize,
    /// Wall time of the whole run.
    pub wall: Duration,
    /// Wall time of the first relaxation.
    pub start: Duration,
    /// Wall time of writing.
    pub output: Duration,
}

/// A run that failed, with the last good state on the disk.
#[derive(Debug, thiserror::Error)]
#[error("{error}\nthe run stopped at time {time}, step {step}; the last good state is in {}", state.display())]
pub struct Failure {
    /// What went wrong.
    pub error: Box<Error>,
    /// Time of the last good state.
    pub time: f64,
    /// Step of the last good state.
    pub step: u64,
    /// Where it was written.
    pub state: PathBuf,
}

/// Does `work`, which writes to `directory`, and leaves word there of how it ended.
///
/// # Errors
/// Those of `work`; a status that cannot be written.
pub fn accounted(
    directory: &ResultDirectory,
    work: impl FnOnce() -> Result<Summary>,
) -> Result<Summary> {
    let outcome = work();
    let claim = directory.claim();
    match &outcome {
        Ok(summary) if summary.ending == Ending::Interrupted => {
            claim.end(Standing::Interrupted, interrupt::reason())?;
        }
        Ok(summary) => claim.end(Standing::Complete, &summary.ending.to_string())?,
        // The first failure is the one to report.
        Err(error) => drop(claim.end(Standing::Failed, &error.to_string())),
    }
    outcome
}

/// Runs `setup` and writes into `directory`.
///
/// Steady means: the largest |dc/dt| over all points, in units of each species' typical
/// magnitude, is below `time.stop_when_steady`.
///
/// # Errors
/// [`Error::Stopped`] if a step cannot be made; output that cannot be written.
pub fn run(
    scene: &Scene,
    setup: &mut Setup,
    directory: &ResultDirectory,
    progress: &mut Progress,
    interrupt: Interrupt,
) -> Result<Summary> {
    observed(scene, setup, directory, progress, interrupt, &mut |_, _| ())
}

/// [`run`], showing the state of every frame to `observe` as well.
///
/// # Errors
/// As [`run`].
pub fn observed(
    scene: &Scene,
    setup: &mut Setup,
    directory: &ResultDirectory,
    progress: &mut Progress,
    interrupt: Interrupt,
    observe: &mut dyn FnMut(&mut System, &State),
) -> Result<Summary> {
    let began = Instant::now();
    setup.system.set_interrupt(move || interrupt.requested());
    let aside = progress.aside();
    setup.system.set_listener(move |text| aside.tell(text));
    let compression = scene.output.compression;
    // A point has no frames: its solution is the ledger.
    let space = !setup.sheet.triangles().is_empty();
    let mut series = space
        .then(|| Series::create(directory, compression))
        .transpose()?
        .map(|s| s.in_format(scene.output.format));
    let mut watch = Watch::of(scene, setup, directory)?;
    let columns = report::columns(&mut setup.system, watch.is_some());
    let mut ledger = Ledger::create(&directory.ledger(), &columns)?;
    let mut output = Duration::ZERO;

    progress.message("relaxing the start");
    let asked = setup.state.x.clone();
    let mut first = StepReport::default();
    match setup.integrator.prepare(&mut setup.system, &mut setup.state) {
        Ok(done) => first.relaxation = done,
        // The start is then shown as far as it got, not as an equilibrium.
        Err(Error::Solve(SolveError::Interrupted)) => first.relaxation.residual = f64::NAN,
        Err(error) => return Err(stopped(setup, directory, compression, error)),
    }
    if let Err(error) = look_again(setup, progress) {
        return Err(stopped(setup, directory, compression, error));
    }
    if !first.relaxation.residual.is_nan()
        && let Some(note) = notes::on_start(scene, &setup.sheet, &asked, &setup.state.x)
    {
        progress.message(&note);
    }
    let mut negative = None;
    match &mut watch {
        Some(watch) if !first.relaxation.residual.is_nan() => {
            negative = Some(look(watch, setup, &mut first, progress, directory)?);
        }
        Some(_) => negative = Some(f64::NAN),
        None if !first.relaxation.residual.is_nan() => watch::warn_of_flat_start(setup, progress),
        None => {}
    }
    let start = began.elapsed();
    let mut summary = Summary {
        ending: Ending::Reached,
        time: 0.0,
        steps: 0,
        frames: 0,
        iterations: first.relaxation.iterations,
        factorisations: first.relaxation.factorisations,
        rejected: 0,
        wall: start,
        start,
        output,
    };
    let until = scene.time.span.until.get();
    let every = scene.output.every.map_or(until, |e| e.get().min(until));
    let mut written = 0usize;
    let mut latest = first;
    let mut shown = None;
    let mut observed = None;
    let (mut hearsay, mut failed) = (Hearsay::default(), 0);
    loop {
        let stopwatch = Instant::now();
        let (state, system) = (&setup.state, &mut setup.system);
        let wall = began.elapsed().as_secs_f64();
        // After an interrupted try the state is the one shown before.
        if shown != Some(state.step) {
            ledger.append(&report::row(system, &setup.sheet, state, &latest, negative, wall))?;
        }
        shown = Some(state.step);
        directory.claim().reached(state.time);
        summary.time = state.time;
        summary.steps = state.step;
        // What has come to its end cannot be interrupted any more.
        let ending = if state.time >= until {
            Some(Ending::Reached)
        } else if scene.time.span.max_steps.is_some_and(|m| state.step >= m.get() as u64) {
            Some(Ending::Steps)
        } else if interrupt.requested() {
            Some(Ending::Interrupted)
        } else if let Some(rate) = scene.time.span.stop_when_steady
            && state.step > 0
            && system.unrest(state)? < rate.get()
        {
            Some(Ending::Steady)
        } else {
            None
        };
        // Output times are multiples of `every` counted in whole numbers; steps hit them exactly.
        let due = state.time >= real(written) * every;
        if due || ending.is_some() {
            if observed.replace(state.step) != Some(state.step) {
                observe(system, state);
            }
            if let Some(series) = &mut series
                && series.times().last() != Some(&state.time)
            {
                match setup.fields.frame(system, &setup.sheet, state) {
                    Ok(frame) => drop(series.push(&frame)?),
                    Err(error) => return Err(stopped(setup, directory, compression, error)),
                }
            }
            while real(written) * every <= state.time {
                written += 1;
            }
        }
        output += stopwatch.elapsed();
        if let Some(ending) = ending {
            summary.ending = ending;
            break;
        }
        let target = (real(written) * every).min(until);
        match setup.integrator.advance(&mut setup.system, &mut setup.state, target) {
            Ok(report) => latest = report,
            Err(Error::Solve(SolveError::Interrupted)) => {
                // The system still holds the rest metric of the unfinished try.
                setup.system.follow(&setup.state)?;
                continue;
            }
            Err(error) => return Err(stopped(setup, directory, compression, error)),
        }
        if let Some(watch) = &mut watch {
            negative = Some(look(watch, setup, &mut latest, progress, directory)?);
        }
        for fault in hearsay.news(setup) {
            progress.message(&fault);
            setup.faults.push(fault);
        }
        if let Some(reason) = latest.reason.take() {
            failed += 1;
            if failed == TIRESOME {
                progress.message(&format!("steps are tried again and again, shorter: {reason}"));
            }
        }
        summary.iterations += latest.relaxation.iterations;
        summary.factorisations += latest.relaxation.factorisations;
        summary.rejected += latest.rejected;
        progress.update(&ProgressLine {
            time: setup.state.time,
            step: setup.state.step,
            dt: latest.step,
            residual: latest.relaxation.residual,
            note: format!("{} iterations", latest.relaxation.iterations),
        });
    }
    summary.frames = series.map_or(0, |series| series.times().len());
    summary.wall = began.elapsed();
    summary.output = output;
    Ok(summary)
}

/// When that many steps could only be made after a try that came to no result, the reason is told.
const TIRESOME: usize = 5;

/// Looks at the laws where signals are those of a relaxed sheet, if nothing was found before.
fn look_again(setup: &mut Setup, progress: &mut Progress) -> Result<()> {
    if setup.faults.is_empty() && setup.system.moves() {
        setup.faults = laws::try_out(&mut setup.system, &setup.state)?;
        setup.faults.iter().for_each(|fault| progress.message(fault));
    }
    Ok(())
}

/// Lets the watch look at the state that was just accepted; its directions down.
fn look(
    watch: &mut Watch,
    setup: &mut Setup,
    report: &mut StepReport,
    progress: &mut Progress,
    directory: &ResultDirectory,
) -> Result<f64> {
    match watch.look(setup, &mut report.relaxation, progress) {
        Ok(negative) => Ok(negative),
        // The state is then still the saddle.
        Err(Error::Solve(SolveError::Interrupted)) => Ok(f64::NAN),
        Err(error @ Error::Output(_)) => Err(error),
        Err(error) => Err(stopped(setup, directory, Compression::default(), error)),
    }
}

/// Writes the last good state as `failed.vtu`, to be looked at.
fn stopped(
    setup: &mut Setup,
    directory: &ResultDirectory,
    compression: Compression,
    error: Error,
) -> Error {
    let error = super::located(error, &setup.sheet, &setup.state.x);
    let path = directory.failed();
    // The system still holds the rest metric of the failed try.
    let followed = setup.system.follow(&setup.state);
    // An observable may be what went wrong.
    setup.fields.forget_observables();
    let frame =
        followed.and_then(|()| setup.fields.frame(&mut setup.system, &setup.sheet, &setup.state));
    let written = frame.and_then(|frame| Ok(vtu::write(&path, &frame, compression)?));
    match written {
        Err(_) => error,
        Ok(()) => Error::Stopped(Failure {
            error: Box::new(error),
            time: setup.state.time,
            step: setup.state.step,
            state: path,
        }),
    }
}
