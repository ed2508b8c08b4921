//! Four numbers at a time.
//!
//! A kernel is written once, over [`Lanes`], and runs on AVX registers where the processor has
//! them and on plain arrays elsewhere. Both add, multiply, divide and take roots as IEEE 754
//! prescribes and never fuse, so that they give the same bits.

#[cfg(target_arch = "x86_64")]
mod avx;
mod lanes;

use std::f64::consts::PI;
use std::ops::{Add, Div, Mul, Neg, Sub};

pub use lanes::{LANES, Lanes, Simd};

/// Work that [`dispatch`] runs with the best [`Simd`] there is. Implementations must be
/// `#[inline(always)]`, with no [`Lanes`] in closures: what is not inlined is not compiled for the
/// wide registers, and then costs ten times as much.
pub trait Task {
    /// What it gives.
    type Output;

    /// Does it.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Runs `task` with the widest registers that this processor has.
#[inline]
pub fn dispatch<T: Task>(task: T) -> T::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(token) = pulp::x86::V3::try_new() {
        struct OnAvx<T>(pulp::x86::V3, T);
        impl<T: Task> pulp::NullaryFnOnce for OnAvx<T> {
            type Output = T::Output;
            #[inline(always)]
            fn call(self) -> T::Output {
                self.1.run(avx::Avx(self.0))
            }
        }
        return token.vectorize(OnAvx(token, task));
    }
    task.run(Plain)
}

/// Arrays of numbers; the compiler makes of them what it can.
#[derive(Clone, Copy)]
pub struct Plain;

/// Lanes of [`Plain`].
#[derive(Clone, Copy)]
pub struct PlainLanes([f64; LANES]);

impl Simd for Plain {
    type Lanes = PlainLanes;

    #[inline(always)]
    fn load(self, values: [f64; LANES]) -> PlainLanes {
        PlainLanes(values)
    }

    #[inline(always)]
    fn splat(self, value: f64) -> PlainLanes {
        PlainLanes([value; LANES])
    }

    #[inline(always)]
    fn transpose(self, rows: [PlainLanes; LANES]) -> [PlainLanes; LANES] {
        std::array::from_fn(|j| PlainLanes(std::array::from_fn(|i| rows[i].0[j])))
    }
}

impl Lanes for PlainLanes {
    #[inline(always)]
    fn array(self) -> [f64; LANES] {
        self.0
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Self(std::array::from_fn(|k| self.0[k].copysign(sign.0[k])))
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        let smaller = |k: usize| if self.0[k] < other.0[k] { self.0[k] } else { other.0[k] };
        Self(std::array::from_fn(smaller))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        let larger = |k: usize| if self.0[k] > other.0[k] { self.0[k] } else { other.0[k] };
        Self(std::array::from_fn(larger))
    }

    #[inline(always)]
    fn select_negative(self, negative: Self, otherwise: Self) -> Self {
        let chosen = |k: usize| {
            if self.0[k].is_sign_negative() { negative.0[k] } else { otherwise.0[k] }
        };
        Self(std::array::from_fn(chosen))
    }
}

macro_rules! plain_operator {
    ($($trait:ident $method:ident $operator:tt),*) => {$(
        impl $trait for PlainLanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(std::array::from_fn(|k| self.0[k] $operator other.0[k]))
            }
        }
    )*};
}
plain_operator!(Add add +, Sub sub -, Mul mul *, Div div /);

impl Neg for PlainLanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|v| -v))
    }
}

/// `tan π/8`.
const TAN_PI_8: f64 = 0.414_213_562_373_095_03;

/// `atan(√z)/√z` for 0 ≤ z ≤ tan² π/8 by powers of z, the constant 1 apart: interpolated at Chebyshev
/// nodes, relative error 4·10⁻¹⁷.
const ATAN_COEFFICIENTS: [f64; 10] = [
    -0.333_333_333_333_284_4,
    0.199_999_999_988_551_1,
    -0.142_857_141_809_764_67,
    0.111_111_061_804_559_46,
    -0.090_907_730_748_084_14,
    0.076_899_534_963_068_57,
    -0.066_402_339_309_294_08,
    0.056_883_492_268_090_106,
    -0.043_480_522_157_164_62,
    0.021_135_373_157_693_246,
];

