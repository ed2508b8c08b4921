//! `[invariants]`: monitors of laws of nature.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, Unexpected, Visitor};
use serde::{Serialize, Serializer};

use crate::num::checked::{AtLeast, NonNegative};

/// The table `[invariants]`; what it does not list is neither inspected nor paid for.
#[derive(Debug, Clone, PartialEq, Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default, rename_all = "kebab-case")]
pub struct InvariantsSpec {
    /// Steps between looks; the energy is accounted for in every one.
    pub every: AtLeast<1>,
    /// Balance of the energy: what a step leaves unaccounted for, relative to what it turns over.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<Bound>,
    /// Net force and torque of a free sheet, relative to the sum of their sizes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force: Option<Bound>,
    /// Pairs of triangles that cross.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crossings: Option<Bound>,
    /// Totals of species that stay as they are at the start, relative to the sum of their sizes: names of species,
    /// with a number before them or not, joined by `+`.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub totals: BTreeMap<String, Bound>,
}

impl Default for InvariantsSpec {
    fn default() -> Self {
        Self {
            every: AtLeast::LEAST,
            energy: None,
            force: None,
            crossings: None,
            totals: BTreeMap::new(),
        }
    }
}

/// What is asked of a law: `true`, or a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// To be written in the ledger.
    Watched,
    /// And that the run ends where a step leads above this.
    AtMost(NonNegative),
}

impl Bound {
    /// The limit, if there is one.
    #[must_use]
    pub fn limit(self) -> Option<f64> {
        match self {
            Self::Watched => None,
            Self::AtMost(limit) => Some(limit.get()),
        }
    }
}

impl Serialize for Bound {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Watched => serializer.serialize_bool(true),
            Self::AtMost(limit) => limit.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Bound {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Seen;

        impl Visitor<'_> for Seen {
            type Value = Bound;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("true, to be watched, or a number from 0, the limit")
            }

            fn visit_bool<E: Error>(self, watched: bool) -> Result<Bound, E> {
                let wrong = || E::invalid_value(Unexpected::Bool(false), &self);
                watched.then_some(Bound::Watched).ok_or_else(wrong)
            }

            fn visit_i64<E: Error>(self, limit: i64) -> Result<Bound, E> {
                #[allow(clippy::cast_precision_loss)]
                self.visit_f64(limit as f64)
            }

            fn visit_f64<E: Error>(self, limit: f64) -> Result<Bound, E> {
                let wrong = || E::invalid_value(Unexpected::Float(limit), &self);
                NonNegative::new(limit).map(Bound::AtMost).ok_or_else(wrong)
            }
        }

        deserializer.deserialize_any(Seen)
    }
}
