//! Cost of setting up a scene, and the contribution of every effect to its model.

use std::time::{Duration, Instant};

use crate::effects::Effect;
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
    /// The effects, in the order of the scene.
    pub(crate) effects: Vec<EffectContribution>,
}

/// What one effect contributes to the model: numbers of its parts, and the cost of building it.
#[derive(Debug, Clone)]
pub(crate) struct EffectContribution {
    began: Instant,
    before: i64,
    pub(crate) energies: usize,
    pub(crate) transports: usize,
    /// Points whose values are held.
    pub(crate) held: usize,
    pub(crate) growth: usize,
    /// Internal variables.
    pub(crate) internal: usize,
    /// Whether it directs the length factor of the law.
    pub(crate) directs: bool,
    pub(crate) constraints: usize,
    pub(crate) prescribed: usize,
    /// Fixed directions, and the vertices that have some.
    pub(crate) pins: [usize; 2],
    /// Time to build it.
    pub(crate) took: Duration,
    /// Bytes that it keeps.
    pub(crate) bytes: i64,
}

impl SetupCost {
    /// Now.
    pub(crate) fn begin() -> Self {
        Self { began: Instant::now(), before: bytes(), effects: Vec::new() }
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
    pub(crate) fn owner(
        &self,
        of: impl Fn(&EffectContribution) -> usize,
        k: usize,
    ) -> Option<usize> {
        let mut count = 0;
        self.effects.iter().position(|effect| {
            count += of(effect);
            count > k
        })
    }

    /// Bytes allocated since.
    pub(crate) fn kept(&self) -> i64 {
        bytes() - self.before
    }
}

impl EffectContribution {
    /// Now.
    pub(crate) fn begin() -> Self {
        Self {
            began: Instant::now(),
            before: bytes(),
            energies: 0,
            transports: 0,
            held: 0,
            growth: 0,
            internal: 0,
            directs: false,
            constraints: 0,
            prescribed: 0,
            pins: [0; 2],
            took: Duration::ZERO,
            bytes: 0,
        }
    }

    /// Records the parts of `effect`, which is built now. The pattern names every field, so that none is forgotten.
    pub(crate) fn record(&mut self, effect: &Effect) {
        self.took = self.began.elapsed();
        self.bytes = bytes() - self.before;
        let Effect {
            energies,
            pins,
            prescribed,
            constraints,
            growth,
            direction,
            transports,
            held,
            internal,
        } = effect;
        self.internal = internal.len();
        self.held = held.iter().map(|held| held.points().len()).sum();
        self.energies = energies.len();
        self.transports = transports.len();
        self.growth = growth.len();
        self.directs = direction.is_some();
        self.constraints = constraints.len();
        self.prescribed = prescribed.len();
        let directions = |fixed: &[bool; 3]| fixed.iter().filter(|fixed| **fixed).count();
        let pins = pins.as_deref().unwrap_or_default();
        self.pins = [
            pins.iter().map(directions).sum(),
            pins.iter().filter(|fixed| directions(fixed) > 0).count(),
        ];
    }
}
