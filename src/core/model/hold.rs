//! Forces that hold a sheet in a shape, whatever way the sheet is turned.
//!
//! ```text
//! U_h = -Σ_i f_i · Rᵀ (x_i - x̄)               R = argmin Σ_i |x_i - x̄ - R (b_i - b̄)|²
//! ```
//!
//! b is the shape that they hold, R the rotation of the polar decomposition of `A = Σ_i (x_i - x̄) ⊗ (b_i - b̄) = R S`.
//! Dead forces that push inwards would turn a sheet that floats over; these turn with it, without a torque:
//!
//! ```text
//! ∂U_h/∂x_i = -R (f_i - ω × (b_i - b̄))         (tr S - S) ω = Σ_i Rᵀ (x_i - x̄) × f_i
//! ```
//!
//! Reference for the derivative of R: Papadopoulo & Lourakis, ECCV (2000), doi:10.1007/3-540-45054-8_36.

use nalgebra::Matrix3;

use super::rigid::mean;
use crate::Vec3;
use crate::parallel;
use crate::reduction::Reduction;

/// The forces, and the shape that they hold.
#[derive(Debug, Clone)]
pub(crate) struct Hold {
    pub(crate) force: Vec<Vec3>,
    /// b.
    pub(crate) shape: Vec<Vec3>,
}

/// A shape against that which is held.
struct Turned {
    rotation: Matrix3<f64>,
    /// tr S - S.
    inertia: Matrix3<f64>,
    /// x̄ and b̄.
    centres: (Vec3, Vec3),
}

impl Hold {
    fn turned(&self, x: &[Vec3], reduction: &Reduction) -> Turned {
        let (centre, held) = (mean(x, reduction), mean(&self.shape, reduction));
        let mut moment = Matrix3::zeros();
        for (x, b) in x.iter().zip(&self.shape).take(reduction.owned(x.len())) {
            moment += (x - centre) * (b - held).transpose();
        }
        reduction.sum_over_ranks(moment.as_mut_slice());
        let centres = (centre, held);
        // The decomposition of what is not finite does not end.
        let finite = moment.iter().all(|value| value.is_finite());
        let svd = finite.then(|| moment.svd(true, true));
        let Some((Some(u), Some(v), values)) = svd.map(|svd| (svd.u, svd.v_t, svd.singular_values))
        else {
            let (rotation, inertia) = (Matrix3::identity(), Matrix3::identity());
            return Turned { rotation, inertia, centres };
        };
        let mut proper = Matrix3::identity();
        let least = values.imin();
        proper[(least, least)] = (u * v).determinant().signum();
        let rotation = u * proper * v;
        let stretch = rotation.transpose() * moment;
        let inertia = Matrix3::from_diagonal_element(stretch.trace()) - stretch;
        Turned { rotation, inertia, centres }
    }

    /// U_h of the vertices owned here, 0 where the shape is only turned.
    pub(super) fn energy_here(&self, x: &[Vec3], reduction: &Reduction) -> f64 {
        let Turned { rotation, centres: (centre, _), .. } = self.turned(x, reduction);
        let back = rotation.transpose();
        -reduction.sum_here(x.len(), |i| {
            self.force[i].dot(&(back * (x[i] - centre) - (self.shape[i] - centre)))
        })
    }

    /// Adds the gradient of U_h.
    pub(super) fn add_gradient(&self, x: &[Vec3], reduction: &Reduction, gradient: &mut [Vec3]) {
        let Turned { rotation, inertia, centres: (centre, held) } = self.turned(x, reduction);
        let (mut torque, mut total) = (Vec3::zeros(), Vec3::zeros());
        for (x, force) in x.iter().zip(&self.force).take(reduction.owned(x.len())) {
            torque += (rotation.transpose() * (x - centre)).cross(force);
            total += force;
        }
        reduction.sum_over_ranks(torque.as_mut_slice());
        reduction.sum_over_ranks(total.as_mut_slice());
        let spin = inertia.try_inverse().map_or_else(Vec3::zeros, |inverse| inverse * torque);
        let shift = (rotation * total - total) / reduction.count(x.len()).max(1.0);
        parallel::update(gradient, |i, g| {
            *g -= rotation * (self.force[i] - spin.cross(&(self.shape[i] - held))) - shift;
        });
    }
}
