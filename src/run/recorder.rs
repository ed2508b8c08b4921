//! Everything that is recorded of a run between two steps: observers, events, checkpoints, warnings, the forecast.

use std::time::{Duration, Instant};

use super::checkpoint::{Checkpoint, Checkpoints, Place};
use super::failure;
use super::forecast::{Clock, Prediction};
use super::invariants::Invariants;
use super::observe::{Frames, LedgerRows, Observer, StepInfo, StopRules};
use super::schedule::OutputSchedule;
use super::self_intersection::Intersections;
use super::stability_monitor::StabilityMonitor;
use super::summary::{Ending, Failure, Summary};
use super::warnings::Warnings;
use super::{Error, Result, Simulation, report};
use crate::model::State;
use crate::output::events::{Event, Events};
use crate::output::{Interrupt, Progress, ProgressLine, ResultDirectory};
use crate::scene::Scene;
use crate::solve::StepReport;

/// Where a run comes from and whom it reports to.
pub(super) struct Session<'a> {
    pub(super) scene: &'a Scene,
    pub(super) directory: &'a ResultDirectory,
    pub(super) progress: &'a mut Progress,
    pub(super) interrupt: Interrupt,
}

impl Session<'_> {
    /// Writes the failure report of a run that stopped with `error`, in the first relaxation of `start` if that is given; an
    /// error of output stays as it is.
    pub(super) fn stopped(
        &self,
        simulation: &mut Simulation,
        error: Error,
        start: Option<&State>,
    ) -> Error {
        if matches!(error, Error::Output(_)) {
            return error;
        }
        let error = super::located(error, simulation.sheet(), &simulation.state.x);
        let error = failure::diagnosed(self.scene, simulation, error);
        // A first relaxation that failed leaves the shape where it stuck, which is inspected beside it.
        if let Some(start) = start {
            simulation.state.clone_from(start);
        }
        match failure::write(self.scene, simulation, self.directory, (&error, start)) {
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
}

/// The observers that every run has.
pub(super) struct Outputs {
    ledger: LedgerRows,
    rules: StopRules,
    intersections: Intersections,
    frames: Option<Frames>,
}

impl Outputs {
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
        let laws = simulation.invariants.as_ref().map(Invariants::columns).unwrap_or_default();
        let columns = report::columns(model, monitored, &laws);
        let ledger = match from {
            None => LedgerRows::create(directory, &columns)?,
            Some(from) => LedgerRows::reopen(directory, &columns, from.step())?,
        };
        if let Some(place) = from.map(|from| &from.place) {
            frames = frames.map(|f| f.after(&place.frames, &place.digests)).transpose()?;
            directory.cut_back(place.frames.len(), place.watch.map_or(0, |(modes, _)| modes))?;
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
    fn count(&self) -> usize {
        self.frames.as_ref().map_or(0, |frames| frames.times().len())
    }

    /// Times and digests of the first `count` frames.
    fn first(&self, count: usize) -> (Vec<f64>, Vec<u64>) {
        self.frames.as_ref().map_or_else(Default::default, |frames| {
            (frames.times()[..count].to_vec(), frames.digests()[..count].to_vec())
        })
    }
}

/// Events of a run, and its stability where the scene asks for it.
pub(super) struct Incidents {
    pub(super) events: Events,
    pub(super) monitor: Option<StabilityMonitor>,
    /// Negative-curvature directions of the last state; NaN where they are not known.
    pub(super) negative: Option<f64>,
}

impl Incidents {
    /// Opens the list of events, after those at `place`.
    ///
    /// # Errors
    /// A sheet too large for a factor, or files that cannot be made.
    pub(super) fn open(
        session: &Session<'_>,
        simulation: &mut Simulation,
        place: Option<&Place>,
    ) -> Result<Self> {
        let Session { scene, directory, .. } = session;
        let from = place.and_then(|place| place.watch);
        let monitor = StabilityMonitor::of(scene, simulation, directory, from)?;
        let mut events = match place {
            None => Events::new(directory.events()),
            Some(place) => Events::reopen(directory.events(), place.events)?,
        };
        if monitor.is_some() {
            events.begin()?;
        }
        Ok(Self { events, monitor, negative: None })
    }

    /// Writes an event for a step in which the shape jumped from one branch of equilibria to another.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub(super) fn note_snap(&mut self, simulation: &Simulation, report: &StepReport) -> Result<()> {
        let done = &report.relaxation;
        if done.jumps > 0 {
            let (time, step) = (simulation.state.time, simulation.state.step);
            let released = Some(done.released);
            self.events.append(&Event {
                time,
                step,
                kind: "snap",
                released,
                ..Event::default()
            })?;
        }
        Ok(())
    }

    /// Analyses the stability of the state that was just accepted, if that is asked for.
    ///
    /// # Errors
    /// As [`StabilityMonitor::look`].
    pub(super) fn analyse(
        &mut self,
        simulation: &mut Simulation,
        report: &mut StepReport,
        progress: &mut Progress,
    ) -> Result<()> {
        if let Some(monitor) = &mut self.monitor {
            let to = (&mut self.events, progress);
            self.negative = Some(monitor.analyse(simulation, report, to)?);
        }
        Ok(())
    }
}

/// Wall time of a run, without interruptions.
#[derive(Clone, Copy)]
pub(super) struct RunClock {
    pub(super) clock: Clock,
    /// Of the parts before this one, s.
    pub(super) before: f64,
}

impl RunClock {
    fn wall(&self) -> f64 {
        self.before + self.clock.wall()
    }
}

/// Records a run.
pub(super) struct Recorder<'a> {
    session: Session<'a>,
    outputs: Outputs,
    incidents: Incidents,
    clock: RunClock,
    schedule: OutputSchedule,
    checkpoints: Checkpoints,
    /// A forecast begins with the start of a run: there is none of a resumed one.
    prediction: Prediction,
    resumed: bool,
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
        (outputs, incidents): (Outputs, Incidents),
        (from, first): (Option<&Checkpoint>, &StepReport),
        clock: RunClock,
    ) -> Result<Self> {
        let Session { scene, directory, interrupt, .. } = &session;
        let place = from.map(|from| &from.place);
        let start = place.map_or(simulation.spent(), |place| place.start);
        let checkpoints = Checkpoints::of(scene, simulation, directory)?;
        let prediction = Prediction::new(scene, clock.clock);
        directory.claim().tell(|reached| reached.start = start);
        let mut schedule = OutputSchedule::of(scene);
        if let Some(place) = place {
            schedule.resume(&simulation.state, place.frames.last().copied());
        }
        // Not even the start, or the analysis of its stability, may be complete.
        let complete = from.is_some() || !interrupt.requested();
        let clean = complete && !first.relaxation.residual.is_nan();
        Ok(Self {
            outputs,
            incidents,
            clock,
            schedule,
            checkpoints,
            prediction,
            resumed: from.is_some(),
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
        let new = self.schedule.is_new(simulation.state.step);
        let due = new && self.checkpoints.renew(simulation);
        let frames_before = self.outputs.count();
        let scheduled = self.schedule.is_due(simulation.state.time);
        let ending = match self.observe(simulation, latest, others) {
            Ok(ending) => ending,
            Err(error) => return Err(self.stopped(simulation, error)),
        };
        self.report_intersection();
        self.schedule.pass(simulation.state.time);
        // A frame of an interruption is not one of the run without it.
        let extra = ending == Some(Ending::Interrupted) && !scheduled;
        let frames = if extra { frames_before } else { self.outputs.count() };
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
        let Simulation { workspace, state, invariants, .. } = &mut *simulation;
        let laws = invariants.as_ref().map(Invariants::row).unwrap_or_default();
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
        if open && self.session.interrupt.requested() {
            ending = Some(Ending::Interrupted);
        }
        let wanted = self.schedule.is_due(state.time) || ending.is_some();
        let frame = self.schedule.is_frame(state.step, wanted);
        // After an interrupted step attempt the state is the one observed before.
        let new = self.schedule.is_new(state.step);
        self.schedule.observe(state.step, frame);
        if new || frame {
            let (laws, wall) = (laws.as_slice(), self.clock.wall());
            let info = StepInfo { report: latest, frame, new, negative, laws, wall };
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
        if let Some(text) = intersections.news() {
            self.session.progress.message(&text);
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
        let place = || {
            let (frames, digests) = outputs.first(frames);
            let watch = incidents.monitor.as_ref().map(StabilityMonitor::seen);
            let (wall, events) = (clock.wall(), incidents.events.count());
            Place { start, wall, frames, digests, events, watch }
        };
        let progress = &mut *session.progress;
        match ending {
            None => checkpoints.accepted(simulation, place, due, progress),
            Some(Ending::Interrupted) => {
                summary.resumable = checkpoints.interrupted(simulation, place, *clean, progress);
            }
            Some(_) => checkpoints.ended(simulation, place, progress),
        }
    }

    /// After an accepted step, before its state is recorded.
    ///
    /// # Errors
    /// Events that cannot be written, and an analysis of stability that fails.
    pub(super) fn accept(
        &mut self,
        simulation: &mut Simulation,
        latest: &mut StepReport,
    ) -> Result<()> {
        self.incidents.note_snap(simulation, latest)?;
        if self.incidents.monitor.is_some() {
            let analysed = self.incidents.analyse(simulation, latest, self.session.progress);
            if let Err(error) = analysed {
                return Err(self.stopped(simulation, error));
            }
            // It may have been interrupted.
            self.clean &= !self.session.interrupt.requested();
        }
        let time = simulation.state.time;
        let cut = time == self.target() || simulation.breakpoints.include(time);
        for text in self.warnings.after(simulation, latest, cut) {
            self.session.progress.message(&text);
        }
        self.summary.spent = simulation.spent();
        if !self.resumed {
            self.prediction.step(latest, time, cut);
        }
        if let Some((predicted, words)) = self.prediction.announced() {
            self.session.directory.claim().tell(|reached| reached.predicted = Some(predicted));
            self.session.progress.message(&words);
        }
        self.session.progress.update(&ProgressLine {
            time,
            step: simulation.state.step,
            dt: latest.step,
            residual: latest.relaxation.residual,
            left: self.prediction.left().unwrap_or_default(),
            note: format!("{} iterations", latest.relaxation.iterations),
        });
        Ok(())
    }

    /// After a step attempt that was interrupted.
    pub(super) fn interrupt(&mut self) {
        self.clean = false;
    }

    /// As [`Session::stopped`], in a step.
    pub(super) fn stopped(&self, simulation: &mut Simulation, error: Error) -> Error {
        self.session.stopped(simulation, error, None)
    }

    /// The summary of a run that has ended.
    pub(super) fn finish(mut self, simulation: &Simulation, ending: Ending) -> Summary {
        self.summary.ending = ending;
        self.summary.frames = self.outputs.count();
        self.summary.predicted = self.prediction.judged();
        let predicted = self.summary.predicted;
        self.session.directory.claim().tell(|reached| reached.predicted = predicted);
        self.summary.laws =
            simulation.invariants.as_ref().map(Invariants::worst).unwrap_or_default();
        self.summary.wall = Duration::from_secs_f64(self.clock.clock.wall());
        self.summary
    }
}
