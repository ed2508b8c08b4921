//! `material.drag`: what resists the motion of the sheet.
//!
//! ```toml
//! drag = 100.0                                               # of every vertex, as in the paper
//! drag = { per-vertex = 100.0 }                              # the same
//! drag = { per-area = 64.0 }                                 # of a unit of rest area: the same on every mesh
//! drag = { per-area = { normal = 64.0, tangential = 6.4 } }  # along the normal and in the sheet
//! drag = { per-area = "64*(1 + 0.1*x)" }                     # a field at the vertices
//! ```

use std::fmt;
use std::path::{Path, PathBuf};

use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, IntoDeserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};

use super::Drag;
use crate::effects::{EffectError, Field, FieldValues, ReadSurface, RegionValue};
use crate::kinetics::Location;
use crate::num::checked::Positive;
use crate::sheet::Sheet;

/// What resists the motion of the sheet.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DragSpec {
    /// Of every vertex, force per velocity.
    PerVertex(Coefficient),
    /// Of a unit of rest area, force per velocity and area.
    PerArea(Coefficient),
}

/// A coefficient of drag.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Coefficient {
    /// The same in all directions.
    Isotropic(Field<Positive>),
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
        Self::PerVertex(Coefficient::Isotropic(Field::Number(Positive::ONE)))
    }
}

impl DragSpec {
    /// The drag of every vertex of `sheet`.
    ///
    /// # Errors
    /// Those of [`Field::on`].
    pub fn on(&self, sheet: &Sheet, read: Option<&ReadSurface<'_>>) -> Result<Drag, EffectError> {
        let (Self::PerVertex(coefficient) | Self::PerArea(coefficient)) = self;
        let (tangential, ratio) = match coefficient {
            Coefficient::Isotropic(all) => (all.on(Location::Vertex, sheet, read, "drag")?, 1.0),
            Coefficient::Anisotropic(Directions { normal, tangential }) => {
                (FieldValues::Same(tangential.get()), normal.get() / tangential.get())
            }
        };
        let drag = match self {
            Self::PerVertex(_) => Drag::per_vertex(tangential),
            Self::PerArea(_) => Drag::per_area(tangential, sheet),
        };
        Ok(drag.with_ratio(ratio))
    }

    /// The field, if it is the same in all directions.
    fn field(&self) -> Option<&Field<Positive>> {
        let (Self::PerVertex(coefficient) | Self::PerArea(coefficient)) = self;
        match coefficient {
            Coefficient::Isotropic(field) => Some(field),
            Coefficient::Anisotropic(_) => None,
        }
    }

    /// The file that it is read from.
    #[must_use]
    pub fn file(&self) -> Option<&Path> {
        self.field().and_then(Field::file)
    }

    /// Makes the path of its file absolute: it counts from `folder`.
    pub fn resolve_path_against(&mut self, folder: &Path) {
        let (Self::PerVertex(coefficient) | Self::PerArea(coefficient)) = self;
        if let Coefficient::Isotropic(field) = coefficient {
            field.resolve_path_against(folder);
        }
    }
}

/// What a table of drag has, one of both.
#[derive(Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
struct Table {
    per_vertex: Option<Coefficient>,
    per_area: Option<Coefficient>,
}

/// What a table of a coefficient has: both directions, or what a field has.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    normal: Option<Positive>,
    tangential: Option<Positive>,
    file: Option<PathBuf>,
    array: Option<String>,
    default: Option<Positive>,
    regions: Option<Vec<RegionValue<Positive>>>,
}

impl<'de> Deserialize<'de> for DragSpec {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Seen;

        impl<'de> Visitor<'de> for Seen {
            type Value = DragSpec;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number above 0, a formula, { per-vertex = … } or { per-area = … }")
            }

            fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<DragSpec, E> {
                isotropic(value).map(DragSpec::PerVertex)
            }

            fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<DragSpec, E> {
                isotropic(value).map(DragSpec::PerVertex)
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<DragSpec, E> {
                let field = Field::Formula(text.to_owned());
                Ok(DragSpec::PerVertex(Coefficient::Isotropic(field)))
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
                f.write_str("a number above 0, a field, or { normal = …, tangential = … }")
            }

            fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<Coefficient, E> {
                isotropic(value)
            }

            fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<Coefficient, E> {
                isotropic(value)
            }

            fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Coefficient, E> {
                Ok(Coefficient::Isotropic(Field::Formula(text.to_owned())))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Coefficient, A::Error> {
                let keys = Keys::deserialize(MapAccessDeserializer::new(map))?;
                let missing = serde::de::Error::missing_field;
                match (keys.normal, keys.tangential) {
                    (Some(normal), Some(tangential)) => {
                        Ok(Coefficient::Anisotropic(Directions { normal, tangential }))
                    }
                    (Some(_), None) => Err(missing("tangential")),
                    (None, Some(_)) => Err(missing("normal")),
                    (None, None) => {
                        let by_region = (keys.default, keys.regions);
                        Field::of_keys((keys.file, keys.array), by_region)
                            .map(Coefficient::Isotropic)
                    }
                }
            }
        }

        deserializer.deserialize_any(Seen)
    }
}

fn isotropic<'de, E: serde::de::Error>(
    value: impl IntoDeserializer<'de, E>,
) -> Result<Coefficient, E> {
    let number = Positive::deserialize(value.into_deserializer())?;
    Ok(Coefficient::Isotropic(Field::Number(number)))
}
