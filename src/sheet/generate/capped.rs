//! The cylinder with flat caps: a tube and two discs, glued along the circles where they meet.
//!
//! All three have the same edge length, that of the whole closed surface, and so the same vertices on the two circles.

use std::f64::consts::TAU;

use rumple_numerics::Vec3;
use rumple_numerics::num::{index, real, whole};

use super::cylinder::Strip;
use super::density::{edge_length, vertex_count};
use super::irregular::{irregular, too_narrow};
use super::order;
use super::planar::disc_around;
use crate::{Sheet, SheetError};

/// Fewest edges across a cap.
const FEWEST_ACROSS: usize = 4;

/// Makes the cylinder around the z axis, from -height/2 to height/2, normals outward.
pub(super) fn capped(
    radius: f64,
    height: f64,
    vertices: usize,
    seed: u64,
) -> Result<Sheet, SheetError> {
    let (around, cap) = (TAU * radius, 0.5 * TAU * radius * radius);
    let edge = edge_length(around * height + 2.0 * cap, 0.0, 4.0, vertices);
    if 2.0 * radius < real(FEWEST_ACROSS) * edge {
        return Err(too_narrow("the diameter", 2.0 * radius / edge, FEWEST_ACROSS, vertices));
    }
    let tube = Strip::with_edge(radius, height, edge, vertices)?;
    let count = whole(around / edge);
    let on_cap = vertex_count(cap, around, 2.0, edge).max(count + 1);
    // The two circles belong to the tube and to a cap each.
    let on_tube = (vertices + 2 * count).saturating_sub(2 * on_cap);
    if on_tube < 2 * count + FEWEST_ACROSS * count / 2 {
        return Err(too_narrow("the tube", height / edge, FEWEST_ACROSS, vertices));
    }
    let tube = irregular(&tube, on_tube, seed)?;
    let mut points = tube.rest().to_vec();
    let mut triangles = tube.triangles().to_vec();
    // Circles begin at half a spacing on top, as those of the tube do.
    for (turn, z, upward) in [(0.0, -0.5 * height, false), (0.5, 0.5 * height, true)] {
        let place = |p: &Vec3| {
            whole((p.y.atan2(p.x) / TAU).rem_euclid(1.0) * real(count) - turn + real(count)) % count
        };
        let on_circle = |v: &usize| tube.boundary()[*v] && (tube.rest()[*v].z > 0.0) == upward;
        let mut circle = vec![0; count];
        for v in (0..tube.vertex_count()).filter(on_circle) {
            circle[place(&tube.rest()[v])] = index(v);
        }
        let disc = irregular(&disc_around(radius, count, turn, edge), on_cap, seed)?;
        let mut number = Vec::with_capacity(disc.vertex_count());
        for (v, p) in disc.rest().iter().enumerate() {
            if disc.boundary()[v] {
                number.push(circle[place(p)]);
            } else {
                number.push(index(points.len()));
                points.push(Vec3::new(p.x, p.y, z));
            }
        }
        triangles.extend(disc.triangles().iter().map(|t| {
            let [a, b, c] = t.map(|v| number[v as usize]);
            if upward { [a, b, c] } else { [a, c, b] }
        }));
    }
    let (points, triangles) = order::numbered(&points, &points, &triangles);
    Sheet::new(points, triangles)
}
