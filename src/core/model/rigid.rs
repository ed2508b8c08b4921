//! Rigid motions that pins leave free.
//!
//! ```text
//! v_i = t + ω × (x_i - x̄)/R        every fixed component of v zero;   ⟨v, w⟩ = Σ_i m_i v_i · w_i
//! ```
//!
//! with x̄ the mean position and R the root mean square distance from it; a periodic sheet turns about its periods P alone,
//! ω × P = 0. What is counted is
//! infinitesimal: a flat sheet fixed out of its plane along its boundary slides and turns in it, three
//! motions. Whether an energy changes along such a motion is asked in `rigid/unhindered.rs`.

mod unhindered;

pub(super) use unhindered::unhindered_at_rest;
pub(crate) use unhindered::{floats, force_free_motions, unhindered};

use nalgebra::{DMatrix, DVector, Matrix6, Rotation3, SymmetricEigen, Vector6};

use crate::Vec3;
use crate::effects::Pins;
use crate::parallel;
use crate::reduction::Reduction;

/// Mean square of the fixed components of a motion, relative to its own, that counts as 0: round-off
/// leaves some 1e-16.
const FIXED_SQUARE_TOLERANCE: f64 = 1e-13;
/// Smallest square of a component that can stand for a motion.
const MIN_COMPONENT_SQUARE: f64 = 1e-12;
/// A motion below this share of R is round-off.
const ROUND_OFF: f64 = 1e-14;
/// Most iterations; each leaves some |u|/R of the distance.
const MAX_ITERATIONS: usize = 20;

/// A rigid motion.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Velocity of every vertex.
    pub shape: Vec<Vec3>,
    /// (t, ω).
    pub parameters: Vector6<f64>,
}

/// The motions of `x` that move no vertex in a fixed direction, orthonormal in `mass`, and R.
#[must_use]
pub fn free_motions(
    x: &[Vec3],
    pins: &Pins,
    reduction: &Reduction,
    mass: impl Fn(usize) -> f64 + Sync,
) -> (Vec<Motion>, f64) {
    let inner = |a: &[Vec3], b: &[Vec3]| reduction.sum(a.len(), |i| mass(i) * a[i].dot(&b[i]));
    let count = reduction.count(x.len()).max(1.0);
    let own = reduction.owned(x.len());
    let centre = mean(x, reduction);
    let mut square = [x[..own].iter().map(|x| (x - centre).norm_squared()).sum::<f64>()];
    reduction.sum_over_ranks(&mut square);
    let radius = (square[0] / count).sqrt();
    if !(radius > 0.0 && radius.is_finite()) {
        return (Vec::new(), 1.0);
    }
    let basis = |p: usize, i: usize| -> Vec3 {
        let axis = Vec3::ith(p % 3, 1.0);
        if p < 3 { axis } else { axis.cross(&(x[i] - centre)) / radius }
    };
    let eigen = SymmetricEigen::new(hindrance(&pins[..own], reduction, &basis));
    let mut all: Vec<Motion> = Vec::new();
    for k in (0..6).filter(|&k| eigen.eigenvalues[k] <= FIXED_SQUARE_TOLERANCE) {
        let mut parameters: Vector6<f64> = eigen.eigenvectors.column(k).into();
        let mut shape = vec![Vec3::zeros(); x.len()];
        parallel::fill(&mut shape, |i| {
            let v = (0..6).map(|p| parameters[p] * basis(p, i)).sum::<Vec3>();
            Vec3::from_fn(|a, _| if pins[i][a] { 0.0 } else { v[a] })
        });
        let before = inner(&shape, &shape);
        for other in &all {
            let share = inner(&other.shape, &shape);
            parallel::update(&mut shape, |i, v| *v -= share * other.shape[i]);
            parameters -= share * other.parameters;
        }
        let square = inner(&shape, &shape);
        // A sheet without extent across an axis does not feel a turn about it.
        if square > 1e-20 * before && square > 0.0 {
            let scale = 1.0 / square.sqrt();
            parallel::update(&mut shape, |_, v| *v *= scale);
            all.push(Motion { shape, parameters: scale * parameters });
        }
    }
    (all, radius)
}

/// The quadratic form of (t, ω) whose null vectors are the motions, velocities of which `basis` gives, that move no fixed
/// component and change no period.
fn hindrance(
    pins: &[[bool; 3]],
    reduction: &Reduction,
    basis: &dyn Fn(usize, usize) -> Vec3,
) -> Matrix6<f64> {
    let mut fixed = Matrix6::zeros();
    let mut rows = [0.0];
    for (i, pin) in pins.iter().enumerate() {
        for a in (0..3).filter(|&a| pin[a]) {
            let row = Vector6::from_fn(|p, _| basis(p, i)[a]);
            fixed += row * row.transpose();
            rows[0] += 1.0;
        }
    }
    reduction.sum_over_ranks(&mut rows);
    reduction.sum_over_ranks(fixed.as_mut_slice());
    fixed /= rows[0].max(1.0);
    for period in reduction.periods() {
        for a in 0..3 {
            let turned = |p: usize| Vec3::ith(p % 3, 1.0).cross(&period.normalize())[a];
            let row = Vector6::from_fn(|p, _| if p < 3 { 0.0 } else { turned(p) });
            fixed += row * row.transpose();
        }
    }
    fixed
}

