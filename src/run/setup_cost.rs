//! What every effect of a scene contributes to its model, and how long the set-up took.

use std::time::{Duration, Instant};

use crate::effects::{Effect, EffectParts};
use crate::tally::Tally;

/// The set-up of a scene.
#[derive(Debug, Clone)]
pub(crate) struct SetupCost {
    /// When it began.
    pub(crate) began: Instant,
    /// When the latest effect began to be built.
    latest: Instant,
    /// The effects, in the order of the scene.
    pub(crate) effects: Vec<EffectContribution>,
}

/// What one effect contributes to the model, and the time to build it.
#[derive(Debug, Clone)]
pub(crate) struct EffectContribution {
    pub(crate) parts: EffectParts,
    pub(crate) took: Duration,
}

impl SetupCost {
    /// Now.
    pub(crate) fn begin() -> Self {
        let began = Instant::now();
        Self { began, latest: began, effects: Vec::new() }
    }

    /// An effect begins to be built.
    pub(crate) fn begin_effect(&mut self) {
        self.latest = Instant::now();
    }

    /// `effect` is built.
    pub(crate) fn end_effect(&mut self, effect: &Effect) {
        let took = self.latest.elapsed();
        self.effects.push(EffectContribution { parts: effect.parts(), took });
    }

    /// Ends the set-up; what no effect and no meter accounts for is the scene's own.
    pub(crate) fn end(&mut self, tally: &Tally) {
        let known = tally.costs().into_iter().map(|cost| cost.time);
        let known: Duration = known.chain(self.effects.iter().map(|effect| effect.took)).sum();
        let scene = tally.meter("preparation", "sheet, plugins, start, other tables", &[]);
        scene.add(self.began.elapsed().saturating_sub(known));
    }

    /// Index of the effect that contributed part `k` of those counted by `of`.
    pub(crate) fn owner(&self, of: impl Fn(&EffectParts) -> usize, k: usize) -> Option<usize> {
        let mut count = 0;
        self.effects.iter().position(|effect| {
            count += of(&effect.parts);
            count > k
        })
    }
}
