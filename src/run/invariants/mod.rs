//! Monitors of laws of nature: what `[invariants]` lists.
//!
//! Each is an [`Invariant`]: it inspects a step, from one state to the next, and says what is in the ledger's row and how
//! far it is broken. A step that leads beyond the limit of the scene ends the run with [`BrokenInvariant`], at the state before
//! it, to the bit. An invariant remembers nothing but numbers, which are part of a checkpoint.

mod broken;
mod crossings;
mod energy;
mod forces;
mod listed;
mod topology;
mod totals;

pub use broken::BrokenInvariant;
pub(crate) use listed::{Invariants, Memory};

use super::Result;
use crate::model::{Evaluation, State};
use crate::solve::Workspace;

/// A step that invariants inspect.
pub(super) struct Step<'a> {
    workspace: &'a mut Workspace,
    /// Where it began.
    before: &'a State,
    /// Where it led.
    after: &'a State,
    /// Work that the drag took up, as the integrator says.
    dissipated: f64,
}

impl Step<'_> {
    /// The model where the step began.
    fn before(&mut self) -> Evaluation<'_> {
        self.workspace.at(self.before)
    }

    /// And where it led.
    fn after(&mut self) -> Evaluation<'_> {
        self.workspace.at(self.after)
    }
}

/// What an invariant says of a step.
#[derive(Debug, Clone, Default)]
pub(super) struct InvariantValue {
    /// Its columns of the ledger.
    row: Vec<f64>,
    /// What the limit is for: 0 where the invariant holds.
    value: f64,
    /// Place and cause of a violation, as text; called beyond the limit only.
    place: String,
    /// What it remembers of the run if the step is accepted.
    memory: Vec<f64>,
}

/// An invariant: a law of nature that a scene watches.
pub(super) trait Invariant: Send {
    /// What it says, as in "the net force and torque on a free sheet".
    fn name(&self) -> String;

    /// What to try where it is broken.
    fn advice(&self) -> &'static str;

    /// Its columns of the ledger, with units.
    fn columns(&self) -> Vec<String>;

    /// Whether it has to see every step.
    fn sees_every_step(&self) -> bool {
        false
    }

    /// What it says of the state that a run begins with.
    ///
    /// # Errors
    /// If the model has no value there.
    fn begin(&mut self, workspace: &mut Workspace, state: &State) -> Result<InvariantValue>;

    /// What it says of a step, where `memory` is that of the steps before.
    ///
    /// # Errors
    /// If the model has no value there.
    fn inspect(&mut self, step: &mut Step<'_>, memory: &[f64]) -> Result<InvariantValue>;
}
