//! Rigid motions that neither pins nor forces hinder.
//!
//! ```text
//! v_i = t + ω × (x_i - x̄)      H v = ω × ∂U/∂x  where U does not change under motions
//! ```
//!
//! Of the six parameters those remain for which every fixed component of v vanishes. Among them a
//! direction is a zero mode if `|H v| ≤ 2 |ω| |∂U/∂x|` (free components) but for round-off: a reaction
//! at a pin that turns with the sheet would make |H v| larger. What is counted is infinitesimal: a
//! stress-free flat sheet fixed in its plane only may be lifted and tilted, three motions, though a
//! finite tilt stretches it.

use nalgebra::{DMatrix, SymmetricEigen, Vector6};

use crate::Vec3;
use crate::effects::Pins;
use crate::model::free_motions;
use crate::parallel;
use crate::reduction::Reduction;

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
    reduction: &Reduction,
    image: impl Fn(&[Vec3]) -> Vec<Vec3>,
    limits: &Limits,
) -> Vec<Vec<Vec3>> {
    let (candidates, radius) = free_motions(x, pins, reduction, |i| mass[i]);
    let images: Vec<Vec<Vec3>> = candidates.iter().map(|c| image(&c.shape)).collect();
    let count = candidates.len();
    if count == 0 {
        return Vec::new();
    }
    let gram = DMatrix::from_fn(count, count, |a, b| reduction.dot(&images[a], &images[b]));
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
        let norm = |v: &[Vec3]| reduction.dot(v, v).sqrt();
        let turn = parameters.fixed_rows::<3>(3).norm() / radius;
        let limit = 2.0 * turn * limits.force + limits.round_off * norm(&shape);
        if norm(&image) <= limit {
            found.push(shape);
        }
    }
    found
}
