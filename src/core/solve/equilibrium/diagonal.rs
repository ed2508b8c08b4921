//! A stiffness for every unknown, learnt from steps without a matrix.
//!
//! ```text
//! D ← σ D,    σ = y·D⁻¹y / s·y                       then y·D⁻¹y = s·y
//! D_i ← D_i + y_i²/(s·y) - (D_i s_i)²/(s·D s)        the diagonal of the BFGS update of D
//! ```
//!
//! with steps s and changes of the gradient y, s·y > 0. D stays positive, as the whole of the update does.
//!
//! Reference: Gilbert & Lemaréchal, Math. Program. 45 (1989), doi:10.1007/BF01589113.

use serde::{Deserialize, Serialize};

use crate::Vec3;
use crate::parallel;
use crate::reduction::Reduction;

/// Stiffnesses stay within this factor of the first one.
const STIFFNESS_RANGE: f64 = 1e8;

/// The diagonal D.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Diagonal {
    stiffness: Vec<Vec3>,
    least: f64,
    most: f64,
}

impl Diagonal {
    /// The same stiffness `unit` for all of `rows` vertices.
    pub(super) fn new(rows: usize, unit: f64) -> Self {
        let stiffness = vec![Vec3::repeat(unit); rows];
        Self { stiffness, least: unit / STIFFNESS_RANGE, most: unit * STIFFNESS_RANGE }
    }

    /// Forgets all that was learnt.
    pub(super) fn reset(&mut self, unit: f64) {
        *self = Self::new(self.stiffness.len(), unit);
    }

    /// Learns from the step from one shape to the next and the change of its gradient, each as (before,
    /// after), if the energy is convex along it.
    pub(super) fn learn(
        &mut self,
        x: (&[Vec3], &[Vec3]),
        gradient: (&[Vec3], &[Vec3]),
        reduction: &Reduction,
    ) {
        let n = self.stiffness.len();
        let (step, change) = (|i: usize| x.1[i] - x.0[i], |i: usize| gradient.1[i] - gradient.0[i]);
        let all = &self.stiffness;
        let curvature = reduction.sum(n, |i| step(i).dot(&change(i)));
        let through = reduction.sum(n, |i| change(i).component_div(&all[i]).dot(&change(i)));
        let along = reduction.sum(n, |i| step(i).component_mul(&all[i]).dot(&step(i)));
        let scale = through / curvature;
        if !(curvature > 0.0 && scale > 0.0 && scale.is_finite() && along > 0.0) {
            return;
        }
        let (least, most) = (self.least, self.most);
        parallel::update(&mut self.stiffness, |i, stiffness| {
            let (s, y) = (step(i), change(i));
            let force = stiffness.component_mul(&s);
            // Of σ D: (σ D s)²/(s·σ D s).
            let less = (scale / along) * force.component_mul(&force);
            let more = y.component_mul(&y) / curvature;
            *stiffness = (scale * *stiffness + more - less).map(|d| d.clamp(least, most));
        });
    }

    /// Rows that it is for.
    pub(super) fn rows(&self) -> usize {
        self.stiffness.len()
    }

    /// Replaces `rhs` by D⁻¹ rhs.
    pub(super) fn solve(&self, rhs: &mut [Vec3]) {
        parallel::update(rhs, |i, v| v.component_div_assign(&self.stiffness[i]));
    }
}
