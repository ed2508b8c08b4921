//! Cost of setting up a scene, and the contribution of every effect to its model.

use std::time::{Duration, Instant};

use crate::effects::{Effect, EffectParts};
use crate::tally::{Tally, allocated};

/// Bytes allocated now; 0 in a program that does not count them.
fn bytes() -> i64 {
    i64::try_from(allocated().unwrap_or_default().bytes).unwrap_or(i64::MAX)
}

/// Cost of setting up a scene.
#[derive(Debug, Clone)]
pub(crate) struct SetupCost {
    /// When it began.
    pub(crate) began: Instant,
    /// Bytes allocated before.
    before: i64,
    /// When the latest effect began to be built, and the bytes allocated before.
    latest: (Instant, i64),
    /// The effects, in the order of the scene.
    pub(crate) effects: Vec<EffectContribution>,
}

/// What one effect contributes to the model, and the cost of building it.
#[derive(Debug, Clone)]
pub(crate) struct EffectContribution {
    pub(crate) parts: EffectParts,
    /// Time to build it.
    pub(crate) took: Duration,
    /// Bytes that it keeps.
    pub(crate) bytes: i64,
}

impl SetupCost {
    /// Now.
    pub(crate) fn begin() -> Self {
        let (began, before) = (Instant::now(), bytes());
        Self { began, before, latest: (began, before), effects: Vec::new() }
    }

    /// An effect begins to be built.
    pub(crate) fn begin_effect(&mut self) {
        self.latest = (Instant::now(), bytes());
    }

    /// `effect` is built.
    pub(crate) fn end_effect(&mut self, effect: &Effect) {
        let (began, before) = self.latest;
        let (took, bytes) = (began.elapsed(), bytes() - before);
        self.effects.push(EffectContribution { parts: effect.parts(), took, bytes });
    }

    /// Ends the set-up; what no effect and no meter accounts for is the scene's own.
    pub(crate) fn end(&mut self, tally: &Tally) {
        let (mut took, mut kept) = (self.began.elapsed(), bytes() - self.before);
        for cost in tally.costs() {
            (took, kept) = (took.saturating_sub(cost.time), kept - cost.bytes);
        }
        for effect in &self.effects {
            (took, kept) = (took.saturating_sub(effect.took), kept - effect.bytes);
        }
        let scene = tally.meter("preparation", "sheet, plugins, start, other tables", &[]);
        scene.add(took, kept);
    }

    /// Index of the effect that contributed part `k` of those counted by `of`.
    pub(crate) fn owner(&self, of: impl Fn(&EffectParts) -> usize, k: usize) -> Option<usize> {
        let mut count = 0;
        self.effects.iter().position(|effect| {
            count += of(&effect.parts);
            count > k
        })
    }

    /// Bytes allocated since.
    pub(crate) fn kept(&self) -> i64 {
        bytes() - self.before
    }
}
