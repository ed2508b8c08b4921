//! Checkpoints of a run: all that its later steps and results depend on.
//!
//! ```text
//! made from    scene with all defaults, hashes of mesh, plugins and files
//! results      frames and rows written, what the watch has seen, work and time spent
//! state        time, step, positions, species, internal variables
//! solvers      step control, velocities, the factor in use, what has been learnt
//! ```
//!
//! A run that is continued has the same bits as one that went on, whenever the clock asked for a checkpoint:
//! writing one changes nothing. What a library remembers cannot be written; integrators by diffsol are
//! therefore rebuilt after every so many steps ([`Integrator::renewed_after`](crate::solve::Integrator)),
//! in every run, and have their checkpoints there.
//!
//! A run that is interrupted in the middle of a step has left the solvers somewhere in between. For that a
//! checkpoint is kept in memory, no more than a second's work old where making one is cheap.

use std::path::Path;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::fingerprint::Fingerprint;
use super::invariants;
use super::ranks::{RankPart, Share};
use super::{Error, Result, Simulation};
use crate::model::State;
use crate::num::real;
use crate::output::{CheckpointFiles, Progress, ResultDirectory, checkpoint};
use crate::record::{Malformed, Record};
use crate::scene::{CheckpointSpec, Scene};
use crate::stepper;
use crate::tally::{Meter, Spent};

/// Where the scene says nothing, the first checkpoint is not before this: short runs have none.
const FIRST_INTERVAL: Duration = Duration::from_secs(60);
/// Checkpoints are this many times as far apart as it takes to write one, at least …
const INTERVAL_FACTOR: u32 = 100;
/// … and those in memory this far, at least.
const MIN_MEMORY_INTERVAL: Duration = Duration::from_millis(500);

/// How far the results of a run are, besides its state.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct ResultsSoFar {
    /// What relaxing the start has cost.
    pub(super) start: Spent,
    /// Wall time since the run began, without interruptions, s.
    pub(super) wall: f64,
    /// Times of the frames.
    pub(super) frame_times: Vec<f64>,
    /// Digests of their files.
    pub(super) digests: Vec<u64>,
    /// Events written.
    pub(super) events: usize,
    /// Modes written, and whether the last state had a direction down, where that is watched.
    pub(super) watch: Option<(usize, Option<bool>)>,
}

/// What the solvers of a run remember.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct SolverMemory {
    stepper: stepper::SolverState,
    invariants: Option<Vec<invariants::Seen>>,
}

impl SolverMemory {
    pub(super) fn new(simulation: &Simulation) -> Self {
        Self {
            stepper: simulation.stepper.memory(),
            invariants: simulation.invariants.as_ref().map(invariants::Invariants::memory),
        }
    }

    /// Has the solvers of `simulation`, newly made from the same, remember it.
    ///
    /// # Errors
    /// [`Malformed`] if it does not fit.
    pub(super) fn restore(self, simulation: &mut Simulation) -> Result<(), Malformed> {
        simulation.stepper.restore(&self.stepper)?;
        match (&mut simulation.invariants, self.invariants) {
            (Some(laws), Some(memory)) => laws.restore(memory),
            (None, None) => Ok(()),
            _ => Err(Malformed),
        }
    }
}

/// A checkpoint.
#[derive(Debug, Serialize, Deserialize)]
pub struct Checkpoint {
    pub(super) fingerprint: Fingerprint,
    pub(super) results: ResultsSoFar,
    pub(super) spent: Spent,
    state: State,
    solvers: SolverMemory,
    /// Which part of a sheet over ranks it is of.
    pub(super) share: Option<Share>,
}

impl Checkpoint {
    /// Of `simulation`, which `scene` was set up as, between two steps of a program of its own. An integrator whose history
    /// cannot be stored restarts from the state, here as where this is restored.
    ///
    /// # Errors
    /// A file of the scene that cannot be read any more.
    pub fn capture(scene: &Scene, simulation: &mut Simulation) -> Result<Self> {
        simulation.stepper.integrator.renew();
        Ok(Self::with(Fingerprint::new(scene, simulation)?, simulation, ResultsSoFar::default()))
    }

