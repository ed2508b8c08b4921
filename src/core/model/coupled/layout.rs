//! Which unknown of the coupled system is what.

use std::borrow::Cow;

use super::super::rigid::{minimal_pins, unhindered_at_rest};
use super::super::{Mechanics, Model, State};
use crate::Vec3;
use crate::num::index;

/// Stands for a direction that is fixed.
const NO_UNKNOWN: u32 = u32::MAX;

/// What of the model moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subsystem {
    /// All of it.
    Whole,
    /// The species, on a fixed surface; signals go along a course.
    Chemistry,
}

/// Places of displacements and species among the unknowns.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// For every vertex and axis its place, or [`NO_UNKNOWN`]; of no vertex where none is an unknown.
    place: Vec<[u32; 3]>,
    mechanical: usize,
    points: usize,
    species: usize,
    /// Whether the shape is fixed: it is not an unknown, and no position is prescribed.
    still: bool,
}

impl Layout {
    /// Of the unknowns of `part`: free directions first (none if the shape never moves), then species
    /// point by point. If the shape is `still`, without storage, rigid motions are fixed too.
    pub(super) fn new(model: &Model, part: Subsystem, still: bool) -> Self {
        let moves = model.moves() && part != Subsystem::Chemistry;
        let mechanics = model.mechanics();
        let mut pins = Cow::Borrowed(mechanics.pins());
        if moves && still {
            // Without storage the rows of forces say nothing about these.
            let motions = unhindered_at_rest(mechanics);
            for (vertex, axis) in minimal_pins(&motions, &pins) {
                pins.to_mut()[vertex][axis] = true;
            }
        }
        let mut mechanical = 0;
        let mut number = |fixed: bool| {
            if fixed {
                return NO_UNKNOWN;
            }
            mechanical += 1;
            index(mechanical - 1)
        };
        let of_vertices = pins.iter().filter(|_| moves);
        let place = of_vertices.map(|fixed| fixed.map(&mut number)).collect();
        let chemistry = model.chemistry();
        let (points, species) =
            chemistry.map_or((0, 0), |c| (c.points(model.sheet()), c.descriptor().species.len()));
        let still = mechanical == 0 && !(moves && mechanics.has_prescribed());
        Self { place, mechanical, points, species, still }
    }

    /// How many unknowns are displacements.
    #[must_use]
    pub fn mechanical(&self) -> usize {
        self.mechanical
    }

    /// How many points carry species.
    #[must_use]
    pub fn points(&self) -> usize {
        self.points
    }

    /// How many species there are.
    #[must_use]
    pub fn species(&self) -> usize {
        self.species
    }

    /// How many unknowns there are.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.mechanical + self.points * self.species
    }

    /// Whether the shape is fixed.
    #[must_use]
    pub fn is_still(&self) -> bool {
        self.still
    }

    /// Place of a displacement; none if it is fixed.
    #[must_use]
    pub fn displacement(&self, vertex: usize, axis: usize) -> Option<usize> {
        let place = self.place.get(vertex)?[axis];
        (place != NO_UNKNOWN).then_some(place as usize)
    }

    /// Places of the displacements of every vertex; of none where no displacement is an unknown.
    pub fn displacements(&self) -> impl Iterator<Item = [Option<usize>; 3]> + '_ {
        (0..self.place.len()).map(|v| std::array::from_fn(|axis| self.displacement(v, axis)))
    }

    /// Place of a species at a point.
    #[must_use]
    pub fn concentration(&self, species: usize, point: usize) -> usize {
        self.mechanical + point * self.species + species
    }

    pub(super) fn pack(&self, rest: &[Vec3], state: &State, y: &mut [f64]) {
        for (i, place) in self.place.iter().enumerate() {
            for axis in 0..3 {
                if place[axis] != NO_UNKNOWN {
                    y[place[axis] as usize] = state.x[i][axis] - rest[i][axis];
                }
            }
        }
        self.pack_species(&state.species, y);
    }

    pub(super) fn pack_forces(&self, gradient: &[Vec3], out: &mut [f64]) {
        for (g, place) in gradient.iter().zip(&self.place) {
            for axis in 0..3 {
                if place[axis] != NO_UNKNOWN {
                    out[place[axis] as usize] = -g[axis];
                }
            }
        }
    }

    pub(super) fn pack_species(&self, species: &[Vec<f64>], out: &mut [f64]) {
        for (s, values) in species.iter().enumerate().take(self.species) {
            for (point, value) in values.iter().enumerate() {
                out[self.concentration(s, point)] = *value;
            }
        }
    }

    /// Writes the unknowns `y` at `time` into `state`, whose fixed directions stay as they are or are led
    /// along.
    pub fn unpack(&self, mechanics: &Mechanics, time: f64, y: &[f64], state: &mut State) {
        let rest = mechanics.sheet().rest();
        state.time = time;
        if !self.still {
            mechanics.set_prescribed(time, &mut state.x);
        }
        // Positions that no unknown changes are not touched: they are shared.
        if self.mechanical > 0 {
            let x = &mut *state.x;
            for (i, place) in self.place.iter().enumerate() {
                for axis in 0..3 {
                    if place[axis] != NO_UNKNOWN {
                        x[i][axis] = rest[i][axis] + y[place[axis] as usize];
                    }
                }
            }
        }
        for (s, values) in state.species.iter_mut().enumerate().take(self.species) {
            for (point, value) in values.iter_mut().enumerate() {
                *value = y[self.mechanical + point * self.species + s];
            }
        }
    }
}
