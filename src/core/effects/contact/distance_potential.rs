//! What two points of surfaces that are d apart do to one another, per area.

use super::adhesion::Well;
use super::barrier::Barrier;

/// An energy per area of the distance: C² and zero from a reach on.
#[derive(Debug, Clone, Copy)]
pub(super) enum DistancePotential {
    /// Keeps them apart.
    Barrier(Barrier),
    /// Holds them together.
    Well(Well),
}

impl DistancePotential {
    /// Whether it keeps surfaces apart.
    pub(super) fn is_barrier(&self) -> bool {
        matches!(self, Self::Barrier(_))
    }

    /// The distance from which on it is zero.
    pub(super) fn reach(&self) -> f64 {
        match self {
            Self::Barrier(barrier) => barrier.reach,
            Self::Well(well) => well.reach,
        }
    }

    /// That between features whose distance at rest bounds their reach: neighbours on the sheet do not stick together.
    pub(super) fn of_neighbours(&self, reach: f64) -> Option<Self> {
        match self {
            Self::Barrier(barrier) => Some(Self::Barrier(Barrier { reach, ..*barrier })),
            Self::Well(_) => None,
        }
    }

    /// Energy.
    pub(super) fn energy(&self, d: f64) -> f64 {
        match self {
            Self::Barrier(barrier) => barrier.energy(d),
            Self::Well(well) => well.energy(d),
        }
    }

    /// Its first derivative.
    pub(super) fn slope(&self, d: f64) -> f64 {
        match self {
            Self::Barrier(barrier) => barrier.slope(d),
            Self::Well(well) => well.slope(d),
        }
    }

    /// Its second derivative.
    pub(super) fn curvature(&self, d: f64) -> f64 {
        match self {
            Self::Barrier(barrier) => barrier.curvature(d),
            Self::Well(well) => well.curvature(d),
        }
    }
}
