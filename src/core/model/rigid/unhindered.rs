//! Rigid motions that neither pins nor forces hinder.
//!
//! ```text
//! v·∂U/∂x(x) = 0                                  no force acts along v,
//! K_ab = v_a(x_b)·∂U/∂x(x_b) - v_a(x)·∂U/∂x(x)    K v = 0: nor does one after a displacement along v
//! ```
//!
//! x_b is x displaced rigidly along motion b: K is what that changes of the force along motion a. A load drives a motion; a
//! foundation or an obstacle hinders one that pins leave free, in equilibrium too; an energy that is invariant hinders none,
//! at rest or not. A sheet *floats* if nothing hinders any motion that its pins leave free.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Vector6};

use super::{Motion, free_motions, move_rigidly, velocity};
use crate::Vec3;
use crate::model::{Mechanics, Potential};
use crate::parallel;
use crate::reduction::Reduction;

/// The displacement, in mean edges: short, so that what is hindered in higher order alone counts as free, as in H.
const PROBE_DISPLACEMENT: f64 = 1e-3;
/// A change of force per vertex below this share of the force scale is round-off.
const ROUND_OFF: f64 = 1e-12;
/// A force along a motion acts if, shared by all vertices, it exceeds this share of the tolerance: it would then keep a
/// relaxation from its end.
const ACTING_FORCE_SHARE: f64 = 0.1;
/// The displacement, in mean edges, by which a sheet that floats must be able to go without one of its pins.
const FLOATING_DISPLACEMENT: f64 = 0.1;

/// The rigid motions of `x` that neither pins nor forces hinder, orthonormal; the gradient of the energy there is `gradient`
/// and counts as 0 below `tolerance`.
pub(crate) fn unhindered(
    potential: &mut Potential,
    x: &[Vec3],
    gradient: &[Vec3],
    tolerance: f64,
) -> Vec<Motion> {
    let (motions, radius) = force_free_motions(potential, x, gradient, tolerance);
    let reduction = potential.reduction().clone();
    let displacement = PROBE_DISPLACEMENT * potential.metric().mean_edge();
    let limit = ROUND_OFF * potential.force_scale() * reduction.count(x.len()).sqrt();
    let before = forces_along(&motions, radius, (x, gradient), &reduction);
    // None where an obstacle is in the way.
    let mut change = |along: Vector6<f64>| -> Option<DVector<f64>> {
        let mut moved = x.to_vec();
        move_rigidly(&mut moved, &(along * (displacement / along.norm())), radius, &reduction);
        let direction: Vec<Vec3> = moved.iter().zip(x).map(|(to, from)| to - from).collect();
        if potential.largest_step(x, &direction) < 1.0 {
            return None;
        }
        let mut gradient = vec![Vec3::zeros(); x.len()];
        potential.energy_gradient(&moved, &mut gradient);
        Some(forces_along(&motions, radius, (&moved, &gradient), &reduction) - &before)
    };
    let all = motions.iter().map(|motion| motion.parameters).sum();
    let is_free = |change: DVector<f64>| change.iter().all(|change| change.abs() <= limit);
    if motions.is_empty() || change(all).is_some_and(is_free) {
        return motions;
    }
    let columns: Vec<_> = motions.iter().map(|motion| change(motion.parameters)).collect();
    null_space(&motions, &columns, limit)
}

/// The motions of the sheet at rest that neither pins nor forces hinder, the species that energies read being 0; loads,
/// which drive but do not hinder, leave them.
pub(in crate::model) fn unhindered_at_rest(mechanics: &Arc<Mechanics>) -> Vec<Motion> {
    let x = mechanics.sheet().rest();
    let mut potential = Potential::new(mechanics);
    for &s in mechanics.species() {
        potential.set_species(s, vec![0.0; x.len()]);
    }
    potential.set_conditions(None, 0.0);
    mechanics.tally().uncounted(|| {
        let mut gradient = vec![Vec3::zeros(); x.len()];
        potential.energy_gradient(x, &mut gradient);
        unhindered(&mut potential, x, &gradient, f64::INFINITY)
    })
}

