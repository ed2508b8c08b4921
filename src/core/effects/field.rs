//! Parameters of effects that may differ from place to place: a number, or a formula of the rest position.
//!
//! ```text
//! curvature = 0.1                 everywhere
//! curvature = "0.1*x"             of x, y, z (rest position, length)
//! ```
//!
//! A field is read once, when the effect is bound to a sheet.

use std::fmt;

use serde::de::{Deserialize, Deserializer, Error, Visitor};
use serde::{Serialize, Serializer};

use super::EffectError;
use crate::kinetics::formula::FieldFormula;
use crate::num::checked::Finite;
use crate::sheet::Sheet;

/// A parameter as a scene gives it.
#[derive(Debug, Clone, PartialEq)]
pub enum Field {
    /// The same everywhere.
    Number(Finite),
    /// A formula of `x`, `y` and `z`.
    Formula(String),
}

impl Field {
    /// Its values at the rest positions of the vertices; `key` is to blame.
    ///
    /// # Errors
    /// A formula that cannot be read, or is no finite number at some vertex.
    pub fn at_rest(&self, sheet: &Sheet, key: &'static str) -> Result<Vec<f64>, EffectError> {
        let text = match self {
            Self::Number(value) => return Ok(vec![value.get(); sheet.vertex_count()]),
            Self::Formula(text) => text,
        };
        let formula = FieldFormula::new(text, false).map_err(|e| EffectError {
            key,
            message: e.message,
            help: e.help,
        })?;
        let values = formula.at(sheet.rest(), 0.0);
        match values.iter().position(|value| !value.is_finite()) {
            None => Ok(values),
            Some(i) => {
                let [x, y, z]: [f64; 3] = sheet.rest()[i].into();
                let message = format!("it is {} at vertex {i} ({x}, {y}, {z})", values[i]);
                let help = Some("it must be a finite number at the rest position of every vertex");
                Err(EffectError { key, message, help: help.map(Into::into) })
            }
        }
    }
}

impl Serialize for Field {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Number(value) => value.serialize(serializer),
            Self::Formula(text) => text.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Field {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Seen;

        impl Visitor<'_> for Seen {
            type Value = Field;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a finite number or a formula of x, y and z")
            }

            fn visit_i64<E: Error>(self, value: i64) -> Result<Field, E> {
                finite(value).map(Field::Number)
            }

            fn visit_f64<E: Error>(self, value: f64) -> Result<Field, E> {
                finite(value).map(Field::Number)
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Field, E> {
                Ok(Field::Formula(text.to_owned()))
            }
        }

        deserializer.deserialize_any(Seen)
    }
}

fn finite<'de, T: serde::de::IntoDeserializer<'de, E>, E: Error>(value: T) -> Result<Finite, E> {
    Finite::deserialize(value.into_deserializer())
}
