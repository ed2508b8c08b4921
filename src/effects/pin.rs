//! Pins: vertices held where they start, in some or all directions.
//!
//! A held direction has no equation of motion: its gradient entry is zero and its place in the
//! Hessian a multiple of the identity.

use serde::{Deserialize, Serialize};

use super::{Effect, EffectContext, EffectError, EffectSpec, Region};

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

#[typetag::serde(name = "pin")]
impl EffectSpec for Pin {
    fn name(&self) -> String {
        "pin".into()
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let chosen = self.region.choose(context.sheet, "pin")?;
        let held = |inside: bool| if inside { self.axes.0 } else { [false; 3] };
        let pins = chosen.into_iter().map(held).collect();
        Ok(Effect::pins(pins))
    }
}

crate::register_kind!(dyn EffectSpec, "pin", Pin);
