//! A flat polygon with holes.
//!
//! Points of an outline are vertices where it turns by more than [`SHARP_TURN`] or a side is at least an edge long; between
//! them, vertices are evenly spaced along the outline. Corners that are not sharp get a vertex inside, so that two
//! triangles meet there; sharper ones are cut off by a triangle.

use std::f64::consts::{PI, TAU};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::density::edge_length;
use super::domain::{Domain, Frame, delaunay};
use super::irregular::too_narrow;
use super::outline::Outline;
use super::planar::{BOUNDARY_MARGIN, CORNER_OFFSET};
use crate::SheetError;
use crate::quality::triangle_quality;
use rumple_numerics::Vec3;
use rumple_numerics::num::{Short, index, real, whole};

/// Turn of an outline (rad) beyond which a point of it is kept, however near the next one is.
const SHARP_TURN: f64 = 0.5;

/// Interior angles (rad) of corners with two triangles: below, one is of better quality; above, free vertices find their
/// place.
const TWO_TRIANGLES: [f64; 2] = [1.13, 2.2];

/// Sharpest corner (rad) that is meshed.
const SHARPEST: f64 = 0.26;

/// Shortest part of an outline between two kept points, in edges.
const SHORTEST: f64 = 0.4;

/// Quality of triangles without an area.
const SLIVER: f64 = 1e-6;

/// Moves of a point off the boundary: in a corner it is near two sides.
const CORRECTIONS: usize = 3;

/// The region with its fixed vertices.
pub(super) struct Polygon {
    outline: Outline,
    frame: Frame,
    /// Corners with one triangle, and how far from them triangles reach from side to side.
    sharp: Vec<(Vec3, f64)>,
    /// Least quality of the triangles at corners.
    quality: f64,
}

impl Polygon {
    pub(super) fn new(
        points: &[[f64; 2]],
        holes: &[Vec<[f64; 2]>],
        vertices: usize,
    ) -> Result<Self, SheetError> {
        let name = |k: usize| match k.checked_sub(1) {
            None => "points".to_owned(),
            Some(hole) => format!("holes[{hole}]"),
        };
        let given = std::iter::once(points).chain(holes.iter().map(Vec::as_slice));
        let rings = super::outline::rings(given, &name)?;
        let perimeter =
            rings.iter().flat_map(|ring| sides(ring)).map(|(a, b)| (b - a).norm()).sum();
        let area: f64 = rings.iter().map(|ring| super::outline::area(ring)).sum();
        let edge = edge_length(area, perimeter, 2.0 - 2.0 * real(holes.len()), vertices);
        let mut polygon = Self {
            outline: Outline::default(),
            frame: Frame::new(
                Vec::new(),
                edge,
                1 - i64::from(index(holes.len())),
                [Vec3::zeros(); 2],
            ),
            sharp: Vec::new(),
            quality: super::domain::MIN_QUALITY,
        };
        let (mut segments, mut inner) = (Vec::new(), Vec::new());
        for ring in &rings {
            let first = polygon.frame.fixed.len();
            inner.extend(polygon.add_ring(ring, vertices)?);
            segments.extend(sides(&polygon.frame.fixed[first..]).map(|(a, b)| [a, b]));
        }
        polygon.frame.boundary = polygon.frame.fixed.len();
        polygon.frame.fixed.extend(inner);
        polygon.outline = Outline::new(segments, BOUNDARY_MARGIN * edge, vertices);
        polygon.frame.bounds = polygon.outline.bounds();
        Ok(polygon)
    }

