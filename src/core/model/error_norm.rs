//! Error norms: distance of two results of a step in units of a tolerance.
//!
//! ```text
//! misfit = ‖b - a‖₂ / (unit √n),     unit = atol·typical + rtol·max|v|
//! n      = Σ v²/max v², or the number of points that changed in the step by more than a share of the unit,
//!          if more
//! ```
//!
//! n counts the points that carry v: of a spot its size, of a uniform field all. So the misfit is the relative
//! L2 error over rtol, where few points change at once and atol is 0; what single points do, that switch
//! at an instant of their own, counts by their share of the pattern, and a small active spot on a large quiet
//! sheet is not averaged away.

use super::{Model, State};
use crate::Vec3;
use crate::effects::InternalVariables;
use crate::reduction::Reduction;

/// Points that change by less than this share of the unit do not count as changed.
const NEGLIGIBLE_CHANGE: f64 = 0.1;

impl Model {
    /// The misfit of the species of `a` and `b`, the larger over the species; both follow from `start`.
    #[must_use]
    pub fn species_misfit(
        &self,
        start: &State,
        (a, b): (&State, &State),
        (rtol, atol): (f64, f64),
    ) -> f64 {
        let Some(chemistry) = &self.chemistry else { return 0.0 };
        let of = |s: usize| {
            let (start, a, b) = (&start.species[s], &a.species[s], &b.species[s]);
            let largest = self.sheet().reduction().max(b.len(), |i| b[i].abs());
            let unit = atol * chemistry.typical(s) + rtol * largest;
            misfit(self.sheet().reduction(), b.len(), unit, |i| {
                (b[i] - start[i], b[i] - a[i], b[i] / largest)
            })
        };
        (0..chemistry.descriptor().species.len()).map(of).fold(0.0, f64::max)
    }

    /// The misfit of the internal variables of `a` and `b`, the larger over all, with v what they have changed by since
    /// nothing had happened to the sheet; both follow from `start`.
    #[must_use]
    pub(crate) fn internal_misfit(
        &self,
        start: &State,
        (a, b): (&State, &State),
        (rtol, atol): (f64, f64),
    ) -> f64 {
        let reduction = self.sheet().reduction();
        let of = |(k, term): (usize, &dyn InternalVariables)| {
            let (start, a, b) = (&start.internal[k], &a.internal[k], &b.internal[k]);
            let changed = |i: usize| b[i] - term.initial(i);
            let largest = reduction.max(b.len(), |i| changed(i).abs());
            let unit = atol * term.typical() + rtol * largest;
            misfit(reduction, b.len(), unit, |i| {
                (b[i] - start[i], b[i] - a[i], changed(i) / largest)
            })
        };
        self.internal.iter().map(|term| &**term).enumerate().map(of).fold(0.0, f64::max)
    }

    /// The misfit of the shapes of `a` and `b`, with v the displacement from rest and the mean edge as its
    /// typical size.
    #[must_use]
    pub fn shape_misfit(
        &self,
        start: &[Vec3],
        (a, b): (&[Vec3], &[Vec3]),
        tolerance: (f64, f64),
    ) -> f64 {
        if !self.moves() {
            return 0.0;
        }
        let (rest, largest) = (self.sheet().rest(), self.largest_displacement(b));
        misfit(self.sheet().reduction(), rest.len(), self.length_unit(largest, tolerance), |i| {
            let moved = (b[i] - start[i]).norm();
            (moved, (b[i] - a[i]).norm(), (b[i] - rest[i]).norm() / largest)
        })
    }

    /// The unit of [`Model::shape_misfit`]: the length that tolerances mean.
    #[must_use]
    pub(crate) fn shape_unit(&self, state: &State, tolerance: (f64, f64)) -> f64 {
        self.length_unit(self.largest_displacement(&state.x), tolerance)
    }

    fn largest_displacement(&self, x: &[Vec3]) -> f64 {
        let rest = self.sheet().rest();
        self.sheet().reduction().max(rest.len(), |i| (x[i] - rest[i]).norm())
    }

    fn length_unit(&self, largest: f64, (rtol, atol): (f64, f64)) -> f64 {
        atol * self.mechanics.reference().mean_edge() + rtol * largest
    }
}

/// Of `points`, each with its change in the step, its difference, and its size as a share of the largest.
fn misfit(
    reduction: &Reduction,
    points: usize,
    unit: f64,
    at: impl Fn(usize) -> (f64, f64, f64) + Sync,
) -> f64 {
    let sum = reduction.sum(points, |i| at(i).1.powi(2));
    if sum == 0.0 {
        return 0.0;
    }
    let changed =
        reduction.sum(points, |i| if at(i).0.abs() > NEGLIGIBLE_CHANGE * unit { 1.0 } else { 0.0 });
    let carrying = reduction.sum(points, |i| at(i).2.powi(2));
    // Where v is 0 everywhere nothing carries it.
    let carrying = if carrying.is_finite() { carrying } else { reduction.count(points) };
    sum.sqrt() / (unit * changed.max(carrying).max(1.0).sqrt())
}
