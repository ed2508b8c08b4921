//! The invariants that a scene lists, and the steps that are held to them.

use serde::{Deserialize, Serialize};

use super::crossings::NoCrossings;
use super::energy::EnergyBalance;
use super::forces::FreeBalance;
use super::topology::GaussBonnet;
use super::totals::Total;
use super::{BrokenInvariant, Invariant, InvariantValue, Step};
use crate::Stepper;
use crate::model::State;
use crate::record::{Malformed, Record};
use crate::run::{Error, Result};
use crate::scene::{Bound, InvariantsSpec, Scene, path_to};
use crate::solve::rejections::{Cause, Rejection};
use crate::solve::{StepReport, Workspace, end_of_step};

/// A step that breaks an invariant is tried again this much shorter,
const STEP_REDUCTION: f64 = 0.25;
/// down to this share of the first one that did, or of the time reached.
const MIN_STEP_SHARE: f64 = 1e-5;
const ROUND_OFF: f64 = 1e-10;
/// Steps grow by this factor afterwards.
const STEP_GROWTH: f64 = 2.0;

/// The invariants that a scene lists.
pub(crate) struct Invariants {
    every: u64,
    all: Vec<Listed>,
    /// Whether the start has been seen.
    begun: bool,
    /// Steps after one that had to be shorter.
    short: Option<ShortSteps>,
}

/// What later steps depend on.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Memory {
    begun: bool,
    short: Option<ShortSteps>,
    /// Of every invariant its memory, and its largest value with when.
    invariants: Vec<(Vec<f64>, (f64, f64))>,
}

/// Brings the integrator back to where a step began.
fn put_back(memory: &Record, stepper: &mut Stepper) {
    // What cannot be written restarts.
    stepper.integrator.renew();
    let restored = stepper.integrator.restore(memory, stepper.state.x.len());
    debug_assert!(restored.is_ok(), "it has written this itself");
}

/// Steps that are kept short.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct ShortSteps {
    /// They are no longer than this.
    longest: f64,
    /// The first that broke an invariant.
    full: f64,
}

/// An invariant with what is asked of it and what it has said.
struct Listed {
    key: String,
    limit: Option<f64>,
    invariant: Box<dyn Invariant>,
    row: Vec<f64>,
    memory: Vec<f64>,
    /// Largest value so far, and when.
    worst: (f64, f64),
}

impl Listed {
    fn new(key: &str, bound: Bound, invariant: impl Invariant + 'static) -> Self {
        let row = vec![f64::NAN; invariant.columns().len()];
        let (invariant, memory) = (Box::new(invariant), Vec::new());
        Self {
            key: key.to_owned(),
            limit: bound.limit(),
            invariant,
            row,
            memory,
            worst: (0.0, 0.0),
        }
    }

    /// Whether the limit is passed; a value that is none passes every limit.
    fn breaks(&self, reading: &InvariantValue) -> bool {
        self.limit.is_some_and(|limit| !(reading.value <= limit))
    }

    fn broken(&self, reading: InvariantValue, time: f64) -> BrokenInvariant {
        BrokenInvariant {
            law: self.invariant.name(),
            key: self.key.clone(),
            value: reading.value,
            limit: self.limit.unwrap_or_default(),
            place: reading.place,
            time,
            step: None,
            advice: self.invariant.advice(),
        }
    }

    fn accept(&mut self, reading: InvariantValue, time: f64) {
        if !(reading.value <= self.worst.0) {
            self.worst = (reading.value, time);
        }
        (self.row, self.memory) = (reading.row, reading.memory);
    }
}

