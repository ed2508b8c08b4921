//! Conditions that change from those of one state to those of another.

use super::workspace::Held;
use crate::model::State;

/// Species, internal variables, and the time that growth, loads and prescribed positions read, as functions of a clock: the time itself,
/// or a pseudo-time.
#[derive(Clone, Copy)]
pub(super) struct Route<'a> {
    from: &'a State,
    to: &'a State,
    /// What the clock shows at both ends.
    clock: (f64, f64),
    /// Conditions change until the clock shows this.
    stop: f64,
    held: Option<&'a dyn Fn(f64) -> Held>,
}

impl<'a> Route<'a> {
    /// From one time to a later one; species and internal variables go along straight lines.
    pub(super) fn in_time(from: &'a State, to: &'a State) -> Self {
        Self { from, to, clock: (from.time, to.time), stop: to.time, held: None }
    }

    /// The same in a pseudo-time from 0 to 1.
    pub(super) fn from_zero_to_one(from: &'a State, to: &'a State) -> Self {
        Self { from, to, clock: (0.0, 1.0), stop: 1.0, held: None }
    }

    /// At the conditions of one state, what holds the sheet changes in a pseudo-time from 0 to 1.
    pub(super) fn held(at: &'a State, held: &'a dyn Fn(f64) -> Held) -> Self {
        Self { from: at, to: at, clock: (0.0, 1.0), stop: 1.0, held: Some(held) }
    }

    /// The same with conditions that stay as they are when the clock shows `t`.
    pub(super) fn stopped_at(&self, t: f64) -> Self {
        Self { stop: t.min(self.stop), ..*self }
    }

    /// Whether something holds the sheet.
    pub(super) fn is_held(&self) -> bool {
        self.held.is_some()
    }

    /// What the clock shows at both ends.
    pub(super) fn clock(&self) -> (f64, f64) {
        self.clock
    }

    /// By how much the clock advances.
    pub(super) fn length(&self) -> f64 {
        self.clock.1 - self.clock.0
    }

    /// The conditions when the clock shows `t`, with the shape of `at`, and what holds the sheet. After the stop
    /// they stay what they are there.
    pub(super) fn at(&self, t: f64, at: &State) -> (State, Option<Held>) {
        let (start, end) = self.clock;
        let t = t.min(self.stop);
        let s = if t >= end { 1.0 } else { (t - start) / (end - start) };
        let mix = |a: f64, b: f64| if s >= 1.0 { b } else { a + s * (b - a) };
        let column = |(a, b): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| mix(*a, *b)).collect()
        };
        let state = State {
            time: mix(self.from.time, self.to.time),
            step: at.step,
            x: at.x.clone(),
            species: self.from.species.iter().zip(&self.to.species).map(column).collect(),
            internal: self.from.internal.iter().zip(&self.to.internal).map(column).collect(),
        };
        (state, self.held.map(|held| held(s)))
    }
}
