//! `material.drag`: what resists the motion of the sheet.
//!
//! ```toml
//! drag = 100.0                                               # of every vertex, as in the paper
//! drag = { per-vertex = 100.0 }                              # the same
//! drag = { per-area = 64.0 }                                 # of a unit of rest area: the same on every mesh
//! drag = { per-area = { normal = 64.0, tangential = 6.4 } }  # along the normal and in the sheet
//! ```

use std::fmt;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, IntoDeserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};

use super::{Drag, Mechanics};
use crate::num::checked::Positive;

/// What resists the motion of the sheet.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DragSpec {
    /// Of every vertex, force per velocity.
    PerVertex(Coefficient),
    /// Of a unit of rest area, force per velocity and area.
    PerArea(Coefficient),
}

/// A coefficient of drag.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Coefficient {
    /// The same in all directions.
    Isotropic(Positive),
    /// Different along the normal of the sheet.
    Anisotropic(Directions),
}

/// Coefficients by direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Directions {
    /// Along the normal.
    pub normal: Positive,
    /// In the plane of the sheet.
    pub tangential: Positive,
}

impl Default for DragSpec {
    /// 1 per vertex.
    fn default() -> Self {
        Self::PerVertex(Coefficient::Isotropic(Positive::ONE))
    }
}

impl DragSpec {
    /// The drag of every vertex.
    #[must_use]
    pub fn on(&self, mechanics: &Mechanics) -> Drag {
        let (Self::PerVertex(coefficient) | Self::PerArea(coefficient)) = self;
        let (tangential, ratio) = match coefficient {
            Coefficient::Isotropic(all) => (all.get(), 1.0),
            Coefficient::Anisotropic(Directions { normal, tangential }) => {
                (tangential.get(), normal.get() / tangential.get())
            }
        };
        let drag = match self {
            Self::PerVertex(_) => Drag::per_vertex(tangential),
            Self::PerArea(_) => Drag::per_area(tangential, mechanics.sheet()),
        };
        drag.with_ratio(ratio)
    }
}

/// What a table of drag has, one of both.
#[derive(Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct Table {
    per_vertex: Option<Coefficient>,
    per_area: Option<Coefficient>,
}

impl<'de> Deserialize<'de> for DragSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Seen;

        impl<'de> Visitor<'de> for Seen {
            type Value = DragSpec;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number above 0, { per-vertex = … } or { per-area = … }")
            }

            fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<DragSpec, E> {
                isotropic(value).map(DragSpec::PerVertex)
            }

            fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<DragSpec, E> {
                isotropic(value).map(DragSpec::PerVertex)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<DragSpec, A::Error> {
                let table = Table::deserialize(MapAccessDeserializer::new(map))?;
                match (table.per_vertex, table.per_area) {
                    (Some(coefficient), None) => Ok(DragSpec::PerVertex(coefficient)),
                    (None, Some(coefficient)) => Ok(DragSpec::PerArea(coefficient)),
                    _ => Err(serde::de::Error::custom(
                        "a drag has one of the keys `per-vertex` and `per-area`",
                    )),
                }
            }
        }

        deserializer.deserialize_any(Seen)
    }
}

impl<'de> Deserialize<'de> for Coefficient {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Seen;

        impl<'de> Visitor<'de> for Seen {
            type Value = Coefficient;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number above 0, or { normal = …, tangential = … }")
            }

            fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<Coefficient, E> {
                isotropic(value)
            }

            fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<Coefficient, E> {
                isotropic(value)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Coefficient, A::Error> {
                let directions = Directions::deserialize(MapAccessDeserializer::new(map))?;
                Ok(Coefficient::Anisotropic(directions))
            }
        }

        deserializer.deserialize_any(Seen)
    }
}

fn isotropic<'de, E: serde::de::Error>(
    value: impl IntoDeserializer<'de, E>,
) -> Result<Coefficient, E> {
    Positive::deserialize(value.into_deserializer()).map(Coefficient::Isotropic)
}
