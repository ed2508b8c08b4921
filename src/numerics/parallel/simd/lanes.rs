//! What four numbers at a time can do.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Numbers in a [`Lanes`].
pub const LANES: usize = 4;

/// Four numbers that go through the same operations.
pub trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The four numbers.
    fn array(self) -> [f64; LANES];

    /// Square roots.
    fn sqrt(self) -> Self;

    /// Absolute values.
    fn abs(self) -> Self;

    /// The same sizes with the signs of `sign`.
    fn copysign(self, sign: Self) -> Self;

    /// The smaller of two.
    fn min(self, other: Self) -> Self;

    /// The larger of two.
    fn max(self, other: Self) -> Self;

    /// `negative` where this has the sign bit, `otherwise` elsewhere.
    fn select_negative(self, negative: Self, otherwise: Self) -> Self;
}

/// The means to make [`Lanes`].
pub trait Simd: Copy {
    /// Its four numbers.
    type Lanes: Lanes;

    /// Takes four numbers.
    fn load(self, values: [f64; LANES]) -> Self::Lanes;

    /// Four times the same number.
    fn splat(self, value: f64) -> Self::Lanes;

    /// Four by four numbers with rows and columns exchanged.
    fn transpose(self, rows: [Self::Lanes; LANES]) -> [Self::Lanes; LANES];

    /// Four numbers each of four things: the first numbers of all, the second, …
    #[inline(always)]
    fn columns(self, [a, b, c, d]: [[f64; LANES]; LANES]) -> [Self::Lanes; LANES] {
        self.transpose([self.load(a), self.load(b), self.load(c), self.load(d)])
    }

    /// The numbers `index` of `from`.
    #[inline(always)]
    fn gather(self, from: &[f64], [a, b, c, d]: [u32; LANES]) -> Self::Lanes {
        self.load([from[a as usize], from[b as usize], from[c as usize], from[d as usize]])
    }
}
