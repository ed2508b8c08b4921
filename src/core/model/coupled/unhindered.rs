//! Rigid motions that are held where the shape has no storage: those that neither pins nor forces hinder.
//!
//! ```text
//! K_ab = v_a(x_b)·∂U/∂x(x_b) - v_a(x)·∂U/∂x(x)         x_b: x moved rigidly along motion b
//! ```
//!
//! is what a displacement along motion b changes of the force along motion a. Null vectors of K are free: the rows of forces say
//! nothing about them. A foundation hinders motions that pins leave free; an energy that is invariant hinders none, at rest or not.

use std::sync::Arc;

use nalgebra::{DMatrix, Vector6};

use super::super::rigid::{Motion, free_motions, move_rigidly};
use super::super::{Mechanics, Potential};
use crate::Vec3;
use crate::num::real;

/// The displacement, in mean edges: short, so that what is hindered in higher order alone counts as free, as in H.
const DISPLACEMENT: f64 = 1e-3;
/// A change of force per vertex below this share of the force scale is round-off.
const ROUND_OFF: f64 = 1e-12;

/// The motions of the sheet at rest that neither pins nor forces hinder, the species that energies read being 0.
pub(super) fn unhindered(mechanics: &Arc<Mechanics>) -> Vec<Motion> {
    let x = mechanics.sheet().rest();
    let reduction = mechanics.sheet().reduction();
    let (motions, radius) = free_motions(x, mechanics.pins(), reduction, |_| 1.0);
    if motions.is_empty() || mechanics.is_empty() {
        return motions;
    }
    let mut potential = Potential::new(mechanics);
    for &s in mechanics.species() {
        potential.set_species(s, vec![0.0; x.len()]);
    }
    potential.set_conditions(None, 0.0);
    mechanics.tally().uncounted(|| without_force(motions, radius, &mut potential))
}

/// The combinations of `motions` along which the sheet at rest can be displaced without a change of forces along any.
fn without_force(motions: Vec<Motion>, radius: f64, potential: &mut Potential) -> Vec<Motion> {
    let rest = potential.sheet().rest().to_vec();
    let reduction = potential.reduction().clone();
    let displacement = DISPLACEMENT * potential.metric().mean_edge();
    let mut along_all = |x: &[Vec3]| -> Vec<f64> {
        let mut gradient = vec![Vec3::zeros(); x.len()];
        potential.energy_gradient(x, &mut gradient);
        let centre = x.iter().sum::<Vec3>() / real(x.len());
        let along = |motion: &Motion| {
            let [shift, turn] =
                [0, 3].map(|k| -> Vec3 { motion.parameters.fixed_rows::<3>(k).into() });
            let velocity = |i: usize| shift + turn.cross(&(x[i] - centre)) / radius;
            reduction.sum(x.len(), |i| gradient[i].dot(&velocity(i)))
        };
        motions.iter().map(along).collect()
    };
    let before = along_all(&rest);
    let count = motions.len();
    let mut change = DMatrix::zeros(count, count);
    for (b, motion) in motions.iter().enumerate() {
        let mut moved = rest.clone();
        let parameters = motion.parameters * (displacement / motion.parameters.norm());
        move_rigidly(&mut moved, &parameters, radius, &reduction);
        for (a, after) in along_all(&moved).into_iter().enumerate() {
            change[(a, b)] = after - before[a];
        }
    }
    let limit = ROUND_OFF * potential.force_scale() * reduction.count(rest.len()).sqrt();
    let eigen = (change.transpose() * &change).symmetric_eigen();
    let free = (0..count).filter(|k| eigen.eigenvalues[*k].max(0.0).sqrt() <= limit);
    free.map(|k| combination(&motions, eigen.eigenvectors.column(k).as_slice())).collect()
}

/// The sum of motions with these shares.
fn combination(motions: &[Motion], shares: &[f64]) -> Motion {
    let mut shape = vec![Vec3::zeros(); motions[0].shape.len()];
    let mut parameters = Vector6::zeros();
    for (motion, share) in motions.iter().zip(shares) {
        parameters += *share * motion.parameters;
        shape.iter_mut().zip(&motion.shape).for_each(|(sum, v)| *sum += *share * v);
    }
    Motion { shape, parameters }
}
