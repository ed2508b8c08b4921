//! Force tolerance of relaxations.
//!
//! ```text
//! tolerance = 10⁻⁶                    of Y × mean edge, the force at unit strain
//!             10⁻⁴ F                  where the largest load F on a vertex, in this unit, is below 10⁻³
//!             64 ε × extent / mean edge                at least: round-off of positions leaves such forces
//! ```
//!
//! In a run it is tightened where Newton's step from a shape at rest leads far (`workspace/saddle.rs`).

use std::fmt;

use serde::de::{Error, IntoDeserializer, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::model::Potential;
use crate::num::checked::Positive;

const USUAL: f64 = 1e-6;
/// Part of the largest load that is left.
const LOAD_SHARE: f64 = 1e-4;
/// Loads this many times the usual tolerance move a sheet before it counts as at rest.
pub const FELT_LOAD_RATIO: f64 = 1e3;
/// Smallest attainable residual in units of ε × extent / mean edge.
const ROUND_OFF: f64 = 64.0 * f64::EPSILON;

/// Largest force on a vertex that counts as rest, in units of the force at unit strain (Y times the edge length).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum ForceTolerance {
    /// 10⁻⁶, and less under gentle loads.
    #[default]
    Auto,
    /// This.
    Given(Positive),
}

impl ForceTolerance {
    /// The number for the effects and the sheet of `potential`.
    #[must_use]
    pub fn on(self, potential: &Potential) -> f64 {
        let load = match self {
            Self::Given(_) => 0.0,
            Self::Auto => largest_load(potential),
        };
        match load > 0.0 && load < FELT_LOAD_RATIO * USUAL {
            true => rounded((LOAD_SHARE * load).max(least(potential))),
            false => self.without_loads(),
        }
    }

    /// The least that it is tightened to where soft modes are far from rest; `None` if it is given.
    #[must_use]
    pub fn tightest(self, potential: &Potential) -> Option<f64> {
        (self == Self::Auto).then(|| least(potential))
    }

    /// The number where there are no loads.
    #[must_use]
    pub fn without_loads(self) -> f64 {
        match self {
            Self::Given(tolerance) => tolerance.get(),
            Self::Auto => USUAL,
        }
    }
}

/// `number` to its first digit, as people write tolerances.
fn rounded(number: f64) -> f64 {
    format!("{number:.0e}").parse().unwrap_or(number)
}

/// The largest load on a vertex, in units of the force at unit strain.
#[must_use]
pub fn largest_load(potential: &Potential) -> f64 {
    let loads = potential.mechanics().applied_forces();
    loads.into_iter().map(|force| force / potential.force_scale()).fold(0.0, f64::max)
}

/// The least force that round-off of positions leaves.
fn least(potential: &Potential) -> f64 {
    let (rest, reduction) = (potential.sheet().rest(), potential.reduction());
    let extent = reduction.max(rest.len(), |i| rest[i].amax());
    ROUND_OFF * extent / potential.mechanics().reference().mean_edge()
}

impl Serialize for ForceTolerance {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Auto => serializer.serialize_str("auto"),
            Self::Given(tolerance) => tolerance.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for ForceTolerance {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Read;

        impl Visitor<'_> for Read {
            type Value = ForceTolerance;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{}, or \"auto\"", Positive::RANGE)
            }

            fn visit_str<E: Error>(self, word: &str) -> Result<ForceTolerance, E> {
                let unknown = || E::unknown_variant(word, &["auto"]);
                (word == "auto").then_some(ForceTolerance::Auto).ok_or_else(unknown)
            }

            fn visit_i64<E: Error>(self, number: i64) -> Result<ForceTolerance, E> {
                #[allow(clippy::cast_precision_loss)]
                self.visit_f64(number as f64)
            }

            fn visit_f64<E: Error>(self, number: f64) -> Result<ForceTolerance, E> {
                Positive::deserialize(number.into_deserializer()).map(ForceTolerance::Given)
            }
        }

        deserializer.deserialize_any(Read)
    }
}
