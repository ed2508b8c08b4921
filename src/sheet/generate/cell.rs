//! A rectangle that is periodic along x and y.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rumple_numerics::Vec3;

use super::density::edge_length;
use super::domain::{Domain, Frame, periodic};
use super::irregular::too_narrow;
use crate::SheetError;

/// Fewest edges across: a triangle must not meet its own image.
const FEWEST_ACROSS: usize = 8;

/// One period, around the origin.
pub(super) struct Cell {
    size: [f64; 2],
    frame: Frame,
}

impl Cell {
    pub(super) fn new(size: [f64; 2], vertices: usize) -> Result<Self, SheetError> {
        let edge = edge_length(size[0] * size[1], 0.0, 0.0, vertices);
        for (what, length) in ["the width", "the height"].into_iter().zip(size) {
            if length < rumple_numerics::num::real(FEWEST_ACROSS) * edge {
                return Err(too_narrow(what, length / edge, FEWEST_ACROSS, vertices));
            }
        }
        let half = Vec3::new(0.5 * size[0], 0.5 * size[1], 0.0);
        Ok(Self { size, frame: Frame::new(Vec::new(), edge, 0, [-half, half]) })
    }
}

impl Domain for Cell {
    fn frame(&self) -> &Frame {
        &self.frame
    }

    fn sample(&self, rng: &mut ChaCha8Rng) -> Option<Vec3> {
        let [x, y] = self.size.map(|length| length * (rng.random::<f64>() - 0.5));
        Some(Vec3::new(x, y, 0.0))
    }

    /// The copy across the nearest edge.
    fn image(&self, point: Vec3) -> Option<Vec3> {
        let room = |axis: usize| 0.5 * self.size[axis] - point[axis].abs();
        let axis = usize::from(room(1) < room(0));
        Some(point - Vec3::ith(axis, self.size[axis].copysign(point[axis])))
    }

    fn nearest(&self, mut point: Vec3, to: Vec3) -> Vec3 {
        for axis in [0, 1] {
            point[axis] += self.size[axis] * ((to[axis] - point[axis]) / self.size[axis]).round();
        }
        point
    }

    fn constrain(&self, point: Vec3) -> Vec3 {
        let mut inside = self.nearest(point, Vec3::zeros());
        inside.z = 0.0;
        inside
    }

    fn triangles(&self, points: &[Vec3]) -> Vec<[u32; 3]> {
        periodic(points, self.size, self.frame.edge)
    }

    fn period(&self) -> [f64; 2] {
        self.size
    }
}
