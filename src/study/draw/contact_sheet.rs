//! Contact sheets: pictures of sheets, coloured on one scale and seen from one place, with words.

use std::ops::Range;

use crate::Vec3;
use crate::output::picture::{Picture, View, labelled, ramp, sheet};
use crate::output::plot::label;
use crate::run::Result;
use crate::study::extent;

/// Width and height of one picture on a contact sheet, pixels.
pub const TILE: usize = 300;
/// Height of a line of text.
pub const LINE: usize = 24;
/// Room between things.
pub const GAP: usize = 12;
/// Pictures in a row at most, where they need not be in one.
pub const ACROSS: usize = 5;
/// Width of the key to the colours, and of the text before it.
const KEY: usize = 160;

/// A sheet that is shown, with values at the vertices.
#[derive(Clone, Copy)]
pub struct Shape<'a> {
    pub x: &'a [Vec3],
    pub triangles: &'a [[u32; 3]],
    pub values: Option<&'a Vec<f64>>,
}

/// A contact sheet under construction.
pub struct ContactSheet {
    picture: Picture,
    texts: Vec<(String, usize, usize)>,
    view: View,
    /// The values between which colours go from dark to light.
    scale: (f64, f64),
    tile: usize,
    /// The rows of a tile that a shape reaches; the others are left out.
    rows: Range<usize>,
}

impl ContactSheet {
    /// A contact sheet for `shapes`, in tiles of so many pixels.
    pub fn new(shapes: &[Shape<'_>], tile: usize) -> Self {
        let view = View::of(shapes.iter().map(|s| s.x));
        let scale = extent(shapes.iter().filter_map(|s| s.values).flatten().copied());
        let rows = view.rows(tile);
        Self { picture: Picture::blank(0, 0), texts: Vec::new(), view, scale, tile, rows }
    }

    /// Height of a picture on it.
    pub fn height(&self) -> usize {
        self.rows.len()
    }

    /// Gives it a width and a height.
    pub fn resize(&mut self, width: usize, height: usize) {
        self.picture = Picture::blank(width, height);
    }

    pub fn write(&mut self, text: String, left: usize, top: usize) {
        self.texts.push((text, left, top));
    }

    pub fn fill(
        &mut self,
        (width, height): (usize, usize),
        colour: [u8; 3],
        left: usize,
        top: usize,
    ) {
        let mut filled = Picture::blank(width, height);
        filled.rgb_mut().chunks_mut(3).for_each(|pixel| pixel.copy_from_slice(&colour));
        self.picture.place(&filled, left, top);
    }

    /// Draws a sheet; in the middle colour where it has no values, or all are the same.
    pub fn draw(&mut self, shape: &Shape<'_>, left: usize, top: usize) {
        let (least, span) = (self.scale.0, self.scale.1 - self.scale.0);
        let colour = match shape.values {
            Some(values) if span > 0.0 => values.iter().map(|v| (v - least) / span).collect(),
            _ => vec![0.5; shape.x.len()],
        };
        let drawn = sheet(shape.x, shape.triangles, &colour, &self.view, self.tile);
        self.picture.place(&drawn.rows(self.rows.clone()), left, top);
    }

    /// The picture, with a key to the colours of `name` at `top`.
    pub fn finish(mut self, name: &str, top: usize) -> Result<Picture> {
        let (least, most) = self.scale;
        let [from, to] = [least, most].map(label);
        if least < most {
            self.write(format!("{name} = {from}"), GAP, top);
            self.picture.place(&ramp(KEY, LINE - GAP), KEY, top);
            self.write(to, 2 * KEY + GAP, top);
        } else if least == most {
            self.write(format!("{name} = {from} everywhere"), GAP, top);
        }
        labelled(&mut self.picture, &self.texts)?;
        Ok(self.picture)
    }
}
