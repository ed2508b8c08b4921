//! Values of species that effects hold: Dirichlet values.

use crate::effects::DirichletValues;

/// What is held of all species, as many points as there are.
#[derive(Debug, Default)]
pub struct HeldValues {
    /// Point and value, ascending points, for every species; nothing where none is held.
    points: Vec<Vec<(usize, f64)>>,
    /// Whether each point is held, for every species with such points.
    mask: Vec<Vec<bool>>,
}

impl HeldValues {
    /// All of these, of `species` species.
    pub(super) fn new(species: usize, held: &[DirichletValues]) -> Self {
        if held.is_empty() {
            return Self::default();
        }
        let (mut points, mut mask) = (vec![Vec::new(); species], vec![Vec::new(); species]);
        for held in held {
            points[held.species()].extend_from_slice(held.points());
        }
        for (points, mask) in points.iter_mut().zip(&mut mask) {
            points.sort_unstable_by_key(|(point, _)| *point);
            points.dedup_by_key(|(point, _)| *point);
            mask.resize(points.last().map_or(0, |(last, _)| last + 1), false);
            points.iter().for_each(|(point, _)| mask[*point] = true);
        }
        Self { points, mask }
    }

    /// Whether the species `s` is held at `point`.
    #[must_use]
    pub fn holds(&self, s: usize, point: usize) -> bool {
        self.mask.get(s).and_then(|mask| mask.get(point)).is_some_and(|held| *held)
    }

    /// Points and values of the species `s`.
    #[must_use]
    pub fn points_of(&self, s: usize) -> &[(usize, f64)] {
        self.points.get(s).map_or(&[], Vec::as_slice)
    }

    /// Sets the values.
    pub(in crate::model) fn set(&self, species: &mut [Vec<f64>]) {
        for (points, c) in self.points.iter().zip(species) {
            points.iter().for_each(|(point, value)| c[*point] = *value);
        }
    }

    /// Makes the rates of the species `s` `g - c` there.
    pub(super) fn set_rates(&self, s: usize, c: &[f64], rates: &mut [f64]) {
        for (point, value) in self.points_of(s) {
            rates[*point] = value - c[*point];
        }
    }
}
