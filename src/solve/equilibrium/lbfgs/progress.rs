//! How an iteration ends, and whether it gets anywhere.

use super::super::Relaxation;

/// Iterations after which progress is judged. Relaxations that come to an end, through buckling too, make
/// some 100 to 400 altogether.
const PATIENCE: usize = 150;
/// Share of the whole fall of the energy that counts as progress.
const LITTLE: f64 = 0.01;

/// How the iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    /// The goal is reached.
    AtRest,
    /// No step lowers the energy.
    NoStep,
    /// It goes on without getting anywhere.
    Poor,
}

/// Whether an iteration gets anywhere, judged every so often.
pub(super) struct Progress {
    /// Energy at the start, and at the last judgement.
    energy: (f64, f64),
    /// Least residual before the last judgement, and since.
    residual: (f64, f64),
    judged: usize,
}

impl Progress {
    pub(super) fn new(energy: f64, residual: f64) -> Self {
        Self { energy: (energy, energy), residual: (residual, residual), judged: 0 }
    }

    /// Poor if over [`PATIENCE`] iterations neither the least residual was halved nor the energy fell
    /// by a share of all that it has fallen.
    pub(super) fn is_poor(&mut self, done: &Relaxation) -> bool {
        self.residual.1 = self.residual.1.min(done.residual);
        if done.iterations < self.judged + PATIENCE {
            return false;
        }
        let fall = self.energy.1 - done.energy;
        let poor = self.residual.1 > 0.5 * self.residual.0
            && fall < LITTLE * (self.energy.0 - done.energy);
        self.judged = done.iterations;
        self.energy.1 = done.energy;
        self.residual.0 = self.residual.1;
        poor
    }
}
