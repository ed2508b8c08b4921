//! Four numbers in a 256-bit register.

use std::ops::{Add, Div, Mul, Neg, Sub};

use pulp::{cast, f64x4, x86::V3};

use super::{LANES, Lanes, Simd};

/// Proof that the processor has AVX2.
#[derive(Clone, Copy)]
pub struct Avx(pub V3);

/// One 256-bit register.
#[derive(Clone, Copy)]
pub struct AvxLanes(V3, f64x4);

impl Simd for Avx {
    type Lanes = AvxLanes;

    #[inline(always)]
    fn load(self, [a, b, c, d]: [f64; LANES]) -> AvxLanes {
        AvxLanes(self.0, f64x4(a, b, c, d))
    }

    #[inline(always)]
    fn splat(self, value: f64) -> AvxLanes {
        AvxLanes(self.0, self.0.splat_f64x4(value))
    }

    #[inline(always)]
    fn transpose(self, [a, b, c, d]: [AvxLanes; LANES]) -> [AvxLanes; LANES] {
        let avx = self.0.avx;
        let [a, b, c, d] = [cast(a.1), cast(b.1), cast(c.1), cast(d.1)];
        let (ab, ab_odd) = (avx._mm256_unpacklo_pd(a, b), avx._mm256_unpackhi_pd(a, b));
        let (cd, cd_odd) = (avx._mm256_unpacklo_pd(c, d), avx._mm256_unpackhi_pd(c, d));
        [
            AvxLanes(self.0, cast(avx._mm256_permute2f128_pd::<0x20>(ab, cd))),
            AvxLanes(self.0, cast(avx._mm256_permute2f128_pd::<0x20>(ab_odd, cd_odd))),
            AvxLanes(self.0, cast(avx._mm256_permute2f128_pd::<0x31>(ab, cd))),
            AvxLanes(self.0, cast(avx._mm256_permute2f128_pd::<0x31>(ab_odd, cd_odd))),
        ]
    }
}

impl Lanes for AvxLanes {
    #[inline(always)]
    fn array(self) -> [f64; LANES] {
        let f64x4(a, b, c, d) = self.1;
        [a, b, c, d]
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0, self.0.sqrt_f64x4(self.1))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0, self.0.abs_f64x4(self.1))
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let simd = self.0;
        let sign = simd.and_f64x4(simd.splat_f64x4(-0.0), sign.1);
        Self(simd, simd.or_f64x4(simd.abs_f64x4(self.1), sign))
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0, self.0.min_f64x4(self.1, other.1))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0, self.0.max_f64x4(self.1, other.1))
    }

    #[inline(always)]
    fn select_negative(self, negative: Self, otherwise: Self) -> Self {
        let avx = self.0.avx;
        let [sign, negative, otherwise] = [cast(self.1), cast(negative.1), cast(otherwise.1)];
        Self(self.0, cast(avx._mm256_blendv_pd(otherwise, negative, sign)))
    }
}

macro_rules! operator {
    ($($trait:ident $method:ident $function:ident),*) => {$(
        impl $trait for AvxLanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0, self.0.$function(self.1, other.1))
            }
        }
    )*};
}
operator!(Add add add_f64x4, Sub sub sub_f64x4, Mul mul mul_f64x4, Div div div_f64x4);

impl Neg for AvxLanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0, self.0.xor_f64x4(self.0.splat_f64x4(-0.0), self.1))
    }
}
