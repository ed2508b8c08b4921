//! How far two features may move along straight lines without touching.
//!
//! Conservative advancement: while the features are d apart and their points approach by at most l in a whole step,
//! the share (1 - ξ) d/l of the step is free; the sum of these shares never passes the first contact (Li, Kaufman &
//! Jiang, *Codimensional incremental potential contact*, ACM Trans. Graph. 40 (2021), doi:10.1145/3450626.3459767,
//! algorithm 1). The advance ends where features are as near as round-off can tell.

use rumple_numerics::Vec3;

use super::nearest::{Corners, edge_edge, point_triangle};

/// ξ.
const REMAINING_GAP_SHARE: f64 = 0.1;
/// Features touch that are nearer than this share of how far they are, or come, from the origin.
const ROUND_OFF: f64 = 8.0 * f64::EPSILON;
/// Advances after which the rest of a step is given up: the features slide past one another.
const MAX_ADVANCES: usize = 500;
/// Share of the distance at rest that bounds the reach of a pair.
pub(super) const MAX_REACH_SHARE: f64 = 0.5;

/// A pair of features.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum PairKind {
    /// A vertex and a triangle.
    PointTriangle,
    /// Two edges.
    EdgeEdge,
}

impl PairKind {
    /// The distance of the features.
    #[must_use]
    pub fn distance(self, x: &Corners) -> f64 {
        match self {
            Self::PointTriangle => point_triangle(x).0.distance(),
            Self::EdgeEdge => edge_edge(x).distance(),
        }
    }

    /// The largest speed at which points of the features approach, common motion left out.
    pub(super) fn approach(self, d: &Corners) -> f64 {
        let mean = (d[0] + d[1] + d[2] + d[3]) / 4.0;
        let speed = d.map(|d| (d - mean).norm());
        let of_first = if self == Self::PointTriangle { 1 } else { 2 };
        let largest = |of: &[f64]| of.iter().copied().fold(0.0, f64::max);
        largest(&speed[..of_first]) + largest(&speed[of_first..])
    }

    /// A share of the step `d` from `x`, up to 1, on which the features stay apart: the whole, or up to where they
    /// are nearer than `least`.
    #[must_use]
    pub fn free_share(self, x: &Corners, d: &Corners, least: f64) -> f64 {
        let speed = self.approach(d);
        let mut share = 0.0;
        for round in 0..MAX_ADVANCES {
            let at = std::array::from_fn(|k| x[k] + share * d[k]);
            let distance = self.distance(&at);
            if !(distance > 0.0) || (round > 0 && distance < least) {
                return share;
            }
            let next = share + (1.0 - REMAINING_GAP_SHARE) * distance / speed;
            if !(next < 1.0) {
                return 1.0;
            }
            let size = x.iter().zip(d).fold(0.0, |most, (x, d)| x.amax().max(d.amax()).max(most));
            if distance < ROUND_OFF * size {
                return share;
            }
            share = next;
        }
        share
    }
}

/// Positions of the corners `of`.
#[must_use]
#[inline]
pub fn corner_positions(x: &[Vec3], of: &[u32; 4]) -> Corners {
    of.map(|v| x[v as usize])
}

/// Which distances count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// The reach of vertices and triangles.
    pub points: f64,
    /// The reach of two edges.
    pub edges: f64,
    /// Factor on distances at rest, at most 1: how far the sheet is to shrink.
    pub shrinkage: f64,
}

impl Reach {
    /// The reach of features that are so far apart at rest.
    #[inline]
    #[must_use]
    pub fn limited_by_rest(&self, kind: PairKind, at_rest: f64) -> f64 {
        self.for_kind(kind).min(MAX_REACH_SHARE * self.shrinkage * at_rest)
    }

    /// The reach of features that are far apart at rest.
    pub(super) fn for_kind(&self, kind: PairKind) -> f64 {
        match kind {
            PairKind::PointTriangle => self.points,
            PairKind::EdgeEdge => self.edges,
        }
    }
}

/// Two features that are near one another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// What they are.
    pub kind: PairKind,
    /// Numbers of vertex and triangle, or of the edges.
    pub features: [u32; 2],
    /// Their vertices.
    pub corners: [u32; 4],
    /// The distance below which they count.
    pub reach: f64,
}