    /// Adds the vertices on a ring; returns those inside its corners.
    fn add_ring(&mut self, ring: &[Vec3], vertices: usize) -> Result<Vec<Vec3>, SheetError> {
        let n = ring.len();
        let mut inner = Vec::new();
        let (mut kept, mut since) = (Vec::new(), f64::INFINITY);
        for k in 0..n {
            let (here, next, before) = (ring[k], ring[(k + 1) % n], ring[(k + n - 1) % n]);
            let (out, back) = (next - here, before - here);
            let angle = out.cross(&back).z.atan2(out.dot(&back)).rem_euclid(TAU);
            if angle.min(TAU - angle) < SHARPEST {
                return Err(SheetError::Unusable(format!(
                    "the corner at ({}, {}) is sharper than {:.0} degrees",
                    Short(here.x),
                    Short(here.y),
                    SHARPEST.to_degrees()
                )));
            }
            let long = out.norm().max(back.norm()) >= self.frame.edge;
            let far = since >= SHORTEST * self.frame.edge;
            if (PI - angle).abs() > SHARP_TURN || (long && far) {
                kept.push(k);
                since = 0.0;
            }
            since += out.norm();
            if angle < TWO_TRIANGLES[0] {
                let reach = self.frame.edge * (1.0 + 0.75 / (0.5 * angle).sin());
                self.sharp.push((here, reach));
                // Quality of a triangle of two equal sides with this angle between them.
                let quality = 3f64.sqrt() * angle.sin() / (2.0 - angle.cos());
                self.quality = self.quality.min(0.8 * quality);
            } else if angle < TWO_TRIANGLES[1] {
                let bisector = (out.normalize() + back.normalize()).normalize();
                let distance =
                    (CORNER_OFFSET / (0.5 * angle).cos()).min(2f64.sqrt() * CORNER_OFFSET);
                inner.push(here + bisector * (distance * self.frame.edge));
            }
        }
        if kept.is_empty() {
            kept.push(0);
        }
        for (k, &from) in kept.iter().enumerate() {
            let to = kept.get(k + 1).copied().unwrap_or(kept[0] + n);
            self.divide((from..=to).map(|i| ring[i % n]).collect(), vertices)?;
        }
        Ok(inner)
    }

    /// Adds evenly spaced vertices from the first point of a part of a ring to before its last.
    fn divide(&mut self, part: Vec<Vec3>, vertices: usize) -> Result<(), SheetError> {
        let lengths: Vec<f64> = part.windows(2).map(|ends| (ends[1] - ends[0]).norm()).collect();
        let length: f64 = lengths.iter().sum();
        let edges = length / self.frame.edge;
        if edges < SHORTEST {
            let at = format!("the side at ({}, {})", Short(part[0].x), Short(part[0].y));
            return Err(too_narrow(&at, edges, 1, vertices));
        }
        let count = whole(edges.round()).max(1);
        let (mut side, mut before) = (0, 0.0);
        for i in 0..count {
            let at = length * real(i) / real(count);
            while side + 1 < lengths.len() && before + lengths[side] <= at {
                before += lengths[side];
                side += 1;
            }
            let share = ((at - before) / lengths[side]).clamp(0.0, 1.0);
            self.frame.fixed.push(part[side] + (part[side + 1] - part[side]) * share);
        }
        Ok(())
    }
}

/// The sides of a closed ring.
fn sides(ring: &[Vec3]) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
    ring.iter().zip(ring.iter().cycle().skip(1)).map(|(a, b)| (*a, *b))
}

impl Domain for Polygon {
    fn frame(&self) -> &Frame {
        &self.frame
    }

    fn least_quality(&self) -> f64 {
        self.quality
    }

    fn may_span(&self, centroid: Vec3) -> bool {
        self.sharp.iter().any(|(corner, reach)| (centroid - corner).norm() < *reach)
    }

    fn sample(&self, rng: &mut ChaCha8Rng) -> Option<Vec3> {
        let [low, high] = self.frame.bounds;
        let size = high - low;
        let p = low + Vec3::new(size.x * rng.random::<f64>(), size.y * rng.random::<f64>(), 0.0);
        self.outline.corrected(p).is_none().then_some(p)
    }

    fn constrain(&self, point: Vec3) -> Vec3 {
        let step = |p: &Vec3| self.outline.corrected(*p);
        std::iter::successors(Some(point), step).take(CORRECTIONS + 1).last().unwrap_or(point)
    }

    fn triangles(&self, points: &[Vec3]) -> Vec<[u32; 3]> {
        let mut triangles = delaunay(points);
        // Only triangles of boundary vertices can lie outside; slivers between the vertices of a side are of round-off.
        triangles.retain(|t| {
            let corners = t.map(|v| points[v as usize]);
            t.iter().any(|&v| v as usize >= self.frame.boundary)
                || (triangle_quality(corners) > SLIVER
                    && self.outline.has(corners.iter().sum::<Vec3>() / 3.0))
        });
        triangles
    }
}
