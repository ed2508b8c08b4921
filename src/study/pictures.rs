//! What contact sheets of pictures have in common.

use crate::output::picture::{Picture, ramp};
use crate::output::plot::label;

/// Width and height of one picture on a contact sheet, pixels.
pub(super) const TILE: usize = 300;
/// Height of a line of text.
pub(super) const LINE: usize = 24;
/// Room between things.
pub(super) const GAP: usize = 12;
/// Width of the key to the colours, and of the text before it.
const KEY: usize = 160;

/// The values between which colours go from dark to light.
pub(super) struct Scale {
    least: f64,
    most: f64,
}

impl Scale {
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Self {
        let nothing = Self { least: f64::INFINITY, most: f64::NEG_INFINITY };
        values.fold(nothing, |s, v| Self { least: s.least.min(v), most: s.most.max(v) })
    }

    /// Colours of `values` from 0 to 1; the middle for each of `count` where there are none, or all
    /// are the same.
    pub(super) fn of_values(&self, values: Option<&Vec<f64>>, count: usize) -> Vec<f64> {
        let span = self.most - self.least;
        match values {
            Some(values) if span > 0.0 => values.iter().map(|v| (v - self.least) / span).collect(),
            _ => vec![0.5; count],
        }
    }

    /// Draws a key to the colours of `name` at `top`.
    pub(super) fn draw(
        &self,
        name: &str,
        picture: &mut Picture,
        top: usize,
        texts: &mut Vec<(String, usize, usize)>,
    ) {
        let [least, most] = [self.least, self.most].map(label);
        if self.least < self.most {
            texts.push((format!("{name} = {least}"), GAP, top));
            picture.place(&ramp(KEY, LINE - GAP), KEY, top);
            texts.push((most, 2 * KEY + GAP, top));
        } else if self.least == self.most {
            texts.push((format!("{name} = {least} everywhere"), GAP, top));
        }
    }
}
