//! The gauge of a relaxation: rigid motions that neither pins nor forces hinder.
//!
//! ```text
//! V  the free rigid motions v = t + ω × x with |v·∂U/∂x| as good as 0, orthonormal
//! P = 1 - V Vᵀ                      steps are taken in the range of P: x does not drift
//! d = -P (A + k Σ e eᵀ)⁻¹ P ∂U/∂x   as many directions e as there are motions
//! ```
//!
//! The energy does not change along V, so its second derivatives have no stiffness there, and what
//! round-off leaves of a force is amplified without bound by their inverse. A spring of stiffness k in
//! as many directions e as there are motions supports the sheet; where A v = 0, forces without a
//! share along V leave these springs at rest, since `k Σ (v·e)(e·u) = v·b = 0` for all v. So the
//! matrix above is the pseudo-inverse of A, whichever directions are taken, and no force acts on the
//! sheet: shape and energy are those of any other gauge.
//!
//! A motion along which a force acts is not free: a load turns a sheet that hangs from one vertex.

use nalgebra::DVector;

use super::Goal;
use crate::Vec3;
use crate::linear::BlockMatrix;
use crate::model::{Motion, Potential, free_motions, minimal_pins};
use crate::parallel;
use crate::record::Malformed;
use crate::reduction::Reduction;

/// A motion is hindered if the force along it, shared by all vertices, exceeds this share of the
/// tolerance: it would then keep a relaxation from its end.
const HINDERED: f64 = 0.1;

/// The unhindered rigid motions of one shape.
#[derive(Debug, Default)]
pub(in crate::solve) struct Gauge {
    motions: Vec<Vec<Vec3>>,
    /// Vertices and axes with springs.
    springs: Vec<(usize, usize)>,
    reduction: Reduction,
}

impl Gauge {
    /// Of a relaxation towards `goal`. The pull of an anchor hinders every motion, but where the sheet floats the small
    /// viscosity along a path of equilibria hinders none.
    pub(super) fn of(
        potential: &Potential,
        x: &[Vec3],
        gradient: &[Vec3],
        goal: &Goal<'_>,
    ) -> Self {
        let gauge = || Self::new(potential, x, gradient, goal.tolerance);
        match (potential.anchor().is_some(), goal.floats && goal.trust.is_some()) {
            (false, _) => gauge(),
            // The viscosity supports the matrix, the same in all directions.
            (true, true) => Self { springs: Vec::new(), ..gauge() },
            (true, false) => Self::default(),
        }
    }

    /// For `x`, where the gradient of the energy is `gradient` and counts as 0 below `tolerance`.
    pub(in crate::solve) fn new(
        potential: &Potential,
        x: &[Vec3],
        gradient: &[Vec3],
        tolerance: f64,
    ) -> Self {
        let pins = potential.pins();
        let (mut motions, _) = free_motions(x, pins, potential.reduction(), |_| 1.0);
        let limit = HINDERED * tolerance * potential.force_scale();
        remove_hindered(&mut motions, gradient, limit, potential.reduction());
        // The first rank supports the sheet for all.
        let owned = &pins[..potential.reduction().owned(pins.len())];
        let first = potential.reduction().is_first();
        let springs = if first { minimal_pins(&motions, owned) } else { Vec::new() };
        let motions = motions.into_iter().map(|motion| motion.shape).collect();
        Self { motions, springs, reduction: potential.reduction().clone() }
    }

    /// Supports `matrix`, which is to be inverted, by springs of this `stiffness`.
    pub(in crate::solve) fn support(&self, matrix: &mut BlockMatrix, stiffness: f64) {
        for &(i, axis) in &self.springs {
            matrix.stiffen(i, axis, stiffness);
        }
    }

    /// Replaces `v` by P v.
    pub(in crate::solve) fn project(&self, v: &mut [Vec3]) {
        let motions = &self.motions;
        if motions.is_empty() {
            return;
        }
        // All products in one pass.
        let shares: [f64; 6] = self.reduction.sums(v.len(), |range| {
            let mut shares = [0.0; 6];
            for (share, motion) in shares.iter_mut().zip(motions) {
                *share = range.clone().map(|i| motion[i].dot(&v[i])).sum();
            }
            shares
        });
        parallel::update(v, |i, v| {
            for (share, motion) in shares.iter().zip(motions) {
                *v -= *share * motion[i];
            }
        });
    }

    /// The motions that are taken out.
    pub(super) fn motions(&self) -> &[Vec<Vec3>] {
        &self.motions
    }

    /// Takes over the motions of one for as many `vertices`; springs are in the matrix that they support.
    pub(super) fn restore(
        &mut self,
        motions: Vec<Vec<Vec3>>,
        vertices: usize,
    ) -> Result<(), Malformed> {
        if motions.iter().any(|motion| motion.len() != vertices) {
            return Err(Malformed);
        }
        self.motions = motions;
        self.springs.clear();
        Ok(())
    }

    /// Lets the sheet move freely from now on; an inverse made with springs stays usable.
    pub(super) fn release(&mut self) {
        self.motions.clear();
    }
}

/// Takes the one combination of `motions` out along which `gradient` acts, if its force on a vertex
/// is above `limit`.
fn remove_hindered(
    motions: &mut Vec<Motion>,
    gradient: &[Vec3],
    limit: f64,
    reduction: &Reduction,
) {
    let count = motions.len();
    let along = DVector::from_fn(count, |k, _| reduction.dot(&motions[k].shape, gradient));
    let size = along.norm();
    // The largest velocity is some 1/√n.
    if !(size > limit * reduction.count(gradient.len()).sqrt()) {
        return;
    }
    // A Householder reflection turns the last axis into that combination; the others stay free.
    let mut normal = along / size;
    let last = count - 1;
    let sign = if normal[last] < 0.0 { -1.0 } else { 1.0 };
    normal[last] += sign;
    let scale = 2.0 / normal.norm_squared();
    let kept = (0..last).map(|k| {
        let mut turned = motions[k].clone();
        for (other, share) in motions.iter().zip(normal.iter()) {
            let share = scale * normal[k] * share;
            turned.parameters -= share * other.parameters;
            parallel::update(&mut turned.shape, |i, v| *v -= share * other.shape[i]);
        }
        turned
    });
    *motions = kept.collect();
}
