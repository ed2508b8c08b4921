//! Small pictures of sheets, drawn without a graphics card: for a first look and for contact
//! sheets. ParaView shows more.

use std::ops::Range;

use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};

use super::OutputError;
use rumple_numerics::Vec3;
use rumple_numerics::num::{index, real, whole};

/// Colours of pixels, row by row from the top left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Picture {
    /// White.
    #[must_use]
    pub fn blank(width: usize, height: usize) -> Self {
        Self { width, height, rgb: vec![255; 3 * width * height] }
    }

    /// Width and height in pixels.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// The bytes of all pixels.
    pub fn rgb_mut(&mut self) -> &mut [u8] {
        &mut self.rgb
    }

    /// Lays `other` on this one, its upper left corner at `(left, top)`; what sticks out is cut off.
    pub fn place(&mut self, other: &Self, left: usize, top: usize) {
        for row in 0..other.height.min(self.height.saturating_sub(top)) {
            let count = 3 * other.width.min(self.width.saturating_sub(left));
            let to = 3 * ((top + row) * self.width + left);
            let from = 3 * row * other.width;
            self.rgb[to..to + count].copy_from_slice(&other.rgb[from..from + count]);
        }
    }

    /// Some of the rows of pixels.
    #[must_use]
    pub fn rows(&self, rows: Range<usize>) -> Self {
        let (start, end) = (rows.start.min(self.height), rows.end.min(self.height));
        let rgb = self.rgb.get(3 * self.width * start..3 * self.width * end);
        let rgb = rgb.unwrap_or_default().to_vec();
        Self { width: self.width, height: end.saturating_sub(start), rgb }
    }

    /// As a PNG file.
    ///
    /// # Errors
    /// If the picture is larger than the format allows.
    pub fn png(&self) -> Result<Vec<u8>, OutputError> {
        let mut bytes = Vec::new();
        let refused = |e: png::EncodingError| OutputError::Picture(e.to_string());
        let mut encoder = png::Encoder::new(&mut bytes, index(self.width), index(self.height));
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().map_err(refused)?;
        writer.write_image_data(&self.rgb).map_err(refused)?;
        writer.finish().map_err(refused)?;
        Ok(bytes)
    }
}

/// Where one looks from: an orthographic view of a ball in space.
#[derive(Debug, Clone, Copy)]
pub struct View {
    centre: Vec3,
    radius: f64,
    /// How far things reach up and down from the centre, of the radius.
    upwards: (f64, f64),
}

/// Up on the picture, to the right, and towards the eye: from the front, 50° above the plane.
const AXES: [Vec3; 3] = [
    Vec3::new(0.0, 0.766_044_443_118_978, 0.642_787_609_686_539_3),
    Vec3::new(1.0, 0.0, 0.0),
    Vec3::new(0.0, -0.642_787_609_686_539_3, 0.766_044_443_118_978),
];
/// Where the light comes from: to the right, down, and towards the eye.
const LIGHT_DIRECTION: Vec3 = Vec3::new(-0.5, -0.5, std::f64::consts::FRAC_1_SQRT_2);
/// The radius of what is seen, of the size of the picture.
const FILLED_RADIUS: f64 = 0.49;
/// Brightness of a face that turns away from the light.
const SHADED_BRIGHTNESS: f64 = 0.25;

impl View {
    /// Of everything in `shapes`.
    #[must_use]
    pub fn of<'a>(shapes: impl Iterator<Item = &'a [Vec3]> + Clone) -> Self {
        let all = || shapes.clone().flatten();
        let count = real(all().count().max(1));
        let centre = all().sum::<Vec3>() / count;
        let radius = all().map(|x| (x - centre).norm()).fold(f64::MIN_POSITIVE, f64::max);
        let up = |x: &Vec3| AXES[0].dot(&(x - centre)) / radius;
        let upwards = all().map(up).fold((0.0f64, 0.0f64), |(l, m), u| (l.min(u), m.max(u)));
        Self { centre, radius, upwards }
    }

    /// The rows of a picture `size` pixels high in which there is something.
    #[must_use]
    pub fn rows(&self, size: usize) -> Range<usize> {
        let row = |up: f64| whole((0.5 - FILLED_RADIUS * up) * real(size)).min(size);
        let (low, high) = self.upwards;
        row(high).saturating_sub(1)..(row(low) + 2).min(size)
    }

    /// Pixels to the right, pixels down, and height above the plane of the picture in pixels.
    fn project(&self, x: &Vec3, size: f64) -> Vec3 {
        let from_centre = (x - self.centre) * (FILLED_RADIUS * size / self.radius);
        let [up, right, near] = AXES.map(|axis| axis.dot(&from_centre));
        Vec3::new(0.5 * size + right, 0.5 * size - up, near)
    }
}

