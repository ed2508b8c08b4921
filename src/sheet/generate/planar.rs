//! Flat outlines: disc, rectangle and annulus.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rumple_numerics::Vec3;
use rumple_numerics::num::{real, whole};

use super::density::edge_length;
use super::domain::{Domain, Frame, delaunay};
use super::irregular::too_narrow;
use crate::SheetError;

/// Least distance of free vertices from the boundary in edge lengths.
///
/// Half an edge keeps them out of the circles around boundary edges, so these stay Delaunay; balance
/// puts the first row at 0.87.
pub(super) const BOUNDARY_MARGIN: f64 = 0.5;

/// Fewest edges across the narrowest place: below, triangles would span from boundary to boundary.
pub(super) const FEWEST_ACROSS: usize = 4;

/// Fewest edges around a hole.
const FEWEST_AROUND: usize = 6;

/// Where the vertex inside a rectangle's corner sits, in edges along both sides.
///
/// It keeps the corner's two edges from closing a triangle of three boundary vertices; the two triangles
/// at the corner have quality 0.92 with it.
pub(super) const CORNER_OFFSET: f64 = 0.85;

/// A flat region with its fixed vertices.
pub(super) struct Planar {
    outline: Outline,
    frame: Frame,
    /// The last `hole` vertices of the boundary go around the hole.
    hole: usize,
}

enum Outline {
    Ring { inner: f64, outer: f64 },
    Rectangle { half: [f64; 2] },
}

/// Evenly spaced points on a circle, the first at angle `turn` spacings.
fn circle(radius: f64, count: usize, turn: f64) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |i| {
        let angle = TAU * (real(i) + turn) / real(count);
        Vec3::new(radius * angle.cos(), radius * angle.sin(), 0.0)
    })
}

/// A disc around the origin.
pub(super) fn disc(radius: f64, vertices: usize) -> Result<Planar, SheetError> {
    let edge = edge_length(TAU / 2.0 * radius * radius, TAU * radius, 2.0, vertices);
    if 2.0 * radius < real(FEWEST_ACROSS) * edge {
        return Err(too_narrow("the diameter", 2.0 * radius / edge, FEWEST_ACROSS, vertices));
    }
    Ok(disc_around(radius, whole(TAU * radius / edge), 0.0, edge))
}

/// A disc with `boundary` vertices on its boundary, the first at angle `turn` spacings, and edges of this length.
pub(super) fn disc_around(radius: f64, boundary: usize, turn: f64, edge: f64) -> Planar {
    let fixed = circle(radius, boundary, turn).collect();
    let outline = Outline::Ring { inner: 0.0, outer: radius };
    let bounds = [Vec3::new(-radius, -radius, 0.0), Vec3::new(radius, radius, 0.0)];
    Planar { outline, frame: Frame::new(fixed, edge, 1, bounds), hole: 0 }
}

/// A ring around the origin.
pub(super) fn annulus(inner: f64, outer: f64, vertices: usize) -> Result<Planar, SheetError> {
    if inner >= outer {
        return Err(SheetError::Unusable(format!(
            "inner = {inner} of the annulus must be smaller than outer = {outer}"
        )));
    }
    let area = TAU / 2.0 * (outer - inner) * (outer + inner);
    let edge = edge_length(area, TAU * (inner + outer), 0.0, vertices);
    if outer - inner < real(FEWEST_ACROSS) * edge {
        return Err(too_narrow("the width", (outer - inner) / edge, FEWEST_ACROSS, vertices));
    }
    let hole = whole(TAU * inner / edge);
    if hole < FEWEST_AROUND {
        return Err(too_narrow("the inner boundary", TAU * inner / edge, FEWEST_AROUND, vertices));
    }
    let around = whole(TAU * outer / edge);
    let fixed = circle(outer, around, 0.0).chain(circle(inner, hole, 0.5)).collect();
    let bounds = [Vec3::new(-outer, -outer, 0.0), Vec3::new(outer, outer, 0.0)];
    let outline = Outline::Ring { inner, outer };
    Ok(Planar { outline, frame: Frame::new(fixed, edge, 0, bounds), hole })
}

/// A rectangle around the origin.
pub(super) fn rectangle(width: f64, height: f64, vertices: usize) -> Result<Planar, SheetError> {
    let edge = edge_length(width * height, 2.0 * (width + height), 2.0, vertices);
    let narrow = width.min(height);
    if narrow < real(FEWEST_ACROSS) * edge {
        return Err(too_narrow("the shorter side", narrow / edge, FEWEST_ACROSS, vertices));
    }
    let [a, b] = [0.5 * width, 0.5 * height];
    let [m, n] = [width, height].map(|side| whole(side / edge));
    // Symmetric about the middle, and exactly ±half at the ends.
    let along =
        |i: usize, count: usize, half: f64| half * (2.0 * real(i) - real(count)) / real(count);
    let mut fixed = Vec::with_capacity(2 * (m + n) + 4);
    fixed.extend((0..m).map(|i| Vec3::new(along(i, m, a), -b, 0.0)));
    fixed.extend((0..n).map(|i| Vec3::new(a, along(i, n, b), 0.0)));
    fixed.extend((0..m).map(|i| Vec3::new(-along(i, m, a), b, 0.0)));
    fixed.extend((0..n).map(|i| Vec3::new(-a, -along(i, n, b), 0.0)));
    let boundary = fixed.len();
    let [x, y] = [a - CORNER_OFFSET * width / real(m), b - CORNER_OFFSET * height / real(n)];
    fixed.extend([(-x, -y), (x, -y), (x, y), (-x, y)].map(|(x, y)| Vec3::new(x, y, 0.0)));
    let bounds = [Vec3::new(-a, -b, 0.0), Vec3::new(a, b, 0.0)];
    let frame = Frame { boundary, ..Frame::new(fixed, edge, 1, bounds) };
    Ok(Planar { outline: Outline::Rectangle { half: [a, b] }, frame, hole: 0 })
}

impl Domain for Planar {
    fn frame(&self) -> &Frame {
        &self.frame
    }

    fn sample(&self, rng: &mut ChaCha8Rng) -> Option<Vec3> {
        let [low, high] = self.frame.bounds;
        let x = low.x + (high.x - low.x) * rng.random::<f64>();
        let y = low.y + (high.y - low.y) * rng.random::<f64>();
        let p = Vec3::new(x, y, 0.0);
        (self.constrain(p) == p).then_some(p)
    }

    fn constrain(&self, point: Vec3) -> Vec3 {
        let margin = BOUNDARY_MARGIN * self.frame.edge;
        match self.outline {
            Outline::Ring { inner, outer } => {
                let radius = point.norm();
                let [least, most] =
                    [if inner > 0.0 { inner + margin } else { 0.0 }, outer - margin];
                if radius > most {
                    point * (most / radius)
                } else if radius < least {
                    point * (least / radius.max(f64::MIN_POSITIVE))
                } else {
                    point
                }
            }
            Outline::Rectangle { half: [a, b] } => {
                let [a, b] = [a - margin, b - margin];
                Vec3::new(point.x.clamp(-a, a), point.y.clamp(-b, b), 0.0)
            }
        }
    }

    fn triangles(&self, points: &[Vec3]) -> Vec<[u32; 3]> {
        let mut triangles = delaunay(points);
        // Three vertices of a convex hole span no material.
        let hole = self.frame.boundary - self.hole..self.frame.boundary;
        triangles.retain(|t| !t.iter().all(|&v| hole.contains(&(v as usize))));
        triangles
    }
}