impl Invariants {
    /// Those of `scene`; none without the table. `state` is one that a run may begin with.
    ///
    /// # Errors
    /// An invariant that cannot hold for the scene, with its place there.
    pub(crate) fn of(scene: &Scene, stepper: &mut Stepper) -> Result<Option<Self>> {
        let Stepper { workspace, state, .. } = stepper;
        let Some(spec) = &scene.invariants else { return Ok(None) };
        let InvariantsSpec { every, energy, force, gauss_bonnet, crossings, totals } = spec;
        let mut all = Vec::new();
        let model = workspace.model.clone();
        let needs_space = |key: &str| {
            let message = "a point has no shape";
            let path = format!("invariants.{key}");
            let none = model.sheet().triangles().is_empty();
            if none { Err(Error::Scene(scene.error_at(&path, message, None))) } else { Ok(()) }
        };
        if let Some(bound) = energy {
            needs_space("energy")?;
            all.push(Listed::new("energy", *bound, EnergyBalance::of(scene, &model)?));
        }
        for (name, bound) in totals {
            let total = Total::of(scene, name, workspace, state)?;
            all.push(Listed::new(&path_to("totals", name), *bound, total));
        }
        if let Some(bound) = force {
            needs_space("force")?;
            all.push(Listed::new("force", *bound, FreeBalance::of(scene, workspace, state)?));
        }
        if let Some(bound) = gauss_bonnet {
            needs_space("gauss-bonnet")?;
            all.push(Listed::new("gauss-bonnet", *bound, GaussBonnet));
        }
        if let Some(bound) = crossings {
            needs_space("crossings")?;
            all.push(Listed::new("crossings", *bound, NoCrossings::of(model.sheet())));
        }
        let every = every.get() as u64;
        Ok(Some(Self { every, all, begun: false, short: None }))
    }

    /// Their columns of the ledger.
    pub(crate) fn columns(&self) -> Vec<String> {
        self.all.iter().flat_map(|listed| listed.invariant.columns()).collect()
    }

    /// What they say of the last accepted state; not a number where they have not looked.
    pub(crate) fn row(&self) -> Vec<f64> {
        self.all.iter().flat_map(|listed| &listed.row).copied().collect()
    }

    /// The largest value of each, in words.
    pub(crate) fn worst(&self) -> Vec<String> {
        let words = |listed: &Listed| {
            let (value, time) = listed.worst;
            let limit = listed.limit.map(|limit| format!(", limit {limit:e}"));
            let key = &listed.key;
            format!("{key}: at most {value:.1e} (time {time}{})", limit.unwrap_or_default())
        };
        self.all.iter().map(words).collect()
    }

    /// Inspects the state that a run begins with, once.
    ///
    /// # Errors
    /// [`BrokenInvariant`] if that breaks an invariant.
    pub(crate) fn begin(&mut self, workspace: &mut Workspace, state: &State) -> Result<()> {
        if self.begun {
            return Ok(());
        }
        for listed in &mut self.all {
            let reading = listed.invariant.begin(workspace, state)?;
            if listed.breaks(&reading) {
                return Err(listed.broken(reading, state.time).into());
            }
            listed.accept(reading, state.time);
        }
        self.begun = true;
        Ok(())
    }

    /// Brings `state` forward by one step of `integrator` that keeps the invariants.
    ///
    /// # Errors
    /// [`BrokenInvariant`] if no step does, and those of the integrator; `state` and what the integrator and this remember are
    /// as before then, bit for bit, but for what a library remembers, which restarts.
    pub(crate) fn step(&mut self, stepper: &mut Stepper, until: f64) -> Result<StepReport> {
        let short = self.short;
        let memory = stepper.integrator.memory();
        let done = self.step_within(stepper, &memory, until);
        if done.is_err() {
            self.short = short;
            put_back(&memory, stepper);
        }
        done
    }