/// A sheet of `triangles` at `x`, `size` pixels wide and high; `colour` of every vertex between 0
/// and 1. Smooth shading: normals are averaged at the vertices, both sides look the same.
#[must_use]
pub fn sheet(
    x: &[Vec3],
    triangles: &[[u32; 3]],
    colour: &[f64],
    view: &View,
    size: usize,
) -> Picture {
    let mut picture = Picture::blank(size, size);
    let flat: Vec<Vec3> = x.iter().map(|x| view.project(x, real(size))).collect();
    if !flat.iter().all(|p| p.iter().all(|p| p.is_finite())) {
        return picture;
    }
    let bright = brightness(&flat, triangles);
    let mut depth = vec![f64::NEG_INFINITY; size * size];
    for t in triangles {
        let corners = t.map(|v| flat[v as usize]);
        let [a, b, c] = corners;
        let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        if area == 0.0 {
            continue;
        }
        let span = |axis: usize| span(corners.map(|p| p[axis]), size);
        for row in span(1) {
            for column in span(0) {
                let (px, py) = (real(column), real(row));
                let weight =
                    |p: &Vec3, q: &Vec3| ((p.x - px) * (q.y - py) - (p.y - py) * (q.x - px)) / area;
                let by = [weight(&b, &c), weight(&c, &a), weight(&a, &b)];
                let place = row * size + column;
                if by.iter().any(|w| *w < -1e-9) || row >= size || column >= size {
                    continue;
                }
                let mix = |of: &dyn Fn(usize) -> f64| -> f64 {
                    (0..3).map(|k| by[k] * of(t[k] as usize)).sum()
                };
                let height = mix(&|v| flat[v].z);
                if height <= depth[place] {
                    continue;
                }
                depth[place] = height;
                let value = mix(&|v| colour[v]);
                let value = if value.is_finite() { value.clamp(0.0, 1.0) } else { 0.0 };
                let light = mix(&|v| bright[v]);
                let paint = ViridisRGB.get_color(value);
                for (k, channel) in [paint.0, paint.1, paint.2].into_iter().enumerate() {
                    picture.rgb[3 * place + k] = byte(f64::from(channel) * light);
                }
            }
        }
    }
    picture
}

/// Brightness of every vertex by the direction of its normal, the sum of those of its triangles.
fn brightness(flat: &[Vec3], triangles: &[[u32; 3]]) -> Vec<f64> {
    let mut normals = vec![Vec3::zeros(); flat.len()];
    for t in triangles {
        let [a, b, c] = t.map(|v| flat[v as usize]);
        for &v in t {
            normals[v as usize] += (b - a).cross(&(c - a));
        }
    }
    let of = |n: &Vec3| -> f64 {
        let n = n.try_normalize(0.0).unwrap_or(Vec3::z());
        let n = if n.z < 0.0 { -n } else { n };
        SHADED_BRIGHTNESS + (1.0 - SHADED_BRIGHTNESS) * n.dot(&LIGHT_DIRECTION).max(0.0)
    };
    normals.iter().map(of).collect()
}

/// The pixels of a picture of `size` pixels between the least and the largest of `values`.
fn span(values: [f64; 3], size: usize) -> Range<usize> {
    let least = values.iter().fold(f64::INFINITY, |l, v| l.min(*v)).max(0.0);
    let most = values.iter().fold(0.0f64, |m, v| m.max(*v)).min(real(size) - 1.0);
    whole(least.floor())..whole(most.ceil().max(0.0)) + 1
}

/// Colours from 0 on the left to 1 on the right.
#[must_use]
pub fn ramp(width: usize, height: usize) -> Picture {
    let mut picture = Picture::blank(width, height);
    for (at, pixel) in picture.rgb.chunks_mut(3).enumerate() {
        let paint = ViridisRGB.get_color(real(at % width) / real(width.max(2) - 1));
        pixel.copy_from_slice(&[paint.0, paint.1, paint.2]);
    }
    picture
}

fn byte(value: f64) -> u8 {
    u8::try_from(whole(value.clamp(0.0, 255.0).round())).unwrap_or(u8::MAX)
}

/// Writes texts into a picture, each with its place: from the left, from the top.
///
/// # Errors
/// If the font is not readable.
pub fn labelled(
    picture: &mut Picture,
    texts: &[(String, usize, usize)],
) -> Result<(), OutputError> {
    use plotters::prelude::*;
    super::plot::register()?;
    let refused = |e: &dyn std::fmt::Display| OutputError::Picture(e.to_string());
    let size = (index(picture.width), index(picture.height));
    let area = BitMapBackend::with_buffer(&mut picture.rgb, size).into_drawing_area();
    for (text, left, top) in texts {
        let place = (i32::try_from(*left).unwrap_or(0), i32::try_from(*top).unwrap_or(0));
        let text = Text::new(text.clone(), place, (super::plot::FONT, 16).into_font());
        area.draw(&text).map_err(|e| refused(&e))?;
    }
    area.present().map_err(|e| refused(&e))
}
