//! What species do to the sheet: functions of the species and the parameters alone.
//!
//! ```text
//! Φ(c) > 0    length factor of active strain                                 laws multiply theirs
//! C₀(c)       spontaneous curvature of bending, 1/length, of either sign     laws on one sheet add theirs
//! Φ_⊥(c) > 0  length factor across a fibre; Φ is then the one along it        laws multiply theirs
//! ```

use super::Capabilities;

/// What messages call the length factor.
pub(super) const LENGTH_FACTOR: &str = "the length factor";

/// The same of the one across a fibre.
pub(super) const LENGTH_FACTOR_ACROSS: &str = "the length factor across";

/// A quantity that a law may give.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Feedback {
    /// Φ.
    LengthFactor,
    /// C₀.
    Curvature,
    /// Φ_⊥.
    FactorAcross,
}

impl Feedback {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::LengthFactor, Self::Curvature, Self::FactorAcross];

    /// Its key in scenes, which is the name of its call.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::LengthFactor => "length_factor",
            Self::Curvature => "curvature",
            Self::FactorAcross => "length_factor_across",
        }
    }

    /// The name of the call with partial derivatives.
    pub(super) fn partials_name(self) -> &'static str {
        match self {
            Self::LengthFactor => "length_factor_partials",
            Self::Curvature => "curvature_partials",
            Self::FactorAcross => "length_factor_across_partials",
        }
    }

    /// What messages call it.
    #[must_use]
    pub fn describe(self) -> &'static str {
        match self {
            Self::LengthFactor => LENGTH_FACTOR,
            Self::Curvature => "the spontaneous curvature",
            Self::FactorAcross => LENGTH_FACTOR_ACROSS,
        }
    }

    /// Whether a law with these capabilities gives it.
    #[must_use]
    pub fn is_given(self, capabilities: &Capabilities) -> bool {
        match self {
            Self::LengthFactor => capabilities.length_factor,
            Self::Curvature => capabilities.curvature,
            Self::FactorAcross => capabilities.length_factor_across,
        }
    }

    /// Notes that it is given, with its partial derivatives.
    pub(super) fn give(self, capabilities: &mut Capabilities) {
        match self {
            Self::LengthFactor => {
                capabilities.length_factor = true;
                capabilities.length_factor_partials = true;
            }
            Self::Curvature => capabilities.curvature = true,
            Self::FactorAcross => capabilities.length_factor_across = true,
        }
    }

    /// Its value where no law gives it.
    #[must_use]
    pub fn neutral(self) -> f64 {
        match self {
            Self::Curvature => 0.0,
            Self::LengthFactor | Self::FactorAcross => 1.0,
        }
    }

    /// The least value allowed.
    pub(super) fn least(self) -> f64 {
        match self {
            Self::Curvature => f64::MIN,
            Self::LengthFactor | Self::FactorAcross => f64::MIN_POSITIVE,
        }
    }

    /// What two laws give together, with the derivatives by what each gives.
    pub(super) fn joined(self, a: f64, b: f64) -> (f64, [f64; 2]) {
        match self {
            Self::Curvature => (a + b, [1.0, 1.0]),
            Self::LengthFactor | Self::FactorAcross => (a * b, [b, a]),
        }
    }
}

/// Whether messages about a number <= 0 explain that this quantity has to be positive.
pub(super) fn is_factor(quantity: &str) -> bool {
    [LENGTH_FACTOR, LENGTH_FACTOR_ACROSS].contains(&quantity)
}
