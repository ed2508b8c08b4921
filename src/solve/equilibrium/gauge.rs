//! The gauge of a relaxation: rigid motions that neither pins nor forces hinder.
//!
//! ```text
//! V  the free rigid motions v = t + ω × x with |v·∂U/∂x| as good as 0, orthonormal
//! P = 1 - V Vᵀ                      steps are taken in the range of P: x does not drift
//! d = -P A⁺ P ∂U/∂x                 A with as many directions held as there are motions
//! ```
//!
//! The energy does not change along V, so its second derivatives have no stiffness there, and what
//! round-off leaves of a force is amplified without bound by their inverse. Where A v = 0, P A⁺ P is
//! the pseudo-inverse of A, and does not depend on which directions are held. No force acts on the
//! sheet: shape and energy are those of any other gauge.
//!
//! A motion along which a force acts is not free: a load turns a sheet that hangs from one vertex.

use nalgebra::DVector;

use crate::Vec3;
use crate::num::real;
use crate::parallel;
use crate::system::{Mechanics, Motion, Pins, free_motions, holding};

/// A motion is hindered if the force along it, shared by all vertices, exceeds this share of the
/// tolerance: it would then keep a relaxation from its end.
const HINDERED: f64 = 0.1;

/// The unhindered rigid motions of one shape.
#[derive(Debug, Default)]
pub(super) struct Gauge {
    motions: Vec<Vec<Vec3>>,
    /// Directions held where an inverse is needed; empty if there are none.
    held: Pins,
    directions: Vec<(usize, usize)>,
}

impl Gauge {
    /// For `x`, where the gradient of the energy is `gradient` and counts as 0 below `tolerance`.
    pub(super) fn new(
        mechanics: &Mechanics,
        x: &[Vec3],
        gradient: &[Vec3],
        tolerance: f64,
    ) -> Self {
        let pins = mechanics.pins();
        let (mut motions, _) = free_motions(x, pins, |_| 1.0);
        remove_hindered(&mut motions, gradient, HINDERED * tolerance * mechanics.force_scale());
        if motions.is_empty() {
            return Self::default();
        }
        let directions = holding(&motions, pins);
        let mut held = vec![[false; 3]; x.len()];
        for &(i, axis) in &directions {
            held[i][axis] = true;
        }
        Self { motions: motions.into_iter().map(|motion| motion.shape).collect(), held, directions }
    }

    /// The directions to hold in a matrix that is to be inverted, if any.
    pub(super) fn held(&self) -> Option<&Pins> {
        (!self.directions.is_empty()).then_some(&self.held)
    }

    /// Sets the held directions of `v` to zero.
    pub(super) fn hold(&self, v: &mut [Vec3]) {
        for &(i, axis) in &self.directions {
            v[i][axis] = 0.0;
        }
    }

    /// Replaces `v` by P v.
    pub(super) fn project(&self, v: &mut [Vec3]) {
        for motion in &self.motions {
            let share = super::stop::dot(motion, v);
            parallel::update(v, |i, v| *v -= share * motion[i]);
        }
    }

    /// Lets the sheet move freely from now on; an inverse made with held directions stays usable.
    pub(super) fn release(&mut self) {
        self.motions.clear();
    }
}

/// Takes the one combination of `motions` out along which `gradient` acts, if its force on a vertex
/// is above `limit`.
fn remove_hindered(motions: &mut Vec<Motion>, gradient: &[Vec3], limit: f64) {
    let count = motions.len();
    let along = DVector::from_fn(count, |k, _| super::stop::dot(&motions[k].shape, gradient));
    let size = along.norm();
    // The largest velocity is some 1/√n.
    if !(size > limit * real(gradient.len()).sqrt()) {
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
