//! Everything that is recorded of a run between two steps: observers, events, checkpoints, warnings.

use std::sync::Arc;
use std::time::Instant;

use super::checkpoint::{Checkpoint, Checkpoints, ResultsSoFar};
use super::incidents::RunEvents;
use super::invariants::Invariants;
use super::observe::{Frames, LedgerRows, Observer, StopRules};
use super::pattern::{Pattern, resolution_words, wrinkle_words};
use super::schedule::OutputSchedule;
use super::self_intersection::Intersections;
use super::session::Session;
use super::stability_monitor::StabilityMonitor;
use super::summary::{Ending, Summary};
use super::warnings::Warnings;
use super::{Error, Result, Simulation, StepInfo, ledger_row};
use crate::Stepper;
use crate::output::ProgressLine;
use crate::solve::{SolveError, StepReport};

/// The observers that every run has.
pub(super) struct RunObservers {
    ledger: LedgerRows,
    rules: StopRules,
    intersections: Intersections,
    frames: Option<Frames>,
}

impl RunObservers {
    /// Opens the files in the directory of `session`, after what is there at the checkpoint `from`. The ledger has columns
    /// of stability if that is `monitored`.
    ///
    /// # Errors
    /// Files that cannot be made, or that are not those of the checkpoint.
    pub(super) fn open(
        session: &Session<'_>,
        simulation: &Simulation,
        from: Option<&Checkpoint>,
        monitored: bool,
    ) -> Result<Self> {
        let Session { scene, directory, .. } = session;
        let model = simulation.model();
        let mut frames = Frames::create(directory, model, &simulation.fields, &scene.output)?;
        let invariants =
            simulation.invariants.as_ref().map(Invariants::columns).unwrap_or_default();
        let columns = ledger_row::columns(model, monitored, &invariants);
        let first = model.sheet().reduction().is_first();
        let ledger = match from {
            _ if !first => LedgerRows::without_output(),
            None => LedgerRows::create(directory, &columns)?,
            Some(from) => LedgerRows::reopen(directory, &columns, from.step())?,
        };
        if let Some(results) = from.map(|from| &from.results) {
            let after = |f: Frames| f.after(&results.frame_times, &results.digests, first);
            frames = frames.map(after).transpose()?;
            directory
                .cut_back(results.frame_times.len(), results.watch.map_or(0, |(modes, _)| modes))?;
        }
        let (rules, intersections) = (StopRules::of(scene), Intersections::default());
        Ok(Self { ledger, rules, intersections, frames })
    }

    /// All of them, and `others`.
    fn observers<'o>(
        &'o mut self,
        others: &'o mut [&mut dyn Observer],
    ) -> Vec<&'o mut dyn Observer> {
        let Self { ledger, rules, intersections, frames } = self;
        let mut all: Vec<&mut dyn Observer> = vec![ledger, rules, intersections];
        all.extend(others.iter_mut().map(|other| -> &mut dyn Observer { &mut **other }));
        all.extend(frames.as_mut().map(|frames| -> &mut dyn Observer { frames }));
        all
    }

    /// Frames written.
    fn frame_count(&self) -> usize {
        self.frames.as_ref().map_or(0, |frames| frames.times().len())
    }

    /// Times and digests of the first `count` frames.
    fn first_frames(&self, count: usize) -> (Vec<f64>, Vec<u64>) {
        self.frames.as_ref().map_or_else(Default::default, |frames| {
            (frames.times()[..count].to_vec(), frames.digests()[..count].to_vec())
        })
    }
}

/// Wall time of a run, without interruptions.
#[derive(Clone, Copy)]
pub(super) struct RunClock {
    pub(super) began: Instant,
    /// Of the parts before this one, s.
    pub(super) before: f64,
}

impl RunClock {
    fn wall(&self) -> f64 {
        self.before + self.began.elapsed().as_secs_f64()
    }
}

/// Records a run.
pub(super) struct Recorder<'a> {
    session: Session<'a>,
    outputs: RunObservers,
    incidents: RunEvents,
    clock: RunClock,
    schedule: OutputSchedule,
    checkpoints: Checkpoints,
    warnings: Warnings,
    summary: Summary,
    /// Whether solvers are as the last accepted step has left them.
    clean: bool,
}

