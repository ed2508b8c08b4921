//! Pins: vertices fixed where they start, or moved along a prescribed path, in some or all directions.
//!
//! A fixed direction has no equation of motion: its gradient entry is zero and its place in the
//! Hessian a multiple of the identity. With a `displacement` d the fixed components are those of
//!
//! ```text
//! x_i(t) = X_i + s(t) d        s the ramp, 1 without one
//! ```

use serde::{Deserialize, Serialize};

use super::ramp::RampFactor;
use super::{
    Effect, EffectContext, EffectError, EffectSpec, Needs, PrescribedDisplacement, Ramp, Region,
};
use crate::Vec3;
use crate::kinetics::breakpoints::TimeDependence;
use crate::num::checked::Finite;
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
    /// Where to, from the rest positions; without it they stay where they start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displacement: Option<[Finite; 3]>,
    /// The factor of the displacement in time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ramp: Option<Ramp>,
}

/// Directions, as a word made of the letters x, y and z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Axes(pub [bool; 3]);

impl TryFrom<String> for Axes {
    type Error = String;

    fn try_from(word: String) -> Result<Self, String> {
        let mut fixed = [false; 3];
        for letter in word.chars() {
            match "xyz".find(letter) {
                Some(axis) if !fixed[axis] => fixed[axis] = true,
                _ => {
                    return Err(format!(
                        "`{word}` is not made of the letters x, y and z, once each"
                    ));
                }
            }
        }
        if fixed == [false; 3] {
            return Err("no axis is named; write \"z\", \"xy\" or \"xyz\", for example".into());
        }
        Ok(Self(fixed))
    }
}

impl From<Axes> for String {
    fn from(axes: Axes) -> Self {
        "xyz".chars().zip(axes.0).filter(|(_, fixed)| *fixed).map(|(letter, _)| letter).collect()
    }
}

#[typetag::serialize(name = "pin")]
impl EffectSpec for Pin {
    fn needs(&self) -> Needs {
        Needs { out_of_plane: self.axes.0[2].then_some("axes"), ..Needs::default() }
    }

    fn time_dependence(&self, _: &Sheet, until: f64) -> TimeDependence {
        RampFactor::time_dependence_of(self.ramp.as_ref(), until)
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let chosen = self.region.choose(context.sheet, "pin")?;
        let fixed = |inside: bool| if inside { self.axes.0 } else { [false; 3] };
        let pins = chosen.iter().map(|chosen| fixed(*chosen)).collect();
        let mut effect = Effect::pins(pins);
        let along = |by: &[Finite; 3]| (0..3).find(|&a| !self.axes.0[a] && by[a].get() != 0.0);
        if let Some(axis) = self.displacement.as_ref().and_then(along) {
            let axis = ["x", "y", "z"][axis];
            return Err(EffectError {
                key: "displacement",
                message: format!("this pin displaces along {axis}, and leaves {axis} free"),
                help: Some(format!("add {axis} to axes, or set that component to 0")),
            });
        }
        match self.displacement {
            Some(by) => effect.prescribed.push(PrescribedDisplacement {
                vertices: (0..chosen.len()).filter(|&i| chosen[i]).collect(),
                axes: self.axes.0,
                displacement: Vec3::from(by.map(Finite::get)),
                factor: RampFactor::new(self.ramp.as_ref())?,
            }),
            None if self.ramp.is_some() => {
                return Err(EffectError {
                    key: "ramp",
                    message: "a ramp multiplies a displacement, and this pin has none".into(),
                    help: Some("add displacement = [x, y, z]".into()),
                });
            }
            None => {}
        }
        Ok(effect)
    }
}

crate::register_kind!(dyn EffectSpec, "pin", Pin);
