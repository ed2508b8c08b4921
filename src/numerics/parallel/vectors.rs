//! Products and sums of many long vectors with one, each read once.

use super::simd::{LANES, Lanes, Simd, Task, dispatch};
use super::{in_blocks, reduce};

/// Numbers per block: one block of the common vector stays in the first-level cache.
const BLOCK: usize = 2048;
/// Vectors at a time.
const GROUP: usize = 4;

/// The products `v · w` for every `v` of `vectors`, in the order they come.
pub fn dots<'a>(vectors: impl Iterator<Item = &'a [f64]>, w: &[f64]) -> Vec<f64> {
    let vectors: Vec<&[f64]> = vectors.collect();
    let mut all = Vec::with_capacity(vectors.len() + GROUP);
    for some in vectors.chunks(GROUP) {
        let four: [&[f64]; GROUP] = std::array::from_fn(|k| some[k.min(some.len() - 1)]);
        let block = |b: usize| {
            let range = b * BLOCK..((b + 1) * BLOCK).min(w.len());
            dispatch(Dots { vectors: four.map(|v| &v[range.clone()]), with: &w[range.clone()] })
        };
        let add = |a: [f64; GROUP], b: [f64; GROUP]| std::array::from_fn(|k| a[k] + b[k]);
        let sums = reduce(w.len().div_ceil(BLOCK), &block, &add).unwrap_or_default();
        all.extend(&sums[..some.len()]);
    }
    all
}

/// Adds `Σ_k c_k v_k` to `out`, for the pairs (c, v) of `terms`.
pub fn add_all<'a>(out: &mut [f64], terms: impl Iterator<Item = (f64, &'a [f64])>) {
    let terms: Vec<(f64, &[f64])> = terms.collect();
    in_blocks(out, BLOCK, &|first, chunk| {
        let range = first..first + chunk.len();
        for some in terms.chunks(GROUP) {
            // What is missing of four is a vector with the coefficient 0.
            let four: [&[f64]; GROUP] =
                std::array::from_fn(|k| &some[k.min(some.len() - 1)].1[range.clone()]);
            let by = std::array::from_fn(|k| some.get(k).map_or(0.0, |(c, _)| *c));
            dispatch(Sums { by, vectors: four, out: chunk });
        }
    });
}

struct Dots<'a> {
    vectors: [&'a [f64]; GROUP],
    with: &'a [f64],
}

impl Task for Dots<'_> {
    type Output = [f64; GROUP];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> [f64; GROUP] {
        let (with, rest) = self.with.as_chunks::<LANES>();
        let [a, b, c, d] = self.vectors.map(|v| v.as_chunks::<LANES>().0);
        let zero = simd.splat(0.0);
        let (mut p, mut q, mut r, mut s) = (zero, zero, zero, zero);
        for ((((w, a), b), c), d) in with.iter().zip(a).zip(b).zip(c).zip(d) {
            let w = simd.load(*w);
            p = p + simd.load(*a) * w;
            q = q + simd.load(*b) * w;
            r = r + simd.load(*c) * w;
            s = s + simd.load(*d) * w;
        }
        let mut sums = [0.0; GROUP];
        let parts = [p.array(), q.array(), r.array(), s.array()];
        let start = self.with.len() - rest.len();
        for k in 0..GROUP {
            let [a, b, c, d] = parts[k];
            sums[k] = (a + b) + (c + d);
            for (v, w) in self.vectors[k][start..].iter().zip(rest) {
                sums[k] += v * w;
            }
        }
        sums
    }
}

struct Sums<'a, 'b> {
    by: [f64; GROUP],
    vectors: [&'a [f64]; GROUP],
    out: &'b mut [f64],
}

impl Task for Sums<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let start = self.out.len() / LANES * LANES;
        let (out, rest) = self.out.as_chunks_mut::<LANES>();
        let [a, b, c, d] = self.vectors.map(|v| v.as_chunks::<LANES>().0);
        let [p, q, r, s] = self.by;
        let (p, q, r, s) = (simd.splat(p), simd.splat(q), simd.splat(r), simd.splat(s));
        for ((((out, a), b), c), d) in out.iter_mut().zip(a).zip(b).zip(c).zip(d) {
            let sum = p * simd.load(*a) + q * simd.load(*b) + r * simd.load(*c) + s * simd.load(*d);
            *out = (simd.load(*out) + sum).array();
        }
        for (k, out) in rest.iter_mut().enumerate() {
            for (by, v) in self.by.iter().zip(self.vectors) {
                *out += by * v[start + k];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::real;

    /// Of lengths that fill neither registers nor blocks.
    fn vector(k: usize) -> Vec<f64> {
        (0..2 * BLOCK + 7).map(|i| real((i * (k + 3)) % 17) - 8.0).collect()
    }

    #[test]
    fn products_and_sums_are_those_of_one_at_a_time() {
        let all: Vec<Vec<f64>> = (0..6).map(vector).collect();
        let w = vector(9);
        let products = dots(all.iter().map(Vec::as_slice), &w);
        assert_eq!(products.len(), 6);
        for (v, product) in all.iter().zip(&products) {
            // Whole numbers: no round-off.
            let expected: f64 = v.iter().zip(&w).map(|(v, w)| v * w).sum();
            assert_eq!(*product, expected);
        }
        let mut sum = w.clone();
        add_all(&mut sum, all.iter().enumerate().map(|(k, v)| (real(k) - 2.0, v.as_slice())));
        for (i, sum) in sum.iter().enumerate() {
            let more: f64 = (0..6).map(|k| (real(k) - 2.0) * all[k][i]).sum();
            assert_eq!(*sum, w[i] + more);
        }
        assert!(dots(std::iter::empty(), &w).is_empty());
    }
}