impl<'a> Recorder<'a> {
    /// Of `simulation` after its start, which `first` reports on, or at the checkpoint `from`.
    ///
    /// # Errors
    /// Checkpoints that cannot be made.
    pub(super) fn new(
        session: Session<'a>,
        simulation: &Simulation,
        (outputs, incidents): (RunObservers, RunEvents),
        (from, first): (Option<&Checkpoint>, &StepReport),
        clock: RunClock,
    ) -> Result<Self> {
        let Session { scene, directory, interrupt, .. } = &session;
        let results = from.map(|from| &from.results);
        let start = results.map_or(simulation.spent(), |results| results.start);
        let checkpoints = Checkpoints::of(scene, simulation, directory)?;
        directory.claim().tell(|reached| reached.start = start);
        let mut schedule = OutputSchedule::of(scene);
        if let Some(results) = results {
            schedule.resume(&simulation.stepper.state, results.frame_times.last().copied());
        }
        // Not even the start, or the analysis of its stability, may be complete.
        let reduction = simulation.sheet().reduction();
        let complete = from.is_some() || !reduction.any(interrupt.requested());
        let clean = complete && !first.relaxation.residual.is_nan();
        Ok(Self {
            outputs,
            incidents,
            clock,
            schedule,
            checkpoints,
            warnings: Warnings::default(),
            summary: Summary::at_start(start),
            clean,
            session,
        })
    }

    /// The time at which the next step has to end.
    pub(super) fn target(&self) -> f64 {
        self.schedule.target()
    }

    /// Shows the state of `simulation`, which the step of `latest` has led to, to all observers; why the run ends, if it does.
    ///
    /// # Errors
    /// Those of observers.
    pub(super) fn record(
        &mut self,
        simulation: &mut Simulation,
        latest: &StepReport,
        others: &mut [&mut dyn Observer],
    ) -> Result<Option<Ending>> {
        let stopwatch = Instant::now();
        let new = self.schedule.is_new(simulation.stepper.state.step);
        let due = new && self.checkpoints.renew_if_due(simulation);
        let frames_before = self.outputs.frame_count();
        let scheduled = self.schedule.is_due(simulation.stepper.state.time);
        let ending = match self.observe(simulation, latest, others) {
            Ok(ending) => ending,
            Err(error) => return Err(self.report_failure(simulation, error)),
        };
        self.report_intersection();
        if ending.is_some_and(|ending| ending != Ending::Interrupted) {
            self.report_resolution(simulation);
        }
        self.schedule.pass(simulation.stepper.state.time);
        // A frame of an interruption is not one of the run without it.
        let extra = ending == Some(Ending::Interrupted) && !scheduled;
        let frames = if extra { frames_before } else { self.outputs.frame_count() };
        self.checkpoint(simulation, ending, due, frames);
        self.summary.output += stopwatch.elapsed();
        Ok(ending)
    }

    fn observe(
        &mut self,
        simulation: &mut Simulation,
        latest: &StepReport,
        others: &mut [&mut dyn Observer],
    ) -> Result<Option<Ending>> {
        let spent = simulation.spent();
        let Simulation { stepper: Stepper { workspace, state, .. }, invariants, .. } =
            &mut *simulation;
        let invariants = invariants.as_ref().map(Invariants::row).unwrap_or_default();
        let state = &*state;
        let mut at = workspace.at(state);
        let claim = self.session.directory.claim();
        claim.tell(|reached| (reached.time, reached.spent) = (state.time, spent));
        (self.summary.time, self.summary.step) = (state.time, state.step);
        let mut observers = self.outputs.observers(others);
        let mut ending = None;
        for observer in &mut observers {
            ending = ending.or(observer.stop(&mut at)?);
        }
        let negative = self.incidents.negative;
        // A run that has ended cannot be interrupted, unless the analysis of its stability was.
        let open = ending.is_none_or(|ending| ending == Ending::Steady)
            || negative.is_some_and(f64::is_nan);
        let reduction = at.model().sheet().reduction();
        if open && reduction.any(self.session.interrupt.requested()) {
            ending = Some(Ending::Interrupted);
        }
        let wanted = self.schedule.is_due(state.time) || ending.is_some();
        let frame = self.schedule.is_frame(state.step, wanted);
        // After an interrupted step attempt the state is the one observed before.
        let new = self.schedule.is_new(state.step);
        self.schedule.observe(state.step, frame);
        if new || frame {
            let (invariants, wall) = (invariants.as_slice(), self.clock.wall());
            let info = StepInfo { report: latest, frame, new, negative, invariants, wall };
            for observer in &mut observers {
                observer.observe(&mut at, &info)?;
            }
        }
        Ok(ending)
    }

    fn report_intersection(&mut self) {
        let intersections = &mut self.outputs.intersections;
        self.summary.intersection = intersections.last();
        let last = self.summary.intersection;
        self.session.directory.claim().tell(|reached| reached.intersection = last);
        if let Some(text) = intersections.first_message() {
            self.session.progress.message(&text);
        }
    }

