//! The gauge of a relaxation: rigid motions that neither pins nor forces hinder.
//!
//! ```text
//! V  the unhindered rigid motions v = t + ω × x (`model/rigid/unhindered.rs`), orthonormal
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
//! A motion along which a force acts is not among them: a load turns a sheet that hangs from one vertex.

use super::Goal;
use crate::Vec3;
use crate::linear::BlockMatrix;
use crate::model::{Motion, Potential, force_free_motions, minimal_pins, unhindered};
use crate::parallel;
use crate::record::Malformed;
use crate::reduction::Reduction;

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
    pub(super) fn for_relaxation(
        potential: &mut Potential,
        x: &[Vec3],
        gradient: &[Vec3],
        goal: &Goal<'_>,
    ) -> Self {
        match (potential.anchor().is_some(), goal.floats && goal.trust.is_some()) {
            (false, _) => Self::new(potential, x, gradient, goal.tolerance),
            // The viscosity supports the matrix, the same in all directions.
            (true, true) => {
                let (motions, _) = force_free_motions(potential, x, gradient, goal.tolerance);
                Self { springs: Vec::new(), ..Self::along(motions, potential) }
            }
            (true, false) => Self::default(),
        }
    }

    /// For `x`, where the gradient of the energy is `gradient` and counts as 0 below `tolerance`.
    pub(in crate::solve) fn new(
        potential: &mut Potential,
        x: &[Vec3],
        gradient: &[Vec3],
        tolerance: f64,
    ) -> Self {
        let motions = unhindered(potential, x, gradient, tolerance);
        Self::along(motions, potential)
    }

    /// For these motions.
    fn along(motions: Vec<Motion>, potential: &Potential) -> Self {
        let (pins, reduction) = (potential.pins(), potential.reduction());
        // The first rank supports the sheet for all.
        let owned = &pins[..reduction.owned(pins.len())];
        let springs = if reduction.is_first() { minimal_pins(&motions, owned) } else { Vec::new() };
        let motions = motions.into_iter().map(|motion| motion.shape).collect();
        Self { motions, springs, reduction: reduction.clone() }
    }

    /// Supports `matrix`, which is to be inverted, by springs of this `stiffness`.
    pub(in crate::solve) fn support(&self, matrix: &mut BlockMatrix, stiffness: f64) {
        for &(i, axis) in &self.springs {
            matrix.add_to_diagonal(i, axis, stiffness);
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

    /// Takes over the motions of one for as many `vertices`, with products by `reduction`; springs are in the matrix that they
    /// support.
    pub(super) fn restore(
        &mut self,
        motions: Vec<Vec<Vec3>>,
        (vertices, reduction): (usize, &Reduction),
    ) -> Result<(), Malformed> {
        if motions.iter().any(|motion| motion.len() != vertices) {
            return Err(Malformed);
        }
        self.motions = motions;
        self.springs.clear();
        self.reduction = reduction.clone();
        Ok(())
    }

    /// Lets the sheet move freely from now on; an inverse made with springs stays usable.
    pub(super) fn release(&mut self) {
        self.motions.clear();
    }
}