/// The angle between 0 and π with this sine ≥ 0 and this cosine, both up to one common factor:
/// `atan2(sine, cosine)`, with an absolute error of a few 10⁻¹⁶.
#[inline(always)]
pub fn angle<S: Simd>(simd: S, sine: S::Lanes, cosine: S::Lanes) -> S::Lanes {
    let adjacent = cosine.abs();
    // From the nearer axis: tan ≤ 1, …
    let [low, high] = [sine.min(adjacent), sine.max(adjacent)];
    // … and from the diagonal where that is nearer still: |tan| ≤ tan π/8.
    let diagonal = low - high * simd.splat(TAN_PI_8);
    let top = diagonal.select_negative(low, low - high);
    let bottom = diagonal.select_negative(high, low + high);
    let offset = diagonal.select_negative(simd.splat(0.0), simd.splat(0.25 * PI));
    let t = top / bottom;
    let square = t * t;
    let mut series = simd.splat(ATAN_COEFFICIENTS[ATAN_COEFFICIENTS.len() - 1]);
    for coefficient in ATAN_COEFFICIENTS[..ATAN_COEFFICIENTS.len() - 1].iter().rev() {
        series = simd.splat(*coefficient) + square * series;
    }
    let from_axis = offset + (t + t * (square * series));
    // From the vertical axis where the sine is larger, mirrored where the cosine is negative.
    let quarter = simd.splat(0.5 * PI);
    let acute = (sine - adjacent).select_negative(from_axis, quarter - from_axis);
    quarter - (quarter - acute).copysign(cosine)
}

/// Four vectors in space.
#[derive(Clone, Copy)]
pub struct Lanes3<L> {
    /// First components.
    pub x: L,
    /// Second components.
    pub y: L,
    /// Third components.
    pub z: L,
}

impl<L: Lanes> Lanes3<L> {
    /// The vectors number `index` of `from`.
    #[inline(always)]
    pub fn gather<S: Simd<Lanes = L>>(simd: S, from: &[crate::Vec3], index: [u32; LANES]) -> Self {
        let [a, b, c, d] = index;
        let (a, b, c, d) =
            (&from[a as usize], &from[b as usize], &from[c as usize], &from[d as usize]);
        let [x, y, z, _] = simd.columns([
            [a.x, a.y, a.z, 0.0],
            [b.x, b.y, b.z, 0.0],
            [c.x, c.y, c.z, 0.0],
            [d.x, d.y, d.z, 0.0],
        ]);
        Self { x, y, z }
    }

    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> L {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Vector product.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    /// Multiplied by a number each.
    #[inline(always)]
    pub fn scale(self, by: L) -> Self {
        Self { x: self.x * by, y: self.y * by, z: self.z * by }
    }

    /// The columns of `[n]×`, which is `n × ·`.
    #[inline(always)]
    pub fn cross_columns<S: Simd<Lanes = L>>(self, simd: S) -> [Self; 3] {
        let zero = simd.splat(0.0);
        let Self { x, y, z } = self;
        [
            Self { x: zero, y: z, z: -y },
            Self { x: -z, y: zero, z: x },
            Self { x: y, y: -x, z: zero },
        ]
    }

    /// As an array.
    #[inline(always)]
    pub fn array(self) -> [L; 3] {
        [self.x, self.y, self.z]
    }

    /// As an array, with a fourth number.
    #[inline(always)]
    pub fn with(self, fourth: L) -> [L; LANES] {
        [self.x, self.y, self.z, fourth]
    }
}

impl<L: Lanes> Add for Lanes3<L> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl<L: Lanes> Sub for Lanes3<L> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl<L: Lanes> Neg for Lanes3<L> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }
}