    fn step_within(
        &mut self,
        stepper: &mut Stepper,
        memory: &Record,
        until: f64,
    ) -> Result<StepReport> {
        self.begin(&mut stepper.workspace, &stepper.state)?;
        let before = stepper.state.clone();
        let (mut target, mut reason) = (until, None::<BrokenInvariant>);
        if let Some(short) = self.short {
            target = end_of_step(before.time, short.longest, until);
        }
        loop {
            let Stepper { workspace, state, integrator, .. } = &mut *stepper;
            let mut report = match integrator.advance(workspace, state, target) {
                Ok(report) => report,
                // What stops a shorter step is not why it had to be shorter.
                Err(error) if error.is_recoverable() => {
                    return Err(reason.map_or_else(|| Error::from(error), Error::from));
                }
                Err(error) => return Err(error.into()),
            };
            let dissipated = report.relaxation.dissipated;
            match self.inspect(workspace, (&before, state), dissipated) {
                Ok(None) => {
                    self.grow();
                    report.reason = report.reason.or(reason.map(|broken| broken.to_string()));
                    return Ok(report);
                }
                Ok(Some(broken)) => {
                    target = self.reject(stepper, (&before, memory), &report, &broken)?;
                    reason = Some(broken);
                }
                Err(error) => {
                    *state = before;
                    return Err(error);
                }
            }
        }
    }

    /// Rejects the step from `before`, which has broken an invariant; where the next attempt is to end.
    ///
    /// # Errors
    /// `broken` where no step is shorter.
    fn reject(
        &mut self,
        stepper: &mut Stepper,
        (before, memory): (&State, &Record),
        report: &StepReport,
        broken: &BrokenInvariant,
    ) -> Result<f64> {
        let end = stepper.state.time;
        stepper.state.clone_from(before);
        stepper.workspace.roll_back();
        stepper.workspace.begin_step();
        put_back(memory, stepper);
        stepper.workspace.reject(Rejection {
            step: before.step + 1,
            time: before.time,
            length: report.length,
            error: report.error,
            cause: Cause::Invariant,
            message: broken.to_string(),
        });
        let longest = STEP_REDUCTION * report.length;
        let full = self.short.map_or(report.length, |short| short.full);
        self.short = Some(ShortSteps { longest, full });
        if !(longest >= (MIN_STEP_SHARE * full).max(ROUND_OFF * end)) {
            return Err(BrokenInvariant { step: Some(report.length), ..broken.clone() }.into());
        }
        Ok(before.time + longest)
    }

    /// What breaks a limit between two states; nothing, and all is taken over, if the step may be accepted.
    fn inspect(
        &mut self,
        workspace: &mut Workspace,
        (before, after): (&State, &State),
        dissipated: f64,
    ) -> Result<Option<BrokenInvariant>> {
        let due = after.step.is_multiple_of(self.every);
        let mut all = Vec::with_capacity(self.all.len());
        for listed in &mut self.all {
            if !due && !listed.invariant.sees_every_step() {
                all.push(None);
                continue;
            }
            let mut step = Step { workspace: &mut *workspace, before, after, dissipated };
            let reading = listed.invariant.inspect(&mut step, &listed.memory)?;
            if listed.breaks(&reading) {
                return Ok(Some(listed.broken(reading, after.time)));
            }
            all.push(Some(reading));
        }
        for (listed, reading) in self.all.iter_mut().zip(all) {
            match reading {
                Some(reading) => listed.accept(reading, after.time),
                None => listed.row.fill(f64::NAN),
            }
        }
        Ok(None)
    }

    /// Lets steps grow again to what they were.
    fn grow(&mut self) {
        let longer =
            |short: ShortSteps| ShortSteps { longest: STEP_GROWTH * short.longest, ..short };
        self.short = self.short.map(longer).filter(|short| short.longest < short.full);
    }

    /// What later steps depend on.
    pub(crate) fn memory(&self) -> Memory {
        let Self { begun, short, .. } = *self;
        let invariants =
            self.all.iter().map(|listed| (listed.memory.clone(), listed.worst)).collect();
        Memory { begun, short, invariants }
    }

    /// Takes over the memory of those of the same scene.
    ///
    /// # Errors
    /// [`Malformed`] for anything else.
    pub(crate) fn restore(&mut self, memory: Memory) -> Result<(), Malformed> {
        if memory.invariants.len() != self.all.len() {
            return Err(Malformed);
        }
        (self.begun, self.short) = (memory.begun, memory.short);
        for (listed, (memory, worst)) in self.all.iter_mut().zip(memory.invariants) {
            (listed.memory, listed.worst) = (memory, worst);
        }
        Ok(())
    }
}
