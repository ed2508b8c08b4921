//! What L-BFGS keeps from one relaxation to the next, as it was where a step began: a step that fails leaves it so.
//!
//! The matrix is copied only where a new one is about to take its place; its factor is recomputed where a
//! step has failed, as from a checkpoint.

use super::Lbfgs;
use crate::model::Mechanics;
use crate::solve::equilibrium::lbfgs::RollbackSnapshot;

impl Lbfgs {
    pub(super) fn take_snapshot(&mut self) {
        let record = self.inverse.is_vertexwise().then(|| self.written());
        self.snapshot = Some(RollbackSnapshot { factor: self.factor, record });
    }

    /// Before the factor goes.
    pub(super) fn complete_snapshot(&mut self) {
        if let Some(mut snapshot) = self.snapshot.take() {
            if snapshot.record.is_none() {
                std::mem::swap(&mut self.factor, &mut snapshot.factor);
                snapshot.record = Some(self.written());
                std::mem::swap(&mut self.factor, &mut snapshot.factor);
            }
            self.snapshot = Some(snapshot);
        }
    }

    pub(super) fn restore_snapshot(&mut self, mechanics: &Mechanics) {
        let Some(mut snapshot) = self.snapshot.take() else { return };
        match snapshot.record.take() {
            None => std::mem::swap(&mut self.factor, &mut snapshot.factor),
            // What was written by itself can be read.
            Some(record) => {
                if record.read().and_then(|memory| self.take_over(memory, mechanics)).is_err() {
                    self.factor.ready = false;
                }
            }
        }
    }
}
