//! The overdamped motion itself, followed accurately: which minimum does it lead to?
//!
//! ```text
//! dx/ds = -∂U/∂x,   s = t/drag
//! ```
//!
//! by the Rosenbrock method ROS2 (L-stable, second order, one factor and two solves a step), with
//! γ = 1 - 1/√2 and d = Δs k:
//!
//! ```text
//! (H + 1/(γ Δs)) d₁ = -g(x)/γ
//! (H + 1/(γ Δs)) d₂ = -g(x + d₁)/γ - 2 d₁/(γ Δs)
//! x' = x + 3/2 d₁ + 1/2 d₂,          error ≈ |x' - (x + d₁)| = |d₁ + d₂|/2
//! ```
//!
//! H is the whole Hessian. The step follows from the largest error of a vertex, in mean edge
//! lengths. A step is also refused when the factorisation fails (it is longer than the growth time
//! of an instability), when the energy rises, or when a triangle loses half its area or turns over:
//! the true motion does none of these in a short enough step.
//!
//! With the cotangent curvature the motion may run into a triangle without area, where the energy
//! jumps. It then chatters along the jump in ever shorter steps and never comes to rest, so the
//! smallest angle ends it: "collapsed".
//!
//! Reference: Verwer, Spee, Blom & Hundsdorfer, SIAM J. Sci. Comput. 20 (1999),
//! doi:10.1137/S1064827597326651.

use std::f64::consts::FRAC_1_SQRT_2;
use std::sync::Arc;

use rumple::Vec3;
use rumple::effects::HessianPart;
use rumple::model::Potential;
use rumple_numerics::linear::{BlockCholesky, BlockMatrix};
use rumple_numerics::parallel;

use crate::common::Result;
use crate::problem::smallest_angle;

const GAMMA: f64 = 1.0 - FRAC_1_SQRT_2;
/// Least share of a triangle's area that a step must leave.
const MIN_AREA_SHARE: f64 = 0.5;
/// Energy differences below this share of the energy are round-off.
const ROUND_OFF: f64 = 1e-12;
/// Steps below this share of the first one lead nowhere.
const MIN_STEP_SHARE: f64 = 1e-12;
/// A triangle with an angle below this has collapsed, degrees.
const COLLAPSED_ANGLE: f64 = 0.01;

/// Work of a motion.
#[derive(Debug, Default)]
pub struct Work {
    /// Accepted steps.
    pub steps: usize,
    /// Evaluations of energy and gradient.
    pub evaluations: usize,
    /// Numeric factorisations, failed ones included.
    pub factorisations: usize,
    /// Whether a triangle collapsed.
    pub collapsed: bool,
}

/// Follows the motion from `x` with a step error of `tolerance` mean edge lengths until the norm of
/// the gradient has fallen to the share `relative`, or a triangle collapses.
pub fn follow(
    mechanics: &mut Potential,
    x: &mut [Vec3],
    tolerance: f64,
    relative: f64,
) -> Result<Work> {
    let n = x.len();
    let norm = |g: &[Vec3]| parallel::sum(n, |i| g[i].norm_squared()).sqrt();
    let mut work = Work::default();
    let mut gradient = vec![Vec3::zeros(); n];
    let mut energy = mechanics.energy_gradient(x, &mut gradient);
    let goal = relative * norm(&gradient);
    let pattern = Arc::clone(mechanics.mechanics().pattern());
    let mut hessian = BlockMatrix::zeros(Arc::clone(&pattern));
    let mut cholesky = <BlockCholesky>::new(pattern)?;
    let unit = tolerance * mechanics.metric().mean_edge();
    mechanics.hessian(x, HessianPart::Full, &mut hessian)?;
    // The shortest times of the motion are some tenths of this.
    let first = 1.0 / hessian.mean_diagonal();
    let (mut step, mut fresh) = (0.1 * first, true);
    let mut trial = vec![Vec3::zeros(); n];
    let mut trial_gradient = vec![Vec3::zeros(); n];
    while norm(&gradient) > goal && !work.collapsed && step > MIN_STEP_SHARE * first {
        if !fresh {
            mechanics.hessian(x, HessianPart::Full, &mut hessian)?;
            fresh = true;
        }
        let shift = 1.0 / (GAMMA * step);
        let mut shifted = hessian.clone();
        shifted.add_diagonal(shift);
        work.factorisations += 1;
        if cholesky.factorise(&shifted).is_err() {
            step *= 0.5;
            continue;
        }
        let mut d1: Vec<Vec3> = gradient.iter().map(|g| -g / GAMMA).collect();
        cholesky.solve(&mut d1);
        parallel::fill(&mut trial, |i| x[i] + d1[i]);
        mechanics.energy_gradient(&trial, &mut trial_gradient);
        let mut d2: Vec<Vec3> =
            trial_gradient.iter().zip(&d1).map(|(g, d)| -g / GAMMA - 2.0 * shift * d).collect();
        cholesky.solve(&mut d2);
        let error = 0.5 * parallel::max(n, |i| (d1[i] + d2[i]).norm()) / unit;
        parallel::fill(&mut trial, |i| x[i] + 1.5 * d1[i] + 0.5 * d2[i]);
        let e = mechanics.energy_gradient(&trial, &mut trial_gradient);
        work.evaluations += 2;
        let descends = e <= energy + ROUND_OFF * energy.abs();
        let accepted = error <= 1.0 && descends && mechanics.allows(x, &trial, MIN_AREA_SHARE);
        if accepted {
            x.copy_from_slice(&trial);
            std::mem::swap(&mut gradient, &mut trial_gradient);
            (energy, fresh) = (e, false);
            work.steps += 1;
            let angle = smallest_angle(mechanics.sheet(), x);
            work.collapsed = angle < COLLAPSED_ANGLE;
            if work.steps.is_multiple_of(50) {
                let now = norm(&gradient) / goal * relative;
                eprintln!(
                    "  overdamped: step {}, Δs {:.1e}, relative gradient {now:.1e}, energy \
                     {energy:.6e}, smallest angle {angle:.2}°",
                    work.steps,
                    step / first,
                );
            }
        }
        let factor = 0.9 / error.sqrt();
        let factor = if factor.is_finite() { factor.clamp(0.2, 2.0) } else { 0.2 };
        step *= if accepted { factor } else { factor.min(0.5) };
    }
    Ok(work)
}
