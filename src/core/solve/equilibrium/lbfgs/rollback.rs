//! What L-BFGS keeps from one relaxation to the next, as it was where a step began: a step that fails leaves it so.
//!
//! The matrix is copied only where a new one is about to take its place; its factor is recomputed where a
//! step has failed, as from a checkpoint.

use super::Lbfgs;
use crate::model::Mechanics;
use crate::record::Record;

/// Where a step began.
#[derive(Debug, Default)]
pub(super) struct Mark {
    factored: bool,
    weight: f64,
    shift: f64,
    refresh: usize,
    /// All of it; where steps teach nothing, only once the factor goes.
    record: Option<Record>,
}

impl Lbfgs {
    pub(super) fn set_mark(&mut self) {
        let Self { factored, weight, shift, refresh, .. } = *self;
        let record = self.inverse.is_vertexwise().then(|| self.written());
        self.mark = Some(Mark { factored, weight, shift, refresh, record });
    }

    /// Before the factor goes.
    pub(super) fn keep_marked(&mut self) {
        if let Some(mut mark) = self.mark.take() {
            if mark.record.is_none() {
                self.exchange(&mut mark);
                mark.record = Some(self.written());
                self.exchange(&mut mark);
            }
            self.mark = Some(mark);
        }
    }

    pub(super) fn return_to_mark(&mut self, mechanics: &Mechanics) {
        let Some(mut mark) = self.mark.take() else { return };
        match mark.record.take() {
            None => self.exchange(&mut mark),
            // What was written by itself can be read.
            Some(record) => {
                if record.read().and_then(|memory| self.take_over(memory, mechanics)).is_err() {
                    self.factored = false;
                }
            }
        }
    }

    /// Small numbers of `mark` against those that are.
    fn exchange(&mut self, mark: &mut Mark) {
        std::mem::swap(&mut self.factored, &mut mark.factored);
        std::mem::swap(&mut self.weight, &mut mark.weight);
        std::mem::swap(&mut self.shift, &mut mark.shift);
        std::mem::swap(&mut self.refresh, &mut mark.refresh);
    }
}
