//! The state of a run: when, where every vertex is, how much of every species is where, and the internal variables of
//! effects.

use std::ops::{Deref, DerefMut};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::Vec3;
use crate::sheet::Sheet;

/// Positions of the vertices. Copies share them until one is changed: the states of a shape that does not move
/// have them once.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(from = "Vec<Vec3>", into = "Vec<Vec3>")]
pub struct Positions(Arc<Vec<Vec3>>);

impl Positions {
    /// Copies those of `from` into the allocated memory, or shares them where none is allocated.
    fn take(&mut self, from: &Self) {
        if Arc::ptr_eq(&self.0, &from.0) {
            return;
        }
        match Arc::get_mut(&mut self.0) {
            Some(own) if own.len() == from.len() => own.copy_from_slice(from),
            _ => self.0 = Arc::clone(&from.0),
        }
    }
}

impl PartialEq for Positions {
    fn eq(&self, other: &Self) -> bool {
        // Those that are no numbers are not even those of themselves, and are looked for elsewhere.
        Arc::ptr_eq(&self.0, &other.0) || self.0 == other.0
    }
}

impl Deref for Positions {
    type Target = Vec<Vec3>;

    fn deref(&self) -> &Vec<Vec3> {
        &self.0
    }
}

impl DerefMut for Positions {
    fn deref_mut(&mut self) -> &mut Vec<Vec3> {
        Arc::make_mut(&mut self.0)
    }
}

impl From<Vec<Vec3>> for Positions {
    fn from(x: Vec<Vec3>) -> Self {
        Self(Arc::new(x))
    }
}

impl From<&Sheet> for Positions {
    /// Those at rest.
    fn from(sheet: &Sheet) -> Self {
        Self(Arc::clone(sheet.shared_rest()))
    }
}

impl FromIterator<Vec3> for Positions {
    fn from_iter<I: IntoIterator<Item = Vec3>>(all: I) -> Self {
        all.into_iter().collect::<Vec<_>>().into()
    }
}

impl From<Positions> for Vec<Vec3> {
    fn from(x: Positions) -> Self {
        Arc::unwrap_or_clone(x.0)
    }
}

impl<'a> IntoIterator for &'a mut Positions {
    type Item = &'a mut Vec3;
    type IntoIter = std::slice::IterMut<'a, Vec3>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter_mut()
    }
}

impl<'a> IntoIterator for &'a Positions {
    type Item = &'a Vec3;
    type IntoIter = std::slice::Iter<'a, Vec3>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}

/// Positions, species and internal variables at one time.
#[derive(Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct State {
    /// Time, in the unit that the kinetics' rates use.
    pub time: f64,
    /// Accepted steps since the start.
    pub step: u64,
    /// Current positions `x_i`, one per vertex.
    pub x: Positions,
    /// For every species its value at every point (vertex or face).
    pub species: Vec<Vec<f64>>,
    /// The values of every internal variable that an effect owns ([`InternalVariables`](crate::effects::InternalVariables)); empty without.
    pub internal: Vec<Vec<f64>>,
}

impl Clone for State {
    fn clone(&self) -> Self {
        let Self { time, step, x, species, internal } = self;
        let (species, internal) = (species.clone(), internal.clone());
        Self { time: *time, step: *step, x: x.clone(), species, internal }
    }

    /// Into the memory that is there: states are copied with every step.
    fn clone_from(&mut self, from: &Self) {
        let Self { time, step, x, species, internal } = from;
        (self.time, self.step) = (*time, *step);
        self.x.take(x);
        self.species.clone_from(species);
        self.internal.clone_from(internal);
    }
}
