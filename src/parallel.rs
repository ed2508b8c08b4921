//! Parallel loops whose results do not depend on the number of threads.
//!
//! Every loop writes to places that belong to one index (a gather, never a scatter), and every sum
//! is taken over fixed blocks that are added in order. So the same input gives the same bits on
//! one thread and on many.

use rayon::prelude::*;

/// Entries per block: large enough to hide the cost of handing out work, small enough to share
/// a sheet of a few thousand vertices over a few cores.
pub const BLOCK: usize = 512;

/// Fills `out[i] = f(i)`.
pub fn fill<T: Send>(out: &mut [T], f: impl Fn(usize) -> T + Sync) {
    out.par_chunks_mut(BLOCK).enumerate().for_each(|(block, chunk)| {
        for (k, place) in chunk.iter_mut().enumerate() {
            *place = f(block * BLOCK + k);
        }
    });
}

/// Changes every `out[i]` in place.
pub fn update<T: Send>(out: &mut [T], f: impl Fn(usize, &mut T) + Sync) {
    out.par_chunks_mut(BLOCK).enumerate().for_each(|(block, chunk)| {
        for (k, place) in chunk.iter_mut().enumerate() {
            f(block * BLOCK + k, place);
        }
    });
}

/// Fills `out[i]` and sums a second result over all `i`, in a fixed order.
pub fn fill_and_sum<T: Send>(out: &mut [T], f: impl Fn(usize) -> (T, f64) + Sync) -> f64 {
    let partial: Vec<f64> = out
        .par_chunks_mut(BLOCK)
        .enumerate()
        .map(|(block, chunk)| {
            let mut sum = 0.0;
            for (k, place) in chunk.iter_mut().enumerate() {
                let (value, term) = f(block * BLOCK + k);
                *place = value;
                sum += term;
            }
            sum
        })
        .collect();
    partial.iter().sum()
}

/// `Σ_i f(i)` for `i < n`, in a fixed order.
pub fn sum(n: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
    let partial: Vec<f64> = (0..n.div_ceil(BLOCK))
        .into_par_iter()
        .map(|block| (block * BLOCK..((block + 1) * BLOCK).min(n)).map(&f).sum())
        .collect();
    partial.iter().sum()
}

/// The largest `f(i)` for `i < n`; NaN wins over every number, an empty range gives -∞.
pub fn max(n: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
    let larger = |a: f64, b: f64| if a.is_nan() || a > b { a } else { b };
    (0..n.div_ceil(BLOCK))
        .into_par_iter()
        .map(|block| {
            (block * BLOCK..((block + 1) * BLOCK).min(n)).map(&f).fold(f64::NEG_INFINITY, larger)
        })
        .reduce(|| f64::NEG_INFINITY, larger)
}
