//! Balls around features, at rest and on the move.

use rumple_numerics::Vec3;
use rumple_numerics::num::real;

/// A ball around a feature, and how it moves: by `drift`, and no point of it by more than `spread` besides.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ball {
    pub(super) centre: Vec3,
    pub(super) radius: f64,
    drift: Vec3,
    spread: f64,
}

impl Ball {
    /// Around `corners` in `x`, on the step `d` if there is one.
    #[inline]
    pub(super) fn around(corners: &[u32], x: &[Vec3], d: Option<&[Vec3]>) -> Self {
        let (centre, radius) = enclosing(corners, x);
        let (drift, spread) = d.map_or((Vec3::zeros(), 0.0), |d| enclosing(corners, d));
        Self { centre, radius, drift, spread }
    }

    /// A lower bound of the distance of what two balls hold, at all times of the motion.
    #[inline]
    pub(super) fn min_distance(&self, other: &Self) -> f64 {
        let moves = (self.drift - other.drift).norm() + self.spread + other.spread;
        (self.centre - other.centre).norm() - self.radius - other.radius - moves
    }

    /// Whether what two balls hold comes nearer than `distance`, as far as the balls tell.
    #[inline]
    pub(super) fn comes_within(&self, other: &Self, distance: f64) -> bool {
        let fixed = self.radius + other.radius + self.spread + other.spread + distance;
        let (apart, drift) = (self.centre - other.centre, self.drift - other.drift);
        // Without square roots in most cases: |a| < f + |b| where |a|² < (f + |b|)².
        let (apart, drift) = (apart.norm_squared(), drift.norm_squared());
        apart < fixed * fixed || (drift > 0.0 && apart < (fixed + drift.sqrt()).powi(2))
    }

    /// An upper bound of the distance of what two balls hold that do not move.
    #[inline]
    pub(super) fn max_distance(&self, other: &Self) -> f64 {
        (self.centre - other.centre).norm() + self.radius + other.radius
    }
}

/// The mean of some points, and the largest distance from it.
#[inline]
fn enclosing(corners: &[u32], x: &[Vec3]) -> (Vec3, f64) {
    let places = || corners.iter().map(|v| x[*v as usize]);
    let mean = places().sum::<Vec3>() / real(corners.len());
    let radius = places().map(|x| (x - mean).norm_squared()).fold(0.0, f64::max);
    (mean, radius.sqrt())
}
