//! How an iteration ends, and whether it gets anywhere.

use super::super::Relaxation;

/// Iterations after which progress is judged. Relaxations that converge, through buckling too, make
/// some 100 to 400 altogether.
const PATIENCE: usize = 150;
/// Steps of Newton's method when it takes over.
const HANDED_OVER: usize = 50;
/// Both are larger by this factor every time that Newton's method has had its turn.
const PATIENCE_GROWTH: usize = 2;
/// Share of the whole fall of the energy that counts as progress.
const MIN_PROGRESS_SHARE: f64 = 0.01;

/// Iterations after which progress is judged, when Newton's method has had so many turns.
pub(super) fn patience(turns: u32) -> usize {
    PATIENCE.saturating_mul(PATIENCE_GROWTH.saturating_pow(turns))
}

/// Steps of Newton's method at its turn number so much, from 0.
pub(super) fn newton_iterations(turn: u32) -> usize {
    HANDED_OVER.saturating_mul(PATIENCE_GROWTH.saturating_pow(turn))
}

/// How the iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    /// The goal is reached.
    AtRest,
    /// No step lowers the energy.
    NoStep,
    /// Stagnation.
    Poor,
}

/// Whether an iteration gets anywhere, judged every so often.
pub(super) struct Progress {
    /// Energy at the start, and at the last judgement.
    energy: (f64, f64),
    /// Least residual before the last judgement, and since.
    residual: (f64, f64),
    judged: usize,
    patience: usize,
}

impl Progress {
    /// Judged after every `patience` iterations.
    pub(super) fn new(energy: f64, residual: f64, patience: usize) -> Self {
        Self { energy: (energy, energy), residual: (residual, residual), judged: 0, patience }
    }

    /// Poor if over that many iterations neither the least residual was halved nor the energy fell
    /// by a share of all that it has fallen.
    pub(super) fn is_poor(&mut self, done: &Relaxation) -> bool {
        self.residual.1 = self.residual.1.min(done.residual);
        if done.iterations < self.judged + self.patience {
            return false;
        }
        let fall = self.energy.1 - done.energy;
        let poor = self.residual.1 > 0.5 * self.residual.0
            && fall < MIN_PROGRESS_SHARE * (self.energy.0 - done.energy);
        self.judged = done.iterations;
        self.energy.1 = done.energy;
        self.residual.0 = self.residual.1;
        poor
    }
}
