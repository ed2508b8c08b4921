//! The loop of a run: brings the start to rest, then steps until the end, and shows every accepted state to the
//! observers; between steps there are events, warnings and checkpoints.

use std::time::Instant;

use super::checkpoint::{Checkpoint, Checkpoints, ResultsSoFar};
use super::invariants::Invariants;
use super::observe::{Frames, LedgerRows, Observer, StopRules};
use super::pattern::resolution_notes;
use super::schedule::OutputSchedule;
use super::self_intersection::Intersections;
use super::stability_monitor::{StabilityMonitor, warn_of_flat_start};
use super::summary::{Ending, Summary};
use super::warnings::Warnings;
use super::{Error, Result, Simulation, StepInfo, failure, ledger_row, lints};
use crate::Stepper;
use crate::model::{Start, State};
use crate::output::events::{Event, Events};
use crate::output::{Interrupt, Progress, ProgressLine, ResultDirectory};
use crate::scene::Scene;
use crate::solve::{Control, SolveError, StepReport};

/// Runs `simulation`, from the checkpoint `from` that it has been brought to, if there is one, and shows every accepted
/// state to `others` as well.
///
/// # Errors
/// A step that cannot be made, observers, results that are not those of that checkpoint.
pub(super) fn stepped(
    scene: &Scene,
    simulation: &mut Simulation,
    directory: &ResultDirectory,
    progress: &mut Progress,
    interrupt: Interrupt,
    from: Option<&Checkpoint>,
    others: &mut [&mut dyn Observer],
) -> Result<Summary> {
    let mut run = MainLoop::open(scene, simulation, directory, (progress, interrupt), from)?;
    let mut latest = match from {
        None => run.start()?,
        Some(_) => StepReport::default(),
    };
    // Not even the start, or the analysis of its stability, may be complete.
    run.clean = from.is_some() || !run.is_interrupted();
    run.clean &= !latest.relaxation.residual.is_nan();
    loop {
        if let Some(ending) = run.record(&latest, others)? {
            return Ok(run.finish(ending));
        }
        match run.simulation.step(run.schedule.target()) {
            Ok(report) => {
                latest = report;
                run.step_accepted(&mut latest)?;
            }
            Err(Error::Solve(SolveError::Interrupted)) => run.clean = false,
            Err(error) => return Err(run.step_failed(error)),
        }
    }
}

/// A run in progress.
struct MainLoop<'a> {
    scene: &'a Scene,
    directory: &'a ResultDirectory,
    progress: &'a mut Progress,
    interrupt: Interrupt,
    simulation: &'a mut Simulation,
    ledger: LedgerRows,
    rules: StopRules,
    intersections: Intersections,
    frames: Option<Frames>,
    events: Events,
    monitor: Option<StabilityMonitor>,
    /// Negative-curvature directions of the last state, where they are monitored; NaN where they are not known.
    negative: Option<f64>,
    schedule: OutputSchedule,
    checkpoints: Checkpoints,
    warnings: Warnings,
    summary: Summary,
    began: Instant,
    /// Wall time of the parts before this one, s.
    wall_before: f64,
    /// Whether solvers are as the last accepted step has left them.
    clean: bool,
}

