//! Monitors of laws of nature: what `[invariants]` lists.
//!
//! Each is a [`Monitor`]: it inspects a step, from one state to the next, and gives its columns of the ledger and a value
//! that is 0 where the law holds. A step that leads beyond the limit of the scene ends the run with [`BrokenInvariant`], at
//! the state before it, to the bit. A monitor remembers nothing but numbers, which are part of a checkpoint.

mod broken;
mod energy;
mod listed;
mod shape;
mod totals;

pub use broken::BrokenInvariant;
pub(crate) use listed::{Invariants, Seen};

use super::Result;
use crate::model::State;
use crate::solve::Workspace;

/// A step that monitors inspect; the state that a run begins with has none before it.
struct InspectedStep<'a> {
    workspace: &'a mut Workspace,
    before: Option<&'a State>,
    after: &'a State,
    /// Work that the drag took up, as the integrator says.
    dissipated: f64,
}

/// What a monitor says of a step.
struct Reading {
    /// Its columns of the ledger.
    row: Vec<f64>,
    /// What the limit is for: 0 where the law holds.
    value: f64,
    /// Place and cause of a violation.
    place: String,
}

/// Monitor of a law of nature.
trait Monitor: Send {
    /// The law with the unit of its value, and what to try where it is broken.
    fn law(&self) -> (String, &'static str);

    /// Its columns of the ledger, with units.
    fn columns(&self) -> Vec<String>;

    /// Whether it has to see every step.
    fn sees_every_step(&self) -> bool {
        false
    }

    /// Inspects a step; `memory` is what it remembers of the steps before, empty at the start.
    ///
    /// # Errors
    /// If the model has no value there.
    fn inspect(&mut self, step: &mut InspectedStep<'_>, memory: &mut Vec<f64>) -> Result<Reading>;
}
