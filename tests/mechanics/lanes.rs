//! Four numbers at a time: the same as one after the other.

use rumple_numerics::parallel::simd::{Lanes, Plain, Simd, Task, angle, dispatch};

use crate::common::Noise;

/// Angles of four sines and cosines.
struct Angles<'a> {
    sine: &'a [f64; 4],
    cosine: &'a [f64; 4],
}

impl Task for Angles<'_> {
    type Output = [f64; 4];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> [f64; 4] {
        angle(simd, simd.load(*self.sine), simd.load(*self.cosine)).array()
    }
}

#[test]
fn angles_are_those_of_atan2_with_and_without_wide_registers() {
    let mut noise = Noise::new(3);
    let check = |sine: [f64; 4], cosine: [f64; 4]| {
        let wide = dispatch(Angles { sine: &sine, cosine: &cosine });
        let plain = Angles { sine: &sine, cosine: &cosine }.run(Plain);
        for k in 0..4 {
            let exact = sine[k].atan2(cosine[k]);
            assert_eq!(wide[k].to_bits(), plain[k].to_bits(), "{} {}", sine[k], cosine[k]);
            assert!(
                (wide[k] - exact).abs() < 1e-15,
                "atan2({}, {}) = {exact}, not {}",
                sine[k],
                cosine[k],
                wide[k]
            );
        }
    };
    for _ in 0..20_000 {
        let size: [f64; 4] = std::array::from_fn(|_| 10.0_f64.powf(8.0 * noise.number()));
        let sine: [f64; 4] = std::array::from_fn(|k| noise.number().abs() * size[k]);
        check(sine, std::array::from_fn(|_| noise.number()));
    }
    check([1.0, 1.0, 1e-300, 0.0], [1.0, -1.0, -1.0, 1.0]);
    check([1.0, 1.0, 1e-9, 1e9], [0.0, 1e-300, 1.0, -1.0]);
}

/// Rows of a 4×4 matrix as columns.
struct Transposed<'a>(&'a [[f64; 4]; 4]);

impl Task for Transposed<'_> {
    type Output = [[f64; 4]; 4];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> [[f64; 4]; 4] {
        simd.columns(*self.0).map(Lanes::array)
    }
}

#[test]
fn rows_become_columns() {
    let rows: [[f64; 4]; 4] = std::array::from_fn(|i| std::array::from_fn(|j| (10 * i + j) as f64));
    for columns in [dispatch(Transposed(&rows)), Transposed(&rows).run(Plain)] {
        for i in 0..4 {
            for j in 0..4 {
                assert_eq!(columns[j][i], rows[i][j]);
            }
        }
    }
}
