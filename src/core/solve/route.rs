//! Conditions that change from those of one state to those of another.

use super::workspace::RampConditions;
use crate::model::{CorotationalForces, State};

/// Species, internal variables, and the time that growth, loads and prescribed positions read, as functions of a clock:
/// the time itself, or a pseudo-time in which they stay the same while lengths are ramped.
#[derive(Clone, Copy)]
pub(super) struct Route<'a> {
    from: &'a State,
    to: &'a State,
    /// Readings of the clock at both ends.
    clock: (f64, f64),
    ramp: Option<&'a Ramp>,
}

/// Length factors that go from some to others in a pseudo-time from 0 to 1, `Φ(s) = Φ₀^(1-s) Φ₁^s`, while forces that hold
/// the vertices go to zero, `(1-s) f₀`.
pub(super) struct Ramp {
    pub(super) lengths: (Vec<f64>, Vec<f64>),
    /// The forces that hold the shape at first.
    pub(super) hold: CorotationalForces,
}

impl Ramp {
    fn conditions_at(&self, s: f64) -> RampConditions {
        let (from, to) = &self.lengths;
        let factor = from.iter().zip(to).map(|(a, b)| a.powf(1.0 - s) * b.powf(s)).collect();
        let force = self.hold.force.iter().map(|f| (1.0 - s) * f).collect();
        RampConditions {
            factor,
            hold: CorotationalForces { force, shape: self.hold.shape.clone() },
        }
    }
}

impl<'a> Route<'a> {
    /// From one time to a later one; species and internal variables go along straight lines.
    pub(super) fn in_time(from: &'a State, to: &'a State) -> Self {
        Self { from, to, clock: (from.time, to.time), ramp: None }
    }

    /// The conditions of one state during a span of pseudo-time, but for lengths on a ramp.
    pub(super) fn frozen(at: &'a State, clock: (f64, f64), ramp: Option<&'a Ramp>) -> Self {
        Self { from: at, to: at, clock, ramp }
    }

    /// What holds the sheet when the clock shows `t`; nothing at the end of a ramp and from there on.
    pub(super) fn held(&self, t: f64) -> Option<RampConditions> {
        self.ramp.filter(|_| t < 1.0).map(|ramp| ramp.conditions_at(t))
    }

    /// Readings of the clock at both ends.
    pub(super) fn clock(&self) -> (f64, f64) {
        self.clock
    }

    /// The conditions when the clock shows `t`, with the shape of `at`.
    pub(super) fn conditions_at(&self, t: f64, at: &State) -> State {
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
