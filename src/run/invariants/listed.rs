//! The invariants that a scene lists: what they say of every step, and the limits that end a run.

use serde::{Deserialize, Serialize};

use super::crossings::NoCrossings;
use super::energy::EnergyBalance;
use super::forces::FreeBalance;
use super::topology::GaussBonnet;
use super::totals::Total;
use super::{BrokenInvariant, Invariant, InvariantValue, Step};
use crate::Stepper;
use crate::model::State;
use crate::record::Malformed;
use crate::run::{Error, Result};
use crate::scene::{Bound, InvariantsSpec, Scene, path_to};
use crate::solve::{StepReport, Workspace};

/// The invariants that a scene lists.
pub(crate) struct Invariants {
    every: u64,
    all: Vec<Listed>,
    /// Whether the start has been seen.
    begun: bool,
}

/// What later steps depend on.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Memory {
    begun: bool,
    /// Of every invariant its memory, and its largest value with when.
    invariants: Vec<(Vec<f64>, (f64, f64))>,
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
            let total = Total::of(scene, name, &model, state)?;
            all.push(Listed::new(&path_to("totals", name), *bound, total));
        }
        if let Some(bound) = force {
            needs_space("force")?;
            all.push(Listed::new("force", *bound, FreeBalance::of(scene, &model)?));
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
        Ok(Some(Self { every, all, begun: false }))
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

    /// One step of `stepper` to `until` at most, inspected.
    ///
    /// # Errors
    /// [`BrokenInvariant`] if it passes a limit, and those of the integrator; state and integrator are as before then,
    /// bit for bit, but for what a library remembers, which restarts.
    pub(crate) fn step(&mut self, stepper: &mut Stepper, until: f64) -> Result<StepReport> {
        self.begin(&mut stepper.workspace, &stepper.state)?;
        let (before, memory) = (stepper.state.clone(), stepper.integrator.memory());
        let Stepper { workspace, state, integrator, .. } = stepper;
        let report = integrator.advance(workspace, state, until)?;
        let inspected = self.inspect(workspace, (&before, state), report.relaxation.dissipated);
        if let Err(error) = inspected {
            *state = before;
            // What cannot be written restarts.
            integrator.renew();
            let restored = integrator.restore(&memory, state.x.len());
            debug_assert!(restored.is_ok(), "it has written this itself");
            return Err(error);
        }
        Ok(report)
    }

    /// Inspects what happened between two states, and takes it over where no limit is passed.
    fn inspect(
        &mut self,
        workspace: &mut Workspace,
        (before, after): (&State, &State),
        dissipated: f64,
    ) -> Result<()> {
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
                return Err(listed.broken(reading, after.time).into());
            }
            all.push(Some(reading));
        }
        for (listed, reading) in self.all.iter_mut().zip(all) {
            match reading {
                Some(reading) => listed.accept(reading, after.time),
                None => listed.row.fill(f64::NAN),
            }
        }
        Ok(())
    }

    /// What later steps depend on.
    pub(crate) fn memory(&self) -> Memory {
        let invariants =
            self.all.iter().map(|listed| (listed.memory.clone(), listed.worst)).collect();
        Memory { begun: self.begun, invariants }
    }

    /// Takes over the memory of those of the same scene.
    ///
    /// # Errors
    /// [`Malformed`] for anything else.
    pub(crate) fn restore(&mut self, memory: Memory) -> Result<(), Malformed> {
        if memory.invariants.len() != self.all.len() {
            return Err(Malformed);
        }
        self.begun = memory.begun;
        for (listed, (memory, worst)) in self.all.iter_mut().zip(memory.invariants) {
            (listed.memory, listed.worst) = (memory, worst);
        }
        Ok(())
    }
}