impl<'a> MainLoop<'a> {
    /// Opens the files, after what is there at the checkpoint `from`.
    fn open(
        scene: &'a Scene,
        simulation: &'a mut Simulation,
        directory: &'a ResultDirectory,
        (progress, interrupt): (&'a mut Progress, Interrupt),
        from: Option<&Checkpoint>,
    ) -> Result<Self> {
        let began = Instant::now();
        let aside = progress.aside();
        let control = Control::new(move || interrupt.requested(), move |t| aside.report(t));
        simulation.set_control(control);
        let results = from.map(|from| &from.results);
        let watch = results.and_then(|results| results.watch);
        let monitor = StabilityMonitor::open(scene, simulation, directory, watch)?;
        let first = simulation.sheet().reduction().is_first();
        let mut events = match results.filter(|_| first) {
            None => Events::new(directory.events()),
            Some(results) => Events::reopen(directory.events(), results.events)?,
        };
        if monitor.is_some() {
            events.begin()?;
        }
        let model = simulation.model();
        let laws = simulation.invariants.as_ref().map(Invariants::columns).unwrap_or_default();
        let columns = ledger_row::columns(model, monitor.is_some(), &laws);
        let ledger = LedgerRows::open(directory, &columns, from.map(Checkpoint::step), first)?;
        let output = (directory, &scene.output);
        let frames = Frames::open(output, model, &simulation.fields, (results, first))?;
        let mut schedule = OutputSchedule::new(scene);
        if let Some(results) = results {
            let modes = results.watch.map_or(0, |(modes, _)| modes);
            directory.cut_back(results.frame_times.len(), modes)?;
            schedule.resume(&simulation.stepper.state, results.frame_times.last().copied());
        }
        let checkpoints = Checkpoints::open(scene, simulation, directory)?;
        let start = results.map_or_else(Default::default, |results| results.start);
        directory.claim().tell(|reached| reached.start = start);
        Ok(Self {
            scene,
            directory,
            progress,
            interrupt,
            simulation,
            ledger,
            rules: StopRules::new(scene),
            intersections: Intersections::default(),
            frames,
            events,
            monitor,
            negative: None,
            schedule,
            checkpoints,
            warnings: Warnings::default(),
            summary: Summary { start, spent: start, ..Summary::default() },
            began,
            wall_before: results.map_or(0.0, |results| results.wall),
            clean: true,
        })
    }

    fn is_interrupted(&self) -> bool {
        self.simulation.sheet().reduction().any(self.interrupt.requested())
    }

    /// Says what a reader of the results should know, and records it.
    fn note(&mut self, text: &str) {
        self.progress.message(text);
        self.directory.claim().note(text);
    }

    /// Brings the start to rest, with warnings and an analysis of its stability; what that cost.
    fn start(&mut self) -> Result<StepReport> {
        let start = self.simulation.stepper.state.clone();
        let first = self.relaxed_start();
        let spent = self.simulation.spent();
        (self.summary.start, self.summary.spent) = (spent, spent);
        self.directory.claim().tell(|reached| reached.start = spent);
        first.map_err(|error| self.report_failure(error, Some(&start)))
    }

    fn relaxed_start(&mut self) -> Result<StepReport> {
        if self.simulation.model().moves() && self.simulation.stepper.start == Start::Equilibrium {
            self.progress.message("relaxing the initial shape");
        }
        let mut first = StepReport::default();
        match self.simulation.prepare() {
            Ok(done) => first.relaxation = done,
            // The start is then shown as far as it got, not as an equilibrium.
            Err(Error::Solve(SolveError::Interrupted)) => first.relaxation.residual = f64::NAN,
            Err(error) => return Err(error),
        }
        let (pairs, moved) = first.relaxation.separated;
        if pairs > 0 {
            self.note(&format!(
                "{pairs} pairs of features of the start crossed or were too near, and were moved apart by at most {moved:.3e}"
            ));
        }
        first.work = self.simulation.spent().work;
        // Where signals are those of a relaxed sheet, if nothing was found before.
        if self.simulation.faults.is_empty() && self.simulation.model().moves() {
            let faults = self.simulation.try_laws()?.to_vec();
            faults.iter().for_each(|fault| self.note(fault));
        }
        self.note_snap(&first)?;
        if first.relaxation.residual.is_nan() {
            self.negative = self.monitor.is_some().then_some(f64::NAN);
            return Ok(first);
        }
        if let Some(note) = lints::on_explicit_step(self.scene, self.simulation)? {
            self.note(&note);
        }
        if self.simulation.sheet().reduction().ranks().is_some() {
            return Ok(first);
        }
        if self.monitor.is_none() {
            warn_of_flat_start(self.simulation, self.progress)?;
        }
        self.analyse(&mut first)?;
        Ok(first)
    }

    /// Writes an event for a step in which a snap ended, with the vertex that moved most in it.
    fn note_snap(&mut self, report: &StepReport) -> Result<()> {
        let done = &report.relaxation;
        if done.snaps > 0 {
            let state = &self.simulation.stepper.state;
            let place = done.snapped.map(|vertex| (vertex, state.x[vertex]));
            self.events.append(&Event {
                time: state.time,
                step: state.step,
                kind: "snap",
                released: Some(done.released),
                place: place.map(|(vertex, x)| (vertex, [x.x, x.y, x.z])),
                ..Event::default()
            })?;
        }
        Ok(())
    }

    /// Analyses the stability of the state that was just accepted, if that is asked for.
    fn analyse(&mut self, report: &mut StepReport) -> Result<()> {
        if let Some(monitor) = &mut self.monitor {
            let to = (&mut self.events, &mut *self.progress);
            self.negative = Some(monitor.analyse(self.simulation, report, to)?);
        }
        Ok(())
    }

    /// Shows the state, which the step of `latest` has led to, to all observers; why the run ends, if it does.
    fn record(
        &mut self,
        latest: &StepReport,
        others: &mut [&mut dyn Observer],
    ) -> Result<Option<Ending>> {
        let stopwatch = Instant::now();
        let new = self.schedule.is_new(self.simulation.stepper.state.step);
        let due = new && self.checkpoints.renew_if_due(self.simulation);
        let frames_before = self.frame_count();
        let scheduled = self.schedule.is_due(self.simulation.stepper.state.time);
        let ending = match self.observe(latest, others) {
            Ok(ending) => ending,
            Err(error) => return Err(self.report_failure(error, None)),
        };
        let intersection = self.intersections.last();
        self.summary.intersection = intersection;
        self.directory.claim().tell(|reached| reached.intersection = intersection);
        if let Some(text) = self.intersections.first_message() {
            self.progress.message(&text);
        }
        if ending.is_some_and(|ending| ending != Ending::Interrupted) {
            for text in resolution_notes(&mut self.simulation.stepper) {
                self.note(&text);
            }
        }
        self.schedule.pass(self.simulation.stepper.state.time);
        // A frame of an interruption is not one of the run without it.
        let extra = ending == Some(Ending::Interrupted) && !scheduled;
        let frames = if extra { frames_before } else { self.frame_count() };
        self.checkpoint(ending, due, frames);
        self.summary.output += stopwatch.elapsed();
        Ok(ending)
    }

    fn observe(
        &mut self,
        latest: &StepReport,
        others: &mut [&mut dyn Observer],
    ) -> Result<Option<Ending>> {
        let (spent, wall) = (self.simulation.spent(), self.wall());
        let laws = self.simulation.invariants.as_ref().map(Invariants::row).unwrap_or_default();
        let Stepper { workspace, state, breakpoints, .. } = &mut self.simulation.stepper;
        let state = &*state;
        let mut at = workspace.at(state);
        let claim = self.directory.claim();
        claim.tell(|reached| (reached.time, reached.spent) = (state.time, spent));
        (self.summary.time, self.summary.step) = (state.time, state.step);
        let mut observers: Vec<&mut dyn Observer> =
            vec![&mut self.ledger, &mut self.rules, &mut self.intersections];
        observers.extend(others.iter_mut().map(|other| -> &mut dyn Observer { &mut **other }));
        observers.extend(self.frames.as_mut().map(|frames| -> &mut dyn Observer { frames }));
        let mut ending = None;
        for observer in &mut observers {
            ending = ending.or(observer.stop(&mut at)?);
        }
        // At rest for now is not steady where what drives the sheet still changes.
        ending = ending.filter(|ending| {
            let reduction = at.model().sheet().reduction();
            *ending != Ending::Steady || !breakpoints.changes_after(state.time, reduction)
        });
        let negative = self.negative;
        // A run that has ended cannot be interrupted, unless the analysis of its stability was.
        let open = ending.is_none_or(|ending| ending == Ending::Steady)
            || negative.is_some_and(f64::is_nan);
        if open && at.model().sheet().reduction().any(self.interrupt.requested()) {
            ending = Some(Ending::Interrupted);
        }
        let wanted = self.schedule.is_due(state.time) || ending.is_some();
        let frame = self.schedule.is_frame(state.step, wanted);
        // After an interrupted step attempt the state is the one observed before.
        let new = self.schedule.is_new(state.step);
        self.schedule.observe(state.step, frame);
        if new || frame {
            let info = StepInfo { report: latest, frame, new, negative, invariants: &laws, wall };
            for observer in &mut observers {
                observer.observe(&mut at, &info)?;
            }
        }
        Ok(ending)
    }

    /// Wall time of the run, without interruptions, s.
    fn wall(&self) -> f64 {
        self.wall_before + self.began.elapsed().as_secs_f64()
    }

    fn frame_count(&self) -> usize {
        self.frames.as_ref().map_or(0, |frames| frames.times().len())
    }

    /// Makes or writes a checkpoint where one is `due` or the run ends, with so many `frames`.
    fn checkpoint(&mut self, ending: Option<Ending>, due: bool, frames: usize) {
        let (start, wall) = (self.summary.start, self.wall());
        let Self { checkpoints, monitor, events, simulation, progress, .. } = self;
        let written = self.frames.as_ref();
        let results = || ResultsSoFar {
            start,
            wall,
            frame_times: written.map_or_else(Vec::new, |all| all.times()[..frames].to_vec()),
            digests: written.map_or_else(Vec::new, |all| all.digests()[..frames].to_vec()),
            events: events.count(),
            watch: monitor.as_ref().map(StabilityMonitor::seen),
        };
        match ending {
            None => checkpoints.after_step(simulation, results, due, progress),
            Some(Ending::Interrupted) => {
                let clean = self.clean;
                self.summary.resumable =
                    checkpoints.after_interruption(simulation, results, clean, progress);
            }
            Some(_) => checkpoints.after_end(simulation, results, progress),
        }
    }

    /// After an accepted step, before its state is recorded.
    fn step_accepted(&mut self, latest: &mut StepReport) -> Result<()> {
        self.note_snap(latest)?;
        if self.monitor.is_some() {
            if let Err(error) = self.analyse(latest) {
                return Err(self.report_failure(error, None));
            }
            // It may have been interrupted.
            self.clean &= !self.interrupt.requested();
        }
        let State { time, step, .. } = self.simulation.stepper.state;
        let target = self.schedule.target();
        let to_output = time == target && target < self.scene.time.span.until.get();
        self.summary.to_outputs[0] += u64::from(to_output);
        self.summary.to_outputs[1] += 1;
        let cut = time == target || self.simulation.stepper.breakpoints.include(time);
        for text in self.warnings.after(self.simulation, latest, cut) {
            self.note(&text);
        }
        self.summary.spent = self.simulation.spent();
        self.summary.drag_share = latest.relaxation.drag_share;
        self.progress.update(&ProgressLine { time, step, dt: latest.length });
        Ok(())
    }

    /// The error of a step that left the state before it: with a checkpoint there, from which the run can be resumed.
    fn step_failed(&mut self, error: Error) -> Error {
        let alone = self.simulation.sheet().reduction().ranks().is_none();
        if alone && !matches!(error, Error::Solve(SolveError::BlowUp { .. })) {
            self.checkpoint(Some(Ending::Interrupted), false, self.frame_count());
        }
        self.report_failure(error, None)
    }

    fn report_failure(&mut self, error: Error, start: Option<&State>) -> Error {
        failure::report((self.scene, self.directory), self.simulation, error, start)
    }

    /// The summary of a run that has ended.
    fn finish(mut self, ending: Ending) -> Summary {
        if let Some(text) = self.warnings.at_end().filter(|_| ending != Ending::Interrupted) {
            self.note(text);
        }
        self.summary.ending = ending;
        self.summary.frames = self.frame_count();
        self.summary.invariants =
            self.simulation.invariants.as_ref().map(Invariants::worst).unwrap_or_default();
        self.summary.wall = self.began.elapsed();
        self.summary
    }
}
