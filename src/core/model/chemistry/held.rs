//! Values of species that effects hold: Dirichlet values.

use crate::effects::DirichletValues;

/// What is held of all species, as many points as there are.
#[derive(Debug, Default)]
pub struct HeldValues {
    /// Where two hold a point, their values agree.
    all: Vec<DirichletValues>,
    /// Whether each point is held, for every species with such points.
    mask: Vec<Vec<bool>>,
}

impl HeldValues {
    /// All of these, of `species` species.
    pub(super) fn new(species: usize, held: &[DirichletValues]) -> Self {
        if held.is_empty() {
            return Self::default();
        }
        let mut mask = vec![Vec::new(); species];
        for held in held {
            let mask: &mut Vec<bool> = &mut mask[held.species()];
            let points = held.points().last().map_or(0, |(last, _)| last + 1);
            mask.resize(points.max(mask.len()), false);
            held.points().iter().for_each(|(point, _)| mask[*point] = true);
        }
        Self { all: held.to_vec(), mask }
    }

    /// Whether the species `s` is held at `point`.
    #[must_use]
    pub fn holds(&self, s: usize, point: usize) -> bool {
        self.mask.get(s).and_then(|mask| mask.get(point)).is_some_and(|held| *held)
    }

    /// The largest |value| of the species `s` at a time up to `until`.
    #[must_use]
    pub fn largest(&self, s: usize, until: f64) -> f64 {
        let of_species = self.all.iter().filter(|held| held.species() == s);
        of_species.map(|held| held.largest(until)).fold(0.0, f64::max)
    }

    /// Sets the values at a time.
    pub(in crate::model) fn set(&self, time: f64, species: &mut [Vec<f64>]) {
        for held in &self.all {
            let c = &mut species[held.species()];
            held.values(time).iter().for_each(|(point, value)| c[*point] = *value);
        }
    }

    /// Makes the rates there `g - c`.
    pub(super) fn set_rates(&self, time: f64, species: &[&[f64]], rates: &mut [&mut [f64]]) {
        for held in &self.all {
            let s = held.species();
            for (point, value) in held.values(time).iter() {
                rates[s][*point] = value - species[s][*point];
            }
        }
    }

    /// Hands what changes in time to `visit` as (species, point, g, ∂g/∂t); a point may come more than once.
    pub(in crate::model) fn moving(
        &self,
        time: f64,
        mut visit: impl FnMut(usize, usize, f64, f64),
    ) {
        for held in &self.all {
            let slopes = held.slopes(time);
            if slopes.is_empty() {
                continue;
            }
            for ((point, value), (_, slope)) in held.values(time).iter().zip(slopes) {
                visit(held.species(), *point, *value, slope);
            }
        }
    }
}
