//! Fixed directions of vertices, prescribed positions and Dirichlet values of species.

use std::borrow::Cow;

use super::field::vertex_places;
use super::ramp::{MAX_SAMPLES, RampFactor};
use super::timed_field::TimedField;
use crate::Vec3;
use crate::kinetics::breakpoints::TimeDependence;
use crate::kinetics::formula::{FieldFormula, Places};
use crate::num::real;
use crate::sheet::Sheet;

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

/// Points of one species with the values that they have.
#[derive(Debug, Clone)]
pub struct DirichletValues {
    species: usize,
    /// Ascending, with the values at time 0.
    points: Vec<(usize, f64)>,
    /// Where the values change in time.
    course: Option<ValueCourse>,
}

/// A formula of the time at points.
#[derive(Debug, Clone)]
struct ValueCourse {
    formula: FieldFormula,
    /// So many for every point, over which its value is the mean.
    places: Vec<Vec3>,
    distances: Vec<f64>,
}

impl ValueCourse {
    fn places(&self) -> Places<'_> {
        Places::with_distances(&self.places, &self.distances)
    }
}

impl DirichletValues {
    /// Of the species of this number at `points`, each with the vertices over which its value is the mean, as many for every point.
    pub(super) fn new<const N: usize>(
        sheet: &Sheet,
        species: usize,
        points: &[(usize, [usize; N])],
        value: &TimedField,
    ) -> Self {
        let start = value.evaluate(sheet, 0.0);
        let mean = |vertices: &[usize; N]| {
            vertices.iter().map(|v| start.at(*v)).sum::<f64>() / real(N.max(1))
        };
        let course = value.timed_formula().map(|formula| {
            let vertices: Vec<usize> = points.iter().flat_map(|(_, vertices)| *vertices).collect();
            let (places, distances) =
                vertex_places(sheet, formula.depends_on_distance()).at(&vertices);
            ValueCourse { formula: formula.clone(), places, distances }
        });
        let points = points.iter().map(|(point, vertices)| (*point, mean(vertices))).collect();
        Self { species, points, course }
    }

    /// Number of the species in the kinetics' descriptor.
    #[must_use]
    pub fn species(&self) -> usize {
        self.species
    }

    /// Numbers of points and their values at time 0.
    #[must_use]
    pub fn points(&self) -> &[(usize, f64)] {
        &self.points
    }

    /// The points with their values at a time.
    #[must_use]
    pub fn values(&self, time: f64) -> Cow<'_, [(usize, f64)]> {
        let Some(course) = &self.course else { return Cow::Borrowed(&self.points) };
        Cow::Owned(self.means(&course.formula.evaluate(course.places(), time)))
    }

    /// The points with the derivatives of their values by the time; none where these do not change.
    #[must_use]
    pub fn slopes(&self, time: f64) -> Vec<(usize, f64)> {
        let slopes = self.course.as_ref().and_then(|course| {
            let slopes = course.formula.time_slopes(course.places(), time)?;
            Some(self.means(&slopes))
        });
        slopes.unwrap_or_default()
    }

    /// The points with the means over their places.
    fn means(&self, values: &[f64]) -> Vec<(usize, f64)> {
        let each = (values.len() / self.points.len().max(1)).max(1);
        let means = values.chunks(each).map(|values| values.iter().sum::<f64>() / real(each));
        self.points.iter().map(|(point, _)| *point).zip(means).collect()
    }

    /// Whether it holds `species` at `point`.
    #[must_use]
    pub(crate) fn holds(&self, species: usize, point: usize) -> bool {
        let found = || self.points.binary_search_by_key(&point, |(point, _)| *point);
        self.species == species && found().is_ok()
    }

    /// Times from 0 to `until` at which its values are near to any that they have.
    fn samples(&self, until: f64) -> Vec<f64> {
        let mut known = TimeDependence::default();
        let Some(course) = &self.course else { return vec![0.0] };
        course.formula.time_dependence(course.places(), until, &mut known);
        let mut times = known.sample_times(until, MAX_SAMPLES);
        times.extend(known.breakpoints);
        times.extend([0.0, until]);
        times
    }

    /// The largest |value| at a time up to `until`.
    #[must_use]
    pub fn largest(&self, until: f64) -> f64 {
        let of =
            |time: f64| self.values(time).iter().fold(0.0, |most: f64, (_, v)| most.max(v.abs()));
        self.samples(until).into_iter().map(of).fold(0.0, f64::max)
    }

    /// A point, its value and the time up to `until` at which this is not from `lower` to `upper`.
    #[must_use]
    pub(crate) fn out_of_range(
        &self,
        (lower, upper): (f64, f64),
        until: f64,
    ) -> Option<(usize, f64, f64)> {
        let wrong = |(_, value): &&(usize, f64)| !(*value >= lower && *value <= upper);
        self.samples(until).into_iter().find_map(|time| {
            let values = self.values(time);
            values.iter().find(wrong).map(|(point, value)| (*point, *value, time))
        })
    }

    /// A point that `other` holds at another value at a time up to `until`.
    #[must_use]
    pub(crate) fn conflict(&self, other: &Self, until: f64) -> Option<usize> {
        let shared = |point: usize| other.holds(self.species, point);
        self.points.iter().find(|(point, _)| shared(*point))?;
        let mut times = self.samples(until);
        times.extend(other.samples(until));
        times.into_iter().find_map(|time| {
            let (own, others) = (self.values(time), other.values(time));
            let differs = |(point, value): &&(usize, f64)| {
                let place = others.binary_search_by_key(point, |(point, _)| *point);
                place.is_ok_and(|k| others[k].1 != *value)
            };
            own.iter().find(differs).map(|(point, _)| *point)
        })
    }
}
