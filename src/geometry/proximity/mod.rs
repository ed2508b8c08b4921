//! What is near what on a shape: pairs of a vertex and a triangle, and of two edges, with their distances and
//! derivatives, and how far a shape may move before any of them touch.

mod advance;
mod ball;
mod clusters;
mod deformation;
mod list;
mod nearest;
mod neighbours;
mod pairs;
mod patches;
mod search;

pub use advance::{Pair, PairKind, Reach, corner_positions};
pub use nearest::{Corners, Nearest, edge_edge, point_edge, point_point, point_triangle};
pub use pairs::Proximity;
