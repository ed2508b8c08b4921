//! Strips that are periodic along x: relaxed flat, and rolled up to an open cylinder or left so.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rumple_numerics::Vec3;
use rumple_numerics::num::{real, whole};

use super::density::edge_length;
use super::domain::{Domain, Frame, periodic};
use super::irregular::too_narrow;
use crate::SheetError;

/// Fewest edges around: a rolled triangle must stay nearly flat, and a strip must not meet itself.
const FEWEST_AROUND: usize = 8;

/// Fewest edges along the axis.
const FEWEST_ACROSS: usize = 4;

/// Least distance of free vertices from the boundary in edge lengths, as for flat outlines.
const BOUNDARY_MARGIN: f64 = 0.5;

/// The unrolled cylinder, or the flat strip: x in [0, 2πR), y in [-height/2, height/2].
pub(super) struct Strip {
    /// Of the cylinder; none of a strip that stays flat.
    radius: Option<f64>,
    around: f64,
    half: f64,
    frame: Frame,
}

impl Strip {
    pub(super) fn new(radius: f64, height: f64, vertices: usize) -> Result<Self, SheetError> {
        let around = TAU * radius;
        let edge = edge_length(around * height, 2.0 * around, 0.0, vertices);
        Self::with_edge(radius, height, edge, vertices)
    }

    /// A strip that stays flat.
    pub(super) fn flat(width: f64, height: f64, vertices: usize) -> Result<Self, SheetError> {
        let edge = edge_length(width * height, 2.0 * width, 0.0, vertices);
        Self::with_sizes(None, [width, height], edge, vertices)
    }

    /// The same with edges of this length; `vertices` is for messages.
    pub(super) fn with_edge(
        radius: f64,
        height: f64,
        edge: f64,
        vertices: usize,
    ) -> Result<Self, SheetError> {
        Self::with_sizes(Some(radius), [TAU * radius, height], edge, vertices)
    }

    fn with_sizes(
        radius: Option<f64>,
        [around, height]: [f64; 2],
        edge: f64,
        vertices: usize,
    ) -> Result<Self, SheetError> {
        let half = 0.5 * height;
        let count = whole(around / edge);
        if count < FEWEST_AROUND {
            let what = if radius.is_some() { "the circumference" } else { "the width" };
            return Err(too_narrow(what, around / edge, FEWEST_AROUND, vertices));
        }
        if height < real(FEWEST_ACROSS) * edge {
            return Err(too_narrow("the height", height / edge, FEWEST_ACROSS, vertices));
        }
        let boundary = |turn: f64, y: f64| {
            (0..count).map(move |i| Vec3::new(around * (real(i) + turn) / real(count), y, 0.0))
        };
        let fixed = boundary(0.0, -half).chain(boundary(0.5, half)).collect();
        let bounds = [Vec3::new(0.0, -half, 0.0), Vec3::new(around, half, 0.0)];
        Ok(Self { radius, around, half, frame: Frame::new(fixed, edge, 0, bounds) })
    }
}

impl Domain for Strip {
    fn frame(&self) -> &Frame {
        &self.frame
    }

    fn sample(&self, rng: &mut ChaCha8Rng) -> Option<Vec3> {
        let reach = self.half - BOUNDARY_MARGIN * self.frame.edge;
        let y = reach * (2.0 * rng.random::<f64>() - 1.0);
        Some(Vec3::new(self.around * rng.random::<f64>(), y, 0.0))
    }

    fn image(&self, point: Vec3) -> Option<Vec3> {
        let shift = if point.x < 0.5 * self.around { self.around } else { -self.around };
        Some(point + Vec3::x() * shift)
    }

    fn nearest(&self, point: Vec3, to: Vec3) -> Vec3 {
        let turns = ((to.x - point.x) / self.around).round();
        Vec3::new(point.x + turns * self.around, point.y, 0.0)
    }

    fn constrain(&self, point: Vec3) -> Vec3 {
        let reach = self.half - BOUNDARY_MARGIN * self.frame.edge;
        let mut x = point.x.rem_euclid(self.around);
        if x >= self.around {
            x = 0.0;
        }
        Vec3::new(x, point.y.clamp(-reach, reach), 0.0)
    }

    fn triangles(&self, points: &[Vec3]) -> Vec<[u32; 3]> {
        periodic(points, [self.around, f64::INFINITY], self.frame.edge)
    }

    fn place(&self, point: Vec3) -> Vec3 {
        let Some(radius) = self.radius else { return point - Vec3::x() * (0.5 * self.around) };
        let angle = point.x / radius;
        Vec3::new(radius * angle.cos(), radius * angle.sin(), point.y)
    }

    fn period(&self) -> [f64; 2] {
        [if self.radius.is_none() { self.around } else { f64::INFINITY }, f64::INFINITY]
    }
}