    fn with(fingerprint: Fingerprint, simulation: &Simulation, results: ResultsSoFar) -> Self {
        Self {
            fingerprint,
            results,
            spent: simulation.spent(),
            state: simulation.stepper.state.clone(),
            solvers: SolverMemory::new(simulation),
            share: simulation.rank_part.as_ref().map(RankPart::share),
        }
    }

    /// Brings `simulation`, newly set up from `scene`, to where this was taken.
    ///
    /// # Errors
    /// [`Error::Refused`] if they are made from something else, with what.
    pub fn take_up(&self, scene: &Scene, simulation: &mut Simulation) -> Result<()> {
        self.fingerprint.check(&Fingerprint::new(scene, simulation)?)?;
        let other = |Malformed| Error::Refused("the checkpoint does not fit its scene".to_owned());
        self.restore(simulation).map_err(other)
    }

    /// Writes it into a file.
    ///
    /// # Errors
    /// From the operating system.
    pub fn write(&self, path: &Path) -> Result<()> {
        Ok(checkpoint::write(path, &Record::encode(self))?)
    }

    /// Reads the file of a checkpoint.
    ///
    /// # Errors
    /// [`Error::Refused`] if it is none, is damaged, or of another version.
    pub fn read(path: &Path) -> Result<Self> {
        let refuse = |why: String| Error::Refused(format!("{}: {why}", path.display()));
        let content = checkpoint::read(path).map_err(|why| refuse(why.to_string()))?;
        content.read().map_err(|Malformed| refuse("it holds something else".to_owned()))
    }

    /// The time that it is of.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.state.time
    }

    /// Times of the frames written until then.
    #[must_use]
    pub fn frame_times(&self) -> &[f64] {
        &self.results.frame_times
    }

    /// The steps made until then.
    #[must_use]
    pub fn step(&self) -> u64 {
        self.state.step
    }

    /// Brings `simulation`, newly made from the same, to where this was taken.
    ///
    /// # Errors
    /// [`Malformed`] if it does not fit.
    pub(super) fn restore(&self, simulation: &mut Simulation) -> Result<(), Malformed> {
        let new = simulation.state();
        let lengths = |state: &State| {
            let all = state.species.iter().chain(&state.internal);
            (state.species.len(), all.map(Vec::len).collect::<Vec<_>>())
        };
        if new.x.len() != self.state.x.len() || lengths(new) != lengths(&self.state) {
            return Err(Malformed);
        }
        self.solvers.clone().restore(simulation)?;
        self.continue_from(self.state.clone(), simulation);
        Ok(())
    }

    /// The state to be checkpointed.
    pub(super) fn state(&self) -> &State {
        &self.state
    }

    /// Continues from `state`; solvers restart with cleared history.
    pub(super) fn continue_from(&self, state: State, simulation: &mut Simulation) {
        simulation.stepper.state = state;
        simulation.spent = self.spent;
    }
}

/// Takes the checkpoints of a run.
pub(super) struct Checkpoints {
    files: CheckpointFiles,
    fingerprint: Fingerprint,
    began: Instant,
    /// Of time.
    every: Option<f64>,
    /// Number of the next multiple of that.
    next: usize,
    wall: Duration,
    /// When the next one is due by the clock.
    due: Instant,
    /// In memory, with when it was made and how long that took.
    held: Option<PendingCheckpoint>,
    /// Whether the scene asks for checkpoints.
    asked: bool,
    /// How many could not be written.
    failed: usize,
    meter: Meter,
}

struct PendingCheckpoint {
    checkpoint: Checkpoint,
    at: Instant,
    took: Duration,
    written: bool,
}

impl Checkpoints {
    /// Of a run of `scene` into `directory`, from where `simulation` is.
    pub(super) fn open(
        scene: &Scene,
        simulation: &Simulation,
        directory: &ResultDirectory,
    ) -> Result<Self> {
        let spec = scene.checkpoint.clone();
        let asked = spec.is_some();
        let CheckpointSpec { every, wall, keep } = spec.unwrap_or_default();
        let now = Instant::now();
        let wall = Duration::from_secs_f64(wall.get().min(1e9));
        let mut made = Self {
            files: CheckpointFiles::open(directory, keep.get())?,
            fingerprint: Fingerprint::new(scene, simulation)?,
            began: now,
            every: every.map(f64::from),
            next: 1,
            due: now + if asked { wall } else { wall.min(FIRST_INTERVAL) },
            wall,
            held: None,
            asked,
            failed: 0,
            meter: simulation.model().tally().meter("output", "checkpoints"),
        };
        made.passes(simulation.stepper.state.time);
        Ok(made)
    }