/// The mean position.
pub(crate) fn mean(x: &[Vec3], reduction: &Reduction) -> Vec3 {
    let mut centre: Vec3 = x[..reduction.owned(x.len())].iter().sum();
    reduction.sum_over_ranks(centre.as_mut_slice());
    centre / reduction.count(x.len()).max(1.0)
}

/// t and ω.
fn shift_and_turn(parameters: &Vector6<f64>) -> [Vec3; 2] {
    [0, 3].map(|k| parameters.fixed_rows::<3>(k).into())
}

/// The velocity t + ω × r/R at a distance r from the mean position.
fn velocity(parameters: &Vector6<f64>, radius: f64) -> impl Fn(Vec3) -> Vec3 + Sync + use<> {
    let [shift, turn] = shift_and_turn(parameters);
    move |r| shift + turn.cross(&r) / radius
}

/// Moves `x` rigidly by `parameters` (t, ω): turned by the angle |ω|/`radius` about its mean position, then shifted by t.
pub(crate) fn move_rigidly(
    x: &mut [Vec3],
    parameters: &Vector6<f64>,
    radius: f64,
    reduction: &Reduction,
) {
    let centre = mean(x, reduction);
    let [shift, turn] = shift_and_turn(parameters);
    let rotation = Rotation3::new(turn / radius);
    parallel::update(x, |_, x| *x = centre + shift + rotation * (*x - centre));
}

/// Moves `x` rigidly, as far as `pins` let it, to where it has the least distance from `about`, `Σ u·W u` with
/// `u = x - about`: there `Σ v·W u = 0` for every free motion v. By the method of Gauss and Newton.
pub fn align(
    x: &mut [Vec3],
    about: &[Vec3],
    weights: impl Fn(usize, Vec3) -> Vec3 + Sync,
    pins: &Pins,
    reduction: &Reduction,
) {
    for _ in 0..MAX_ITERATIONS {
        let (motions, radius) = free_motions(x, pins, reduction, |_| 1.0);
        let count = motions.len();
        let shape = |m: usize| motions[m].shape.as_slice();
        let inner = |v: &[Vec3], of: &(dyn Fn(usize) -> Vec3 + Sync)| {
            reduction.sum(v.len(), |i| v[i].dot(&weights(i, of(i))))
        };
        let along = DVector::from_fn(count, |m, _| inner(shape(m), &|i| x[i] - about[i]));
        let gram = DMatrix::from_fn(count, count, |m, n| inner(shape(m), &|i| shape(n)[i]));
        let Some(share) = gram.cholesky().map(|factor| factor.solve(&along)) else { return };
        let step: Vector6<f64> = motions
            .iter()
            .zip(share.iter())
            .map(|(motion, share)| -*share * motion.parameters)
            .sum();
        if !(step.norm() > ROUND_OFF * radius) {
            return;
        }
        move_rigidly(x, &step, radius, reduction);
    }
}

/// As many (vertex, axis) pairs as there are `motions`: fixed there, a sheet has none of them left.
/// Which ones does not matter to the shape; those are taken that the motions move most.
#[must_use]
pub(crate) fn minimal_pins(motions: &[Motion], pins: &[[bool; 3]]) -> Vec<(usize, usize)> {
    let count = motions.len();
    // What the motions with all chosen directions at rest still move.
    let mut basis: Vec<Vector6<f64>> = Vec::new();
    let row = |i: usize, axis: usize, basis: &[Vector6<f64>]| {
        let mut row = Vector6::from_fn(|k, _| motions.get(k).map_or(0.0, |m| m.shape[i][axis]));
        for b in basis {
            row -= b.dot(&row) * b;
        }
        row
    };
    let mut chosen = Vec::new();
    for _ in 0..count {
        let all = (0..pins.len()).flat_map(|i| (0..3).map(move |axis| (i, axis)));
        let sizes = all
            .filter(|&(i, axis)| !pins[i][axis])
            .map(|(i, axis)| (row(i, axis, &basis).norm_squared(), i, axis));
        let Some((size, i, axis)) =
            sizes.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|best| best.0 > MIN_COMPONENT_SQUARE)
        else {
            break;
        };
        chosen.push((i, axis));
        let along = row(i, axis, &basis) / size.sqrt();
        basis.push(along);
    }
    chosen
}
