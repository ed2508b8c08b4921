//! The report of an examination, the shapes that it is made on, and the size of errors.

use std::cmp::Ordering;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::Vec3;
use crate::sheet::Sheet;

/// Displacements of the crumpled shape, in mean edge lengths.
pub(super) const CRUMPLING_DISPLACEMENT: f64 = 0.1;

/// Steps of differences, in mean edge lengths; the errors of central ones are of second order.
pub(super) const DIFFERENCE_STEP: f64 = 1e-5;

/// Relative error of a derivative beyond which it counts as wrong.
pub(super) const DERIVATIVE_TOLERANCE: f64 = 1e-5;

/// Relative size below which a change counts as round-off.
pub(super) const ROUND_OFF: f64 = 1e-9;

/// The times at which an effect is inspected.
pub(super) const INSPECTION_TIMES: [f64; 2] = [0.0, 0.7];

/// What [`examine`](super::examine) found.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Report {
    /// What is wrong, in words; nothing for a correct effect.
    pub faults: Vec<String>,
    /// Whether moving the sheet as a whole changes no energy.
    pub translation_invariant: bool,
    /// Whether turning it changes none.
    pub rotation_invariant: bool,
    /// Whether the sheet at rest has neither energy nor forces, and meets the constraints.
    pub zero_at_rest: bool,
    /// Whether transports change no total: `Σ A_i c_i` with the current areas of vertices (thirds) or faces, and
    /// for amounts per rest area `Σ A⁰_i C_i`.
    pub conserves_totals: bool,
    /// Whether transports leave a constant density alone: c = 1, and for amounts per rest area C = A/A⁰.
    pub keeps_constants: bool,
}

/// The fault of an effect that does in planar scenes what is never shown.
pub(super) const UNDECLARED_Z_ACTION: &str = "it acts along z on a sheet that lies in a plane z = const, and does not declare it: see \
     Needs::out_of_plane";

/// A crumpled shape of the sheet, and the generator in its state after it.
pub(super) fn crumpled(sheet: &Sheet, edge: f64) -> (Vec<Vec3>, ChaCha8Rng) {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let crumple = random_vectors(&mut random, sheet.vertex_count());
    (moved(sheet.rest(), &crumple, CRUMPLING_DISPLACEMENT * edge), random)
}

pub(super) fn random_vectors(random: &mut ChaCha8Rng, n: usize) -> Vec<Vec3> {
    (0..n).map(|_| Vec3::from_fn(|_, _| random.random_range(-1.0..=1.0))).collect()
}

/// What `evaluate` gives on that many threads.
pub(super) fn on_threads<T: Send>(threads: usize, evaluate: impl FnOnce() -> T + Send) -> T {
    match rayon::ThreadPoolBuilder::new().num_threads(threads).build() {
        Ok(pool) => pool.install(evaluate),
        Err(_) => evaluate(),
    }
}

/// Whether an error is beyond its limit; NaN is.
pub(super) fn exceeds(error: f64, limit: f64) -> bool {
    !matches!(error.partial_cmp(&limit), Some(Ordering::Less | Ordering::Equal))
}

pub(super) fn finite(a: &[Vec3]) -> bool {
    a.iter().all(|v| v.iter().all(|v| v.is_finite()))
}

pub(super) fn moved(x: &[Vec3], d: &[Vec3], by: f64) -> Vec<Vec3> {
    x.iter().zip(d).map(|(x, d)| x + by * d).collect()
}

pub(super) fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

pub(super) fn norm(a: &[Vec3]) -> f64 {
    dot(a, a).sqrt()
}

/// The largest length; NaN if one is.
pub(super) fn largest(a: &[Vec3]) -> f64 {
    a.iter().map(|v| v.norm()).fold(0.0, |a: f64, b| if a.is_nan() || a >= b { a } else { b })
}