    /// Whether a multiple of `every` has been reached for the first time.
    fn passes(&mut self, time: f64) -> bool {
        let before = self.next;
        if let Some(every) = self.every {
            // After a long step there may be many of them.
            self.next = self.next.max(crate::num::whole((time / every).floor().min(1e15)));
            while real(self.next) * every <= time {
                self.next += 1;
            }
        }
        self.next > before
    }

    /// After a step: rebuilds the integrator where that is its turn; whether a checkpoint is due by the
    /// scene's schedule. Depends on nothing but steps and times.
    pub(super) fn renew_if_due(&mut self, simulation: &mut Simulation) -> bool {
        let due = self.passes(simulation.stepper.state.time);
        simulation.renew(due);
        due
    }

    /// After an accepted step, where `results` says how far the results are; writes a checkpoint if it is time.
    pub(super) fn after_step(
        &mut self,
        simulation: &Simulation,
        results: impl FnOnce() -> ResultsSoFar,
        due: bool,
        progress: &mut Progress,
    ) {
        let now = Instant::now();
        // Clocks of ranks differ, and all write checkpoints of the same step.
        let reduction = simulation.sheet().reduction();
        let due = reduction.any(due || now >= self.due);
        // An integrator of diffsol can be stored in few steps: none of them is missed.
        let seldom = simulation.stepper.integrator.renewed_after().is_some();
        let least = if seldom { Duration::ZERO } else { MIN_MEMORY_INTERVAL };
        let since =
            |held: &PendingCheckpoint| now - held.at >= least.max(INTERVAL_FACTOR * held.took);
        if due || reduction.any(self.held.as_ref().is_none_or(since)) {
            self.hold(simulation, results);
        }
        if due {
            self.write(progress);
        }
    }

    /// Makes one in memory, where that is possible.
    fn hold(&mut self, simulation: &Simulation, results: impl FnOnce() -> ResultsSoFar) {
        let _scope = self.meter.scope("made or written");
        let at = Instant::now();
        if simulation.stepper.integrator.is_storable() {
            let checkpoint = Checkpoint::with(self.fingerprint.clone(), simulation, results());
            self.held =
                Some(PendingCheckpoint { checkpoint, at, took: at.elapsed(), written: false });
        }
    }

    /// Writes the one in memory; a run does not end because that is not possible.
    fn write(&mut self, progress: &mut Progress) {
        let Some(held) = self.held.as_mut().filter(|held| !held.written) else { return };
        let _scope = self.meter.scope("made or written");
        let began = Instant::now();
        match self.files.write(&Record::encode(&held.checkpoint)) {
            Ok(_) => held.written = true,
            Err(error) => {
                self.failed += 1;
                if self.failed == 1 {
                    progress
                        .message(&format!("no checkpoint is written: {error}; the run continues"));
                }
            }
        }
        self.due = Instant::now() + self.wall.max(INTERVAL_FACTOR * began.elapsed());
    }

    /// Writes the last one of a run that is interrupted; `clean` if it is between two steps. The step from
    /// which it can be continued, if it can.
    pub(super) fn after_interruption(
        &mut self,
        simulation: &Simulation,
        results: impl FnOnce() -> ResultsSoFar,
        clean: bool,
        progress: &mut Progress,
    ) -> Option<u64> {
        if clean {
            self.hold(simulation, results);
        }
        self.write(progress);
        self.held.as_ref().filter(|held| held.written).map(|held| held.checkpoint.step())
    }

    /// Writes the last one of a run that has ended, from where it may be asked to go further;
    /// short ones are not, unless the scene asks for checkpoints.
    pub(super) fn after_end(
        &mut self,
        simulation: &mut Simulation,
        results: impl FnOnce() -> ResultsSoFar,
        progress: &mut Progress,
    ) {
        let long = simulation.sheet().reduction().any(self.began.elapsed() >= FIRST_INTERVAL);
        if self.asked || long {
            simulation.stepper.integrator.renew();
            self.hold(simulation, results);
            self.write(progress);
        }
    }
}
