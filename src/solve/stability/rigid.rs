//! Rigid motions that neither pins nor forces hinder.
//!
//! ```text
//! v_i = t + ω × (x_i - x̄)      H v = ω × ∂U/∂x  where U does not change under motions
//! ```
//!
//! Of the six parameters those remain for which every held component of v vanishes. Among them a
//! direction is a zero mode if `|H v| ≤ 2 |ω| |∂U/∂x|` (free components) but for round-off: a reaction
//! at a pin that turns with the sheet would make |H v| larger. What is counted is infinitesimal: a
//! stress-free flat sheet held in its plane only may be lifted and tilted, three motions, though a
//! finite tilt stretches it.

use nalgebra::{DMatrix, Matrix6, SymmetricEigen, Vector6};

use super::product;
use super::restricted::inner;
use crate::Vec3;
use crate::num::real;
use crate::parallel;
use crate::solve::linear::BlockMatrix;
use crate::system::Pins;

/// Mean square of the held components of a motion, relative to its own, that counts as 0: round-off
/// leaves some 1e-16.
const HELD: f64 = 1e-13;

/// A rigid motion, of length 1 in the mass: displacement of every vertex and (t, ω).
struct Motion {
    shape: Vec<Vec3>,
    parameters: Vector6<f64>,
}

/// What |H v| is compared with.
pub(super) struct Limits {
    /// |∂U/∂x| over the free components.
    pub(super) force: f64,
    /// Stiffness that is round-off.
    pub(super) round_off: f64,
}

/// The unhindered rigid motions at `x`, orthonormal in the mass.
pub(super) fn motions(
    x: &[Vec3],
    pins: &Pins,
    mass: &[f64],
    matrix: &BlockMatrix,
    limits: &Limits,
) -> Vec<Vec<Vec3>> {
    let centre: Vec3 = x.iter().sum::<Vec3>() / real(x.len().max(1));
    let square: f64 = x.iter().map(|x| (x - centre).norm_squared()).sum();
    let radius = (square / real(x.len().max(1))).sqrt();
    let candidates = compatible(x, pins, mass, centre, radius);
    let images: Vec<Vec<Vec3>> = candidates.iter().map(|c| product(matrix, &c.shape)).collect();
    let count = candidates.len();
    if count == 0 {
        return Vec::new();
    }
    let gram = DMatrix::from_fn(count, count, |a, b| {
        parallel::sum(x.len(), |i| images[a][i].dot(&images[b][i]))
    });
    let eigen = SymmetricEigen::new(gram);
    let mut found = Vec::new();
    for k in 0..count {
        let q = eigen.eigenvectors.column(k);
        let mut shape = vec![Vec3::zeros(); x.len()];
        let mut image = shape.clone();
        let mut parameters = Vector6::zeros();
        for (c, candidate) in candidates.iter().enumerate() {
            parallel::update(&mut shape, |i, v| *v += q[c] * candidate.shape[i]);
            parallel::update(&mut image, |i, v| *v += q[c] * images[c][i]);
            parameters += q[c] * candidate.parameters;
        }
        let norm = |v: &[Vec3]| parallel::sum(v.len(), |i| v[i].norm_squared()).sqrt();
        let turn = parameters.fixed_rows::<3>(3).norm() / radius;
        let limit = 2.0 * turn * limits.force + limits.round_off * norm(&shape);
        if norm(&image) <= limit {
            found.push(shape);
        }
    }
    found
}

/// The motions that move no vertex in a held direction.
fn compatible(x: &[Vec3], pins: &Pins, mass: &[f64], centre: Vec3, radius: f64) -> Vec<Motion> {
    let basis = |p: usize, i: usize| -> Vec3 {
        let axis = Vec3::ith(p % 3, 1.0);
        if p < 3 { axis } else { axis.cross(&(x[i] - centre)) / radius }
    };
    let mut held = Matrix6::zeros();
    let mut rows = 0usize;
    for (i, pin) in pins.iter().enumerate() {
        for a in (0..3).filter(|&a| pin[a]) {
            let row = Vector6::from_fn(|p, _| basis(p, i)[a]);
            held += row * row.transpose();
            rows += 1;
        }
    }
    let eigen = SymmetricEigen::new(held / real(rows.max(1)));
    let mut all: Vec<Motion> = Vec::new();
    for k in (0..6).filter(|&k| eigen.eigenvalues[k] <= HELD) {
        let mut parameters: Vector6<f64> = eigen.eigenvectors.column(k).into();
        let mut shape: Vec<Vec3> = (0..x.len())
            .map(|i| {
                let v = (0..6).map(|p| parameters[p] * basis(p, i)).sum::<Vec3>();
                Vec3::from_fn(|a, _| if pins[i][a] { 0.0 } else { v[a] })
            })
            .collect();
        let before = inner(mass, &shape, &shape);
        for other in &all {
            let share = inner(mass, &other.shape, &shape);
            parallel::update(&mut shape, |i, v| *v -= share * other.shape[i]);
            parameters -= share * other.parameters;
        }
        let square = inner(mass, &shape, &shape);
        // A sheet without extent across an axis does not feel a turn about it.
        if square > 1e-20 * before && square > 0.0 {
            let scale = 1.0 / square.sqrt();
            shape.iter_mut().for_each(|v| *v *= scale);
            all.push(Motion { shape, parameters: scale * parameters });
        }
    }
    all
}
