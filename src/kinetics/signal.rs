//! The signals: what kinetics may read of the shape, the stress and the clock.

use std::fmt;
use std::str::FromStr;

/// A quantity that the engine computes, if some kinetics reads it, at the points where species
/// live.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Signal {
    /// Mean curvature H, 1/length. Positive at the top of a bump towards the normal; 0 on the boundary.
    MeanCurvature,
    /// Gaussian curvature K, 1/length². Positive on a sphere, negative on a saddle.
    GaussianCurvature,
    /// Elastic area strain A/Ā - 1: current over optimal area, less one. Positive if stretched.
    AreaStrain,
    /// Tension σ, force/length. Positive if stretched. The scene chooses among its readings.
    Tension,
    /// Area ratio A/A⁰: current over rest area, growth included.
    AreaRatio,
    /// Current position (x, y, z), length.
    Position,
    /// Unit normal (x, y, z); triangles run counter-clockwise when seen from its tip.
    Normal,
    /// Contact pressure, force/length²: size of the force of contacts over the current area. 0 where nothing touches.
    ContactPressure,
    /// Time, the same at all points.
    Time,
}

impl Signal {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::MeanCurvature,
        Self::GaussianCurvature,
        Self::AreaStrain,
        Self::Tension,
        Self::AreaRatio,
        Self::Position,
        Self::Normal,
        Self::ContactPressure,
        Self::Time,
    ];

    /// The name in plugins, scenes and results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::MeanCurvature => "mean_curvature",
            Self::GaussianCurvature => "gaussian_curvature",
            Self::AreaStrain => "area_strain",
            Self::Tension => "tension",
            Self::AreaRatio => "area_ratio",
            Self::Position => "position",
            Self::Normal => "normal",
            Self::ContactPressure => "contact_pressure",
            Self::Time => "time",
        }
    }

    /// The least value that it can have; an infinite one where there is none.
    #[must_use]
    pub fn lower(self) -> f64 {
        match self {
            Self::AreaRatio | Self::ContactPressure | Self::Time => 0.0,
            Self::AreaStrain => -1.0,
            _ => f64::NEG_INFINITY,
        }
    }

    /// The unit, in words.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::MeanCurvature => "1/length",
            Self::GaussianCurvature => "1/length^2",
            Self::Tension => "force/length",
            Self::Position => "length",
            Self::ContactPressure => "force/length^2",
            Self::Time => "time",
            Self::AreaStrain | Self::AreaRatio | Self::Normal => "1",
        }
    }

    /// The names of its columns in a batch: one, or three for a vector.
    #[must_use]
    pub fn columns(self) -> &'static [&'static str] {
        match self {
            Self::MeanCurvature => &["mean_curvature"],
            Self::GaussianCurvature => &["gaussian_curvature"],
            Self::AreaStrain => &["area_strain"],
            Self::Tension => &["tension"],
            Self::AreaRatio => &["area_ratio"],
            Self::Position => &["position_x", "position_y", "position_z"],
            Self::Normal => &["normal_x", "normal_y", "normal_z"],
            Self::ContactPressure => &["contact_pressure"],
            Self::Time => &["time"],
        }
    }
}

impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Signal {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|signal| signal.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            format!("no signal `{name}`; expected one of {names}")
        })
    }
}
