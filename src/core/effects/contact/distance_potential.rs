//! What two points of surfaces that are d apart do to one another, per area.

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

/// The well.
#[derive(Debug, Clone, Copy)]
pub(super) struct Well {
    /// w.
    pub(super) work: f64,
    /// r.
    pub(super) reach: f64,
}

impl Well {
    /// 1 - u² where surfaces stick, else 0; and u.
    fn depth(&self, d: f64) -> (f64, f64) {
        let u = d / self.reach;
        ((1.0 - u * u).max(0.0), u)
    }

    /// a.
    pub(super) fn energy(&self, d: f64) -> f64 {
        let (depth, _) = self.depth(d);
        -self.work * depth * depth * depth
    }

    /// a'.
    pub(super) fn slope(&self, d: f64) -> f64 {
        let (depth, u) = self.depth(d);
        6.0 * self.work / self.reach * u * depth * depth
    }

    /// a''.
    pub(super) fn curvature(&self, d: f64) -> f64 {
        let (depth, u) = self.depth(d);
        6.0 * self.work / (self.reach * self.reach) * depth * (1.0 - 5.0 * u * u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_energy() {
        let well = Well { work: 3.0, reach: 0.7 };
        let mut steepest = 0.0f64;
        for k in 1..700 {
            let (d, h) = (1e-3 * f64::from(k), 1e-6);
            let slope = (well.energy(d + h) - well.energy(d - h)) / (2.0 * h);
            let curvature = (well.slope(d + h) - well.slope(d - h)) / (2.0 * h);
            assert!((slope - well.slope(d)).abs() < 1e-7, "{d}");
            assert!((curvature - well.curvature(d)).abs() < 1e-6, "{d}");
            steepest = steepest.max(slope);
        }
        assert!((steepest - 1.717 * 3.0 / 0.7).abs() < 1e-2, "{steepest}");
        assert_eq!([well.energy(0.0), well.slope(0.0), well.energy(0.7)], [-3.0, 0.0, 0.0]);
        assert_eq!([well.slope(0.8), well.curvature(0.7)], [0.0, 0.0]);
    }
}
