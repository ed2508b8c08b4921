//! Directions to hold so that a sheet in equilibrium has no rigid motions left.
//!
//! Forces do not change under the rigid motions that pins allow, so without storage their rows say
//! nothing about them: as many directions as there are such motions are held where they are. Which
//! ones does not matter to the shape; those are taken that the motions move most.

use nalgebra::{Matrix6, SymmetricEigen, Vector6};

use crate::Vec3;
use crate::num::real;
use crate::system::Pins;

/// Mean square of a motion at held directions, relative to its own, that counts as 0.
const HELD: f64 = 1e-12;

/// The (vertex, axis) pairs to hold besides `pins`.
pub(super) fn directions(x: &[Vec3], pins: &Pins) -> Vec<(usize, usize)> {
    let count = real(x.len().max(1));
    let centre: Vec3 = x.iter().sum::<Vec3>() / count;
    let square: f64 = x.iter().map(|x| (x - centre).norm_squared()).sum();
    let radius = (square / count).sqrt();
    // Displacement of a direction by translations and by rotations times the radius.
    let row = |i: usize, axis: usize| {
        let mut unit = Vec3::zeros();
        unit[axis] = 1.0;
        // (ω × r)·e = ω·(r × e)
        let turn = (x[i] - centre).cross(&unit) / radius;
        Vector6::new(unit.x, unit.y, unit.z, turn.x, turn.y, turn.z)
    };
    let mut held = Matrix6::zeros();
    for (i, pins) in pins.iter().enumerate() {
        for axis in (0..3).filter(|axis| pins[*axis]) {
            let row = row(i, axis);
            held += row * row.transpose();
        }
    }
    let eigen = SymmetricEigen::new(held / count);
    let mut free: Vec<Vector6<f64>> = (0..6)
        .filter(|&k| eigen.eigenvalues[k].abs() < HELD)
        .map(|k| eigen.eigenvectors.column(k).into())
        .collect();
    let mut chosen = Vec::new();
    while !free.is_empty() {
        let moved = |i: usize, axis: usize| -> f64 {
            let row = row(i, axis);
            free.iter().map(|motion| motion.dot(&row).powi(2)).sum()
        };
        let all = (0..x.len()).flat_map(|i| (0..3).map(move |axis| (i, axis)));
        let open = all.filter(|(i, axis)| !pins[*i][*axis]);
        let best =
            open.map(|(i, axis)| (moved(i, axis), i, axis)).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((size, i, axis)) = best.filter(|best| best.0 > HELD) else { break };
        chosen.push((i, axis));
        // What remains are the combinations that do not move this direction.
        let row = row(i, axis);
        let along: Vector6<f64> =
            free.iter().map(|motion| motion.dot(&row) * motion).sum::<Vector6<f64>>() / size.sqrt();
        let mut rest: Vec<Vector6<f64>> = Vec::new();
        for motion in &free {
            let mut motion = motion - motion.dot(&along) * along;
            for other in &rest {
                motion -= motion.dot(other) * other;
            }
            if motion.norm() > 1e-6 {
                rest.push(motion.normalize());
            }
        }
        free = rest;
    }
    chosen
}
