//! The monitors that a scene lists: what they say of every step, and the limits that end a run.

use serde::{Deserialize, Serialize};

use super::energy::EnergyBalance;
use super::shape::{FreeBalance, NoCrossings};
use super::totals::Total;
use super::{BrokenInvariant, InspectedStep, Monitor, Reading};
use crate::Stepper;
use crate::model::State;
use crate::record::Malformed;
use crate::run::Result;
use crate::scene::{Bound, InvariantsSpec, Scene, path_to};
use crate::solve::{StepReport, Workspace};

/// A monitor with its key in the scene and the limit.
struct Listed {
    key: String,
    limit: Option<f64>,
    monitor: Box<dyn Monitor>,
}

/// What is known of a law up to a step.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct Seen {
    row: Vec<f64>,
    memory: Vec<f64>,
    /// Largest value, and when.
    worst: (f64, f64),
}

/// The monitors that a scene lists.
pub(crate) struct Invariants {
    every: u64,
    all: Vec<Listed>,
    /// Of each what it has seen; empty before the start.
    seen: Vec<Seen>,
}

impl Invariants {
    /// Those of `scene`; none without the table. `state` is one that a run may begin with.
    ///
    /// # Errors
    /// A law that cannot hold for the scene, with its place there.
    pub(crate) fn new(scene: &Scene, stepper: &mut Stepper) -> Result<Option<Self>> {
        let Stepper { workspace, state, .. } = stepper;
        let Some(spec) = &scene.invariants else { return Ok(None) };
        let InvariantsSpec { every, energy, force, crossings, totals } = spec;
        let model = workspace.model.clone();
        let mut all = Vec::new();
        let mut list = |key: &str, bound: Bound, monitor: Box<dyn Monitor>| {
            all.push(Listed { key: key.to_owned(), limit: bound.limit(), monitor });
        };
        // What needs a sheet, and what an effect with an energy.
        let refusals = [
            (energy, "energy", Some("no effect of the scene has an energy")),
            (force, "force", Some("no effect of the scene has a force")),
            (crossings, "crossings", None),
        ];
        for (_, key, needs_force) in refusals.iter().filter(|(bound, ..)| bound.is_some()) {
            let point = model.sheet().triangles().is_empty().then_some("a point has no shape");
            let free = needs_force.filter(|_| model.mechanics().is_empty());
            if let Some(message) = point.or(free) {
                let path = format!("invariants.{key}");
                return Err(scene.error_at(&path, message, None).into());
            }
        }
        if let Some(bound) = energy {
            list("energy", *bound, Box::new(EnergyBalance::new(scene, &model)?));
        }
        for (name, bound) in totals {
            let total = Total::new(scene, name, &model, state)?;
            list(&path_to("totals", name), *bound, Box::new(total));
        }
        if let Some(bound) = force {
            list("force", *bound, Box::new(FreeBalance));
        }
        if let Some(bound) = crossings {
            list("crossings", *bound, Box::new(NoCrossings::new(model.sheet())));
        }
        Ok(Some(Self { every: every.get() as u64, all, seen: Vec::new() }))
    }

    /// Their columns of the ledger.
    pub(crate) fn columns(&self) -> Vec<String> {
        self.all.iter().flat_map(|listed| listed.monitor.columns()).collect()
    }

    /// What they say of the last accepted state; not a number where they have not looked.
    pub(crate) fn row(&self) -> Vec<f64> {
        match self.seen.is_empty() {
            true => vec![f64::NAN; self.columns().len()],
            false => self.seen.iter().flat_map(|seen| &seen.row).copied().collect(),
        }
    }

    /// The largest value of each, in words.
    pub(crate) fn worst(&self) -> Vec<String> {
        let words = |(listed, seen): (&Listed, &Seen)| {
            let (value, time) = seen.worst;
            let limit = listed.limit.map_or(String::new(), |limit| format!(", limit {limit:e}"));
            format!("{}: at most {value:.1e} (time {time}{limit})", listed.key)
        };
        self.all.iter().zip(&self.seen).map(words).collect()
    }

    /// Inspects the state that a run begins with, once.
    ///
    /// # Errors
    /// [`BrokenInvariant`] if that breaks a law.
    pub(crate) fn begin(&mut self, workspace: &mut Workspace, state: &State) -> Result<()> {
        if self.seen.is_empty() {
            let start = InspectedStep { workspace, before: None, after: state, dissipated: 0.0 };
            self.seen = self.inspect(start, vec![Seen::default(); self.all.len()])?;
        }
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
        let dissipated = report.relaxation.dissipated;
        let step = InspectedStep { workspace, before: Some(&before), after: state, dissipated };
        match self.inspect(step, self.seen.clone()) {
            Ok(seen) => self.seen = seen,
            Err(error) => {
                *state = before;
                // What cannot be written restarts.
                integrator.renew();
                let restored = integrator.restore(&memory, state.x.len());
                debug_assert!(restored.is_ok(), "it has written this itself");
                return Err(error);
            }
        }
        Ok(report)
    }

    /// What is known after `step`, where `seen` is known before it and no limit is passed.
    fn inspect(&mut self, mut step: InspectedStep<'_>, mut seen: Vec<Seen>) -> Result<Vec<Seen>> {
        let (time, due) = (step.after.time, step.after.step.is_multiple_of(self.every));
        for (listed, seen) in self.all.iter_mut().zip(&mut seen) {
            if !due && step.before.is_some() && !listed.monitor.sees_every_step() {
                seen.row.fill(f64::NAN);
                continue;
            }
            let Reading { row, value, place } =
                listed.monitor.inspect(&mut step, &mut seen.memory)?;
            // A value that is none passes every limit.
            if let Some(limit) = listed.limit.filter(|limit| !(value <= *limit)) {
                let (law, advice) = listed.monitor.law();
                let key = listed.key.clone();
                return Err(BrokenInvariant { law, key, value, limit, place, time, advice }.into());
            }
            if !(value <= seen.worst.0) {
                seen.worst = (value, time);
            }
            seen.row = row;
        }
        Ok(seen)
    }

    /// What later steps depend on.
    pub(crate) fn memory(&self) -> Vec<Seen> {
        self.seen.clone()
    }

    /// Takes over the memory of those of the same scene.
    ///
    /// # Errors
    /// [`Malformed`] for anything else.
    pub(crate) fn restore(&mut self, memory: Vec<Seen>) -> Result<(), Malformed> {
        let columns = self.all.iter().map(|listed| listed.monitor.columns().len());
        let same = memory.is_empty() || memory.iter().map(|seen| seen.row.len()).eq(columns);
        self.seen = memory;
        if same { Ok(()) } else { Err(Malformed) }
    }
}
