//! Conditions that change from those of one state to those of another.

use crate::model::State;

/// Species, internal variables, and the time that growth, loads and prescribed positions read, as functions of a clock:
/// the time itself, or a pseudo-time in which they stay the same.
#[derive(Clone, Copy)]
pub(super) struct Route<'a> {
    from: &'a State,
    to: &'a State,
    /// Readings of the clock at both ends.
    clock: (f64, f64),
}

impl<'a> Route<'a> {
    /// From one time to a later one; species and internal variables go along straight lines.
    pub(super) fn in_time(from: &'a State, to: &'a State) -> Self {
        Self { from, to, clock: (from.time, to.time) }
    }

    /// The conditions of one state during a span of pseudo-time.
    pub(super) fn frozen(at: &'a State, clock: (f64, f64)) -> Self {
        Self { from: at, to: at, clock }
    }

    /// Readings of the clock at both ends.
    pub(super) fn clock(&self) -> (f64, f64) {
        self.clock
    }

    /// The conditions when the clock shows `t`, with the shape of `at`.
    pub(super) fn at(&self, t: f64, at: &State) -> State {
        let (start, end) = self.clock;
        let s = if t >= end { 1.0 } else { (t - start) / (end - start) };
        let mix = |a: f64, b: f64| if s >= 1.0 { b } else { a + s * (b - a) };
        let column = |(a, b): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> {
            a.iter().zip(b).map(|(a, b)| mix(*a, *b)).collect()
        };
        State {
            time: mix(self.from.time, self.to.time),
            step: at.step,
            x: at.x.clone(),
            species: self.from.species.iter().zip(&self.to.species).map(column).collect(),
            internal: self.from.internal.iter().zip(&self.to.internal).map(column).collect(),
        }
    }
}
