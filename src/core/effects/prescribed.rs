//! Fixed directions of vertices, prescribed positions and Dirichlet values of species.

use super::ramp::RampFactor;
use crate::Vec3;

/// For every vertex the directions that are fixed.
pub type Pins = Vec<[bool; 3]>;

/// Fixed directions of vertices whose positions are prescribed.
#[derive(Debug, Clone)]
pub struct PrescribedDisplacement {
    pub(super) vertices: Vec<usize>,
    pub(super) axes: [bool; 3],
    pub(super) displacement: Vec3,
    pub(super) factor: RampFactor,
}

impl PrescribedDisplacement {
    /// A vertex and an axis that both prescribe, with different positions at a time up to `until`.
    #[must_use]
    pub(crate) fn conflict(&self, other: &Self, until: f64) -> Option<(usize, usize)> {
        // Both are in ascending order.
        let shared = |v: &&usize| other.vertices.binary_search(v).is_ok();
        let vertex = *self.vertices.iter().find(shared)?;
        let mut times = self.factor.samples(until);
        times.extend(other.factor.samples(until));
        let differ = |a: usize| {
            let at = |one: &Self, t: f64| one.factor.factor_at(t) * one.displacement[a];
            times.iter().any(|t| {
                let (mine, theirs) = (at(self, *t), at(other, *t));
                (mine - theirs).abs() > 1e-12 * mine.abs().max(theirs.abs())
            })
        };
        let axis = (0..3).find(|&a| self.axes[a] && other.axes[a] && differ(a))?;
        Some((vertex, axis))
    }

    /// A vertex and an axis of `fixed` along which it leaves the start at a time up to `until`.
    #[must_use]
    pub(crate) fn leaves(&self, fixed: &Pins, until: f64) -> Option<(usize, usize)> {
        let moved = |a: usize| self.axes[a] && self.displacement[a] != 0.0;
        let both = |v: usize| (0..3).find(|&a| moved(a) && fixed[v][a]).map(|a| (v, a));
        let shared = self.vertices.iter().find_map(|v| both(*v))?;
        let leaves = self.factor.samples(until).iter().any(|t| self.factor.factor_at(*t) != 0.0);
        leaves.then_some(shared)
    }

    /// Takes its directions out of `fixed`.
    pub(crate) fn take_from(&self, fixed: &mut Pins) {
        for &v in &self.vertices {
            (0..3).filter(|&a| self.axes[a]).for_each(|a| fixed[v][a] = false);
        }
    }

    /// Sets the fixed components of `x` to where they are at `time`.
    pub fn set(&self, rest: &[Vec3], time: f64, x: &mut [Vec3]) {
        let by = self.factor.factor_at(time) * self.displacement;
        for &i in &self.vertices {
            for a in (0..3).filter(|&a| self.axes[a]) {
                x[i][a] = rest[i][a] + by[a];
            }
        }
    }
}

/// Points of one species with the values that they have at all times.
#[derive(Debug, Clone)]
pub struct DirichletValues {
    pub(super) species: usize,
    /// Ascending.
    pub(super) points: Vec<(usize, f64)>,
}

impl DirichletValues {
    /// Number of the species in the kinetics' descriptor.
    #[must_use]
    pub fn species(&self) -> usize {
        self.species
    }

    /// Numbers of points and their values.
    #[must_use]
    pub fn points(&self) -> &[(usize, f64)] {
        &self.points
    }

    /// Whether it holds `species` at `point`.
    #[must_use]
    pub(crate) fn holds(&self, species: usize, point: usize) -> bool {
        let found = || self.points.binary_search_by_key(&point, |(point, _)| *point);
        self.species == species && found().is_ok()
    }

    /// A point that `other` holds at another value.
    #[must_use]
    pub(crate) fn conflict(&self, other: &Self) -> Option<usize> {
        let differs = |(point, value): &&(usize, f64)| {
            let place = other.points.binary_search_by_key(point, |(point, _)| *point);
            self.species == other.species && place.is_ok_and(|k| other.points[k].1 != *value)
        };
        self.points.iter().find(differs).map(|(point, _)| *point)
    }
}
