//! Forces that hold a sheet in a shape, whatever way the sheet is turned.
//!
//! ```text
//! U_h = -Σ_i f_i · (Rᵀ (x_i - x̄) + x̄ - b_i)     R = argmin Σ_i |x_i - x̄ - R (b_i - b̄)|²
//! ```
//!
//! b is the shape that they hold, R the rotation of the polar decomposition of `A = Σ_i (x_i - x̄) ⊗ (b_i - b̄) = R S`.
//! Dead forces that push inwards would turn a sheet that floats over; these turn with it, without a torque, while what they
//! do to its centre is that of dead ones:
//!
//! ```text
//! ∂U_h/∂x_i = -R (f_i - ω × (b_i - b̄)) + (R - 1) Σ_j f_j / n         (tr S - S) ω = Σ_i Rᵀ (x_i - x̄) × f_i
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
pub(crate) struct CorotationalForces {
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

impl CorotationalForces {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in [-1, 1] without a pattern.
    fn numbers(count: u32, phase: f64) -> Vec<Vec3> {
        let at = |i: u32, a: f64| (12.9898 * (f64::from(i) + a) + phase).sin();
        (0..count).map(|i| Vec3::new(at(i, 0.0), at(i, 0.3), at(i, 0.7))).collect()
    }

    #[test]
    fn the_gradient_is_that_of_the_energy_however_the_sheet_is_turned_and_strained() {
        let reduction = Reduction::default();
        let hold = CorotationalForces { force: numbers(7, 0.1), shape: numbers(7, 1.1) };
        for (angle, strain) in [(0.0, 0.0), (0.4, 0.2), (2.9, 0.3), (-1.7, 0.5)] {
            let turn = nalgebra::Rotation3::from_scaled_axis(angle * Vec3::new(0.6, -0.48, 0.64));
            let apart = numbers(7, 2.3);
            let moved =
                |i: usize| turn * (hold.shape[i] + strain * apart[i]) + Vec3::new(3.0, -2.0, 1.0);
            let x: Vec<Vec3> = (0..7).map(moved).collect();
            let mut gradient = vec![Vec3::zeros(); 7];
            hold.add_gradient(&x, &reduction, &mut gradient);
            for (i, axis) in (0..7).flat_map(|i| (0..3).map(move |axis| (i, axis))) {
                let energy = |step: f64| {
                    let mut x = x.clone();
                    x[i][axis] += step;
                    hold.energy_here(&x, &reduction)
                };
                let slope = (energy(1e-5) - energy(-1e-5)) / 2e-5;
                assert!((slope - gradient[i][axis]).abs() < 1e-8, "{angle} {strain}: {slope}");
            }
        }
    }

    #[test]
    fn forces_turn_with_the_sheet_and_make_no_torque() {
        let reduction = Reduction::default();
        let hold = CorotationalForces { force: numbers(7, 0.1), shape: numbers(7, 1.1) };
        let turn = nalgebra::Rotation3::from_scaled_axis(Vec3::new(0.5, 2.0, -0.3));
        let x: Vec<Vec3> = hold.shape.iter().map(|b| turn * b).collect();
        let mut gradient = vec![Vec3::zeros(); 7];
        hold.add_gradient(&x, &reduction, &mut gradient);
        let centre = mean(&x, &reduction);
        let torque: Vec3 = x.iter().zip(&gradient).map(|(x, g)| (x - centre).cross(g)).sum();
        assert!(torque.norm() < 1e-12, "{torque}");
    }
}