/// Whether the sheet floats at `x`: it can be moved rigidly, as pins let it, without forces above the `tolerance`.
pub(crate) fn floats(potential: &mut Potential, x: &[Vec3], tolerance: f64) -> bool {
    let reduction = potential.reduction().clone();
    let (motions, radius) = free_motions(x, potential.pins(), &reduction, |_| 1.0);
    let mechanics = potential.mechanics();
    // Obstacles exert no force until they are touched, and then push the whole sheet.
    if motions.is_empty() || mechanics.has_prescribed() || mechanics.meets_obstacles() {
        return false;
    }
    let mut along: Vector6<f64> = motions.iter().map(|motion| motion.parameters).sum();
    along *= FLOATING_DISPLACEMENT * potential.metric().mean_edge() / along.norm();
    let mut moved = x.to_vec();
    move_rigidly(&mut moved, &along, radius, &reduction);
    // Pins that let a motion begin may hinder it further on.
    let held = (0..x.len()).any(|i| {
        let (pin, d) = (potential.pins()[i], moved[i] - x[i]);
        (0..3).any(|a| pin[a] && d[a].abs() > 1e-12 * radius)
    });
    if reduction.any(held) {
        return false;
    }
    let mut gradient = vec![Vec3::zeros(); x.len()];
    potential.energy_gradient(x, &mut gradient);
    unhindered(potential, x, &gradient, tolerance).len() == motions.len()
}

/// The rigid motions of `x` that pins leave free and along which no force acts, orthonormal, and R: those that pins leave
/// free, without the one combination along which `gradient` is above `tolerance`.
pub(crate) fn force_free_motions(
    potential: &Potential,
    x: &[Vec3],
    gradient: &[Vec3],
    tolerance: f64,
) -> (Vec<Motion>, f64) {
    let reduction = potential.reduction();
    let (mut motions, radius) = free_motions(x, potential.pins(), reduction, |_| 1.0);
    let limit = ACTING_FORCE_SHARE * tolerance * potential.force_scale();
    let along = DVector::from_fn(motions.len(), |k, _| reduction.dot(&motions[k].shape, gradient));
    let size = along.norm();
    // The largest velocity is some 1/√n.
    if !(size > limit * reduction.count(gradient.len()).sqrt()) {
        return (motions, radius);
    }
    // A Householder reflection turns the last axis into that combination; the others stay free.
    let mut normal = along / size;
    let last = motions.len() - 1;
    let sign = if normal[last] < 0.0 { -1.0 } else { 1.0 };
    normal[last] += sign;
    let scale = 2.0 / normal.norm_squared();
    let reflected = |k: usize| {
        let mut turned = motions[k].clone();
        for (other, share) in motions.iter().zip(normal.iter()) {
            turned.add(-(scale * normal[k] * share), other);
        }
        turned
    };
    motions = (0..last).map(reflected).collect();
    (motions, radius)
}

/// `v·gradient` for the velocities v at `x` of every motion.
fn forces_along(
    motions: &[Motion],
    radius: f64,
    (x, gradient): (&[Vec3], &[Vec3]),
    reduction: &Reduction,
) -> DVector<f64> {
    let centre = super::mean(x, reduction);
    let along = |motion: &Motion| {
        let v = velocity(&motion.parameters, radius);
        reduction.sum(x.len(), |i| gradient[i].dot(&v(x[i] - centre)))
    };
    DVector::from_iterator(motions.len(), motions.iter().map(along))
}

/// The combinations of `motions` that change no force along any: the null vectors of the matrix of these columns. A motion
/// without a column is hindered.
fn null_space(motions: &[Motion], columns: &[Option<DVector<f64>>], limit: f64) -> Vec<Motion> {
    let passable: Vec<usize> = (0..motions.len()).filter(|k| columns[*k].is_some()).collect();
    if passable.is_empty() {
        return Vec::new();
    }
    let columns: Vec<DVector<f64>> = columns.iter().flatten().cloned().collect();
    let change = DMatrix::from_columns(&columns);
    // The decomposition of what is not finite does not end.
    if !change.iter().all(|value| value.is_finite()) {
        return Vec::new();
    }
    // Squares of the matrix would lose what is free beside what is stiff.
    let Some(svd) = change.try_svd(false, true, f64::EPSILON, 0) else { return Vec::new() };
    let Some(rows) = svd.v_t else { return Vec::new() };
    let free = (0..passable.len()).filter(|k| svd.singular_values[*k] <= limit);
    let combination = |k: usize| {
        let mut sum = Motion {
            shape: vec![Vec3::zeros(); motions[0].shape.len()],
            parameters: Vector6::zeros(),
        };
        for (share, motion) in rows.row(k).iter().zip(&passable) {
            sum.add(*share, &motions[*motion]);
        }
        sum
    };
    free.map(combination).collect()
}

impl Motion {
    /// Adds a multiple of another motion.
    fn add(&mut self, share: f64, other: &Self) {
        self.parameters += share * other.parameters;
        parallel::update(&mut self.shape, |i, v| *v += share * other.shape[i]);
    }
}