    /// Says where the patterns of the last state are too narrow for the mesh.
    fn report_resolution(&mut self, simulation: &mut Simulation) {
        let Stepper { workspace, state, .. } = &mut simulation.stepper;
        let sheet = Arc::clone(workspace.model.sheet());
        // A rank has no pattern but its part of it.
        if sheet.reduction().distribution().is_some() || sheet.edges().is_empty() {
            return;
        }
        let species = Pattern::of_species(&mut workspace.at(state));
        let species = Pattern::narrowest(&species, &state.x, &sheet).and_then(resolution_words);
        let shape = Pattern::of_shape(&mut workspace.at(state)).ok().flatten();
        let shape = shape.and_then(|shape| shape.width(&state.x, &sheet)).and_then(wrinkle_words);
        for words in species.into_iter().chain(shape) {
            self.session.note(&words);
        }
    }

    /// Makes or writes a checkpoint where one is `due` or the run ends, with so many `frames`.
    fn checkpoint(
        &mut self,
        simulation: &mut Simulation,
        ending: Option<Ending>,
        due: bool,
        frames: usize,
    ) {
        let Self { checkpoints, outputs, incidents, clock, summary, session, clean, .. } = self;
        let start = summary.start;
        let results = || {
            let (frame_times, digests) = outputs.first_frames(frames);
            let watch = incidents.monitor.as_ref().map(StabilityMonitor::seen);
            let (wall, events) = (clock.wall(), incidents.events.count());
            ResultsSoFar { start, wall, frame_times, digests, events, watch }
        };
        let progress = &mut *session.progress;
        match ending {
            None => checkpoints.after_step(simulation, results, due, progress),
            Some(Ending::Interrupted) => {
                summary.resumable =
                    checkpoints.after_interruption(simulation, results, *clean, progress);
            }
            Some(_) => checkpoints.after_end(simulation, results, progress),
        }
    }

    /// After an accepted step, before its state is recorded.
    ///
    /// # Errors
    /// Events that cannot be written, and an analysis of stability that fails.
    pub(super) fn step_accepted(
        &mut self,
        simulation: &mut Simulation,
        latest: &mut StepReport,
    ) -> Result<()> {
        self.incidents.note_snap(simulation, latest)?;
        if self.incidents.monitor.is_some() {
            let analysed = self.incidents.analyse(simulation, latest, self.session.progress);
            if let Err(error) = analysed {
                return Err(self.report_failure(simulation, error));
            }
            // It may have been interrupted.
            self.clean &= !self.session.interrupt.requested();
        }
        let time = simulation.stepper.state.time;
        let target = self.target();
        let to_output = time == target && target < self.session.scene.time.span.until.get();
        self.summary.to_outputs[0] += u64::from(to_output);
        self.summary.to_outputs[1] += 1;
        let cut = time == target || simulation.stepper.breakpoints.include(time);
        for text in self.warnings.after(simulation, latest, cut) {
            self.session.note(&text);
        }
        self.summary.spent = simulation.spent();
        self.summary.drag_share = latest.relaxation.drag_share;
        self.session.progress.update(&ProgressLine {
            time,
            step: simulation.stepper.state.step,
            dt: latest.length,
        });
        Ok(())
    }

    /// After a step attempt that was interrupted.
    pub(super) fn note_interruption(&mut self) {
        self.clean = false;
    }

    /// As [`Recorder::report_failure`], of a step that left the state before it: with a checkpoint there, from which the
    /// run can be resumed.
    pub(super) fn step_failed(&mut self, simulation: &mut Simulation, error: Error) -> Error {
        let alone = simulation.sheet().reduction().ranks().is_none();
        if alone && !matches!(error, Error::Solve(SolveError::BlowUp { .. })) {
            let frames = self.outputs.frame_count();
            self.checkpoint(simulation, Some(Ending::Interrupted), false, frames);
        }
        self.report_failure(simulation, error)
    }

    /// As [`Session::report_failure`], in a step.
    pub(super) fn report_failure(&self, simulation: &mut Simulation, error: Error) -> Error {
        self.session.report_failure(simulation, error, None)
    }

    /// The summary of a run that has ended.
    pub(super) fn finish(mut self, simulation: &Simulation, ending: Ending) -> Summary {
        if let Some(text) = self.warnings.at_end().filter(|_| ending != Ending::Interrupted) {
            self.session.note(text);
        }
        self.summary.ending = ending;
        self.summary.frames = self.outputs.frame_count();
        self.summary.invariants =
            simulation.invariants.as_ref().map(Invariants::worst).unwrap_or_default();
        self.summary.wall = self.clock.began.elapsed();
        self.summary
    }
}
