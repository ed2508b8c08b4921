//! The state of a run: when, where every vertex is, and how much of every species is where.

use crate::Vec3;

/// Positions and species at one time.
#[derive(Debug, PartialEq, Default)]
pub struct State {
    /// Time, in the unit that the kinetics' rates use.
    pub time: f64,
    /// Accepted steps since the start.
    pub step: u64,
    /// Current positions `x_i`, one per vertex.
    pub x: Vec<Vec3>,
    /// For every species its value at every point (vertex or face).
    pub species: Vec<Vec<f64>>,
}

impl Clone for State {
    fn clone(&self) -> Self {
        let Self { time, step, x, species } = self;
        Self { time: *time, step: *step, x: x.clone(), species: species.clone() }
    }

    /// Into the memory that is there: states are copied with every step.
    fn clone_from(&mut self, from: &Self) {
        let Self { time, step, x, species } = from;
        (self.time, self.step) = (*time, *step);
        self.x.clone_from(x);
        self.species.clone_from(species);
    }
}
