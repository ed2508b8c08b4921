//! Parallel loops whose results do not depend on the number of threads.
//!
//! Every loop writes to places that belong to one index (a gather, never a scatter), and every sum
//! is taken over fixed blocks that are added in a fixed order. So the same input gives the same bits
//! on one thread and on many. Nothing here allocates.

pub mod element_blocks;
pub mod simd;
pub mod vectors;

use rayon::prelude::*;

/// Entries per block: large enough to hide the cost of handing out work, small enough to share
/// a sheet of a few thousand vertices over a few cores.
pub const BLOCK: usize = 512;

/// Fills `out[i] = f(i)`.
pub fn fill<T: Send>(out: &mut [T], f: impl Fn(usize) -> T + Sync) {
    in_blocks(out, BLOCK, &|first, chunk| {
        for (k, place) in chunk.iter_mut().enumerate() {
            *place = f(first + k);
        }
    });
}

/// Changes every `out[i]` in place.
pub fn update<T: Send>(out: &mut [T], f: impl Fn(usize, &mut T) + Sync) {
    in_blocks(out, BLOCK, &|first, chunk| {
        for (k, place) in chunk.iter_mut().enumerate() {
            f(first + k, place);
        }
    });
}

/// Hands out the blocks of `out` of that `size`, each with the index of its first entry. Compiled once
/// for each T, not for each loop.
fn in_blocks<T: Send>(out: &mut [T], size: usize, f: &(dyn Fn(usize, &mut [T]) + Sync)) {
    out.par_chunks_mut(size).enumerate().for_each(|(block, chunk)| f(block * size, chunk));
}

/// Fills `out[i]` and sums a second result over all `i`, in a fixed order.
pub fn fill_and_sum<T: Send>(out: &mut [T], f: impl Fn(usize) -> (T, f64) + Sync) -> f64 {
    fn halves<T: Send>(
        out: &mut [T],
        first: usize,
        f: &(dyn Fn(usize, &mut [T]) -> f64 + Sync),
    ) -> f64 {
        if out.len() <= BLOCK {
            return f(first, out);
        }
        let middle = halfway(out.len());
        let (low, high) = out.split_at_mut(middle);
        let (a, b) = rayon::join(|| halves(low, first, f), || halves(high, first + middle, f));
        a + b
    }
    halves(out, 0, &|first, chunk| {
        let mut sum = 0.0;
        for (k, place) in chunk.iter_mut().enumerate() {
            let (value, term) = f(first + k);
            *place = value;
            sum += term;
        }
        sum
    })
}

/// `Σ_i f(i)` for `i < n`, in a fixed order.
pub fn sum(n: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
    let block = |b: usize| (b * BLOCK..((b + 1) * BLOCK).min(n)).map(&f).sum();
    reduce(n.div_ceil(BLOCK), &block, &|a, b| a + b).unwrap_or(0.0)
}

/// The largest `f(i)` for `i < n`; NaN wins over every number, an empty range gives -∞.
pub fn max(n: usize, f: impl Fn(usize) -> f64 + Sync) -> f64 {
    let larger = |a: f64, b: f64| if a.is_nan() || a > b { a } else { b };
    let block =
        |b: usize| (b * BLOCK..((b + 1) * BLOCK).min(n)).map(&f).fold(f64::NEG_INFINITY, larger);
    reduce(n.div_ceil(BLOCK), &block, &larger).unwrap_or(f64::NEG_INFINITY)
}

/// Combines `f(0)`, `f(1)`, … `f(n-1)` pairwise in a fixed tree; nothing for n = 0.
pub fn reduce<T: Send>(
    n: usize,
    f: &(dyn Fn(usize) -> T + Sync),
    combine: &(dyn Fn(T, T) -> T + Sync),
) -> Option<T> {
    fn tree<T: Send>(
        first: usize,
        n: usize,
        f: &(dyn Fn(usize) -> T + Sync),
        combine: &(dyn Fn(T, T) -> T + Sync),
    ) -> T {
        if n == 1 {
            return f(first);
        }
        let half = n / 2;
        let (a, b) = rayon::join(
            || tree(first, half, f, combine),
            || tree(first + half, n - half, f, combine),
        );
        combine(a, b)
    }
    (n > 0).then(|| tree(0, n, f, combine))
}

/// Half of `n`, up to a multiple of the block size.
fn halfway(n: usize) -> usize {
    n.div_ceil(BLOCK).div_ceil(2) * BLOCK
}
