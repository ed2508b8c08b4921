//! Pins: vertices held where they start, in some or all directions.
//!
//! A held direction has no equation of motion: its gradient entry is zero and its place in the
//! Hessian a multiple of the identity.

use serde::{Deserialize, Serialize};

use super::{Effect, EffectContext, EffectError, EffectSpec};
use crate::sheet::Sheet;

/// Parameters of a pin in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pin {
    /// Which vertices.
    #[serde(rename = "where")]
    pub region: Region,
    /// In which directions.
    pub axes: Axes,
}

/// A set of vertices, by their rest positions or numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Region {
    /// All vertices on the rim.
    Rim,
    /// All vertices.
    All,
    /// Vertices inside a box, its faces included.
    #[serde(rename = "box")]
    Cuboid {
        /// Least coordinates.
        min: [f64; 3],
        /// Greatest coordinates.
        max: [f64; 3],
    },
    /// Vertices no further than `radius` from `centre`.
    Ball {
        /// Centre.
        centre: [f64; 3],
        /// Radius.
        radius: f64,
    },
    /// Vertices by number, from 0.
    Vertices(Vec<u32>),
}

/// Directions, as a word made of the letters x, y and z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Axes(pub [bool; 3]);

impl TryFrom<String> for Axes {
    type Error = String;

    fn try_from(word: String) -> Result<Self, String> {
        let mut held = [false; 3];
        for letter in word.chars() {
            match "xyz".find(letter) {
                Some(axis) if !held[axis] => held[axis] = true,
                _ => {
                    return Err(format!(
                        "`{word}` is not made of the letters x, y and z, once each"
                    ));
                }
            }
        }
        if held == [false; 3] {
            return Err("no axis is named; write \"z\", \"xy\" or \"xyz\", for example".into());
        }
        Ok(Self(held))
    }
}

impl From<Axes> for String {
    fn from(axes: Axes) -> Self {
        "xyz".chars().zip(axes.0).filter(|(_, held)| *held).map(|(letter, _)| letter).collect()
    }
}

impl Region {
    /// The vertices of `sheet` that belong to it.
    #[must_use]
    pub fn vertices(&self, sheet: &Sheet) -> Vec<usize> {
        let chosen = |i: usize| {
            let x = sheet.rest()[i];
            match self {
                Self::Rim => sheet.rim()[i],
                Self::All => true,
                Self::Cuboid { min, max } => (0..3).all(|a| x[a] >= min[a] && x[a] <= max[a]),
                Self::Ball { centre, radius } => (x - crate::Vec3::from(*centre)).norm() <= *radius,
                Self::Vertices(list) => list.contains(&crate::num::index(i)),
            }
        };
        (0..sheet.vertex_count()).filter(|&i| chosen(i)).collect()
    }
}

#[typetag::serde(name = "pin")]
impl EffectSpec for Pin {
    fn name(&self) -> String {
        "pin".into()
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let chosen = self.region.vertices(context.sheet);
        let refuse = |message: String, help: &str| {
            Err(EffectError { key: "where", message, help: Some(help.into()) })
        };
        if let Region::Vertices(list) = &self.region
            && let Some(v) = list.iter().find(|v| **v as usize >= context.sheet.vertex_count())
        {
            let n = context.sheet.vertex_count();
            return refuse(
                format!("there is no vertex {v}: the sheet has {n}"),
                "vertices are numbered from 0",
            );
        }
        if chosen.is_empty() {
            return refuse(
                "no vertex is chosen by this pin".into(),
                "a closed surface has no rim; regions refer to rest positions",
            );
        }
        let mut pins = vec![[false; 3]; context.sheet.vertex_count()];
        for i in chosen {
            pins[i] = self.axes.0;
        }
        Ok(Effect::Pins(pins))
    }
}

crate::register_kind!(dyn EffectSpec, "pin", Pin);
