//! Four numbers at a time.
//!
//! A kernel is written once, over [`Lanes`], and runs on AVX registers where the processor has
//! them and on plain arrays elsewhere. Both add, multiply, divide and take roots as IEEE 754
//! prescribes and never fuse, so that they give the same bits.

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
}

/// The means to make [`Lanes`].
pub trait Simd: Copy {
    /// Its four numbers.
    type Lanes: Lanes;

    /// Takes four numbers.
    fn load(self, values: [f64; LANES]) -> Self::Lanes;

    /// Four times the same number.
    fn splat(self, value: f64) -> Self::Lanes;

    /// The numbers `index` of `from`.
    #[inline(always)]
    fn gather(self, from: &[f64], [a, b, c, d]: [u32; LANES]) -> Self::Lanes {
        self.load([from[a as usize], from[b as usize], from[c as usize], from[d as usize]])
    }
}

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

#[cfg(target_arch = "x86_64")]
mod avx {
    use super::{Add, Div, LANES, Lanes, Mul, Neg, Simd, Sub};
    use pulp::{f64x4, x86::V3};

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
}

/// `atan t` for 0 ≤ t ≤ 1, to a few units in the last place: the argument is halved twice by
/// `tan(φ/2) = t/(1 + √(1 + t²))`, which leaves `t < 0.199` for the power series.
#[inline(always)]
pub fn atan_unit<S: Simd>(simd: S, t: S::Lanes) -> S::Lanes {
    let one = simd.splat(1.0);
    let t = t / (one + (one + t * t).sqrt());
    let t = t / (one + (one + t * t).sqrt());
    let square = t * t;
    let mut series = simd.splat(1.0 / 21.0);
    for denominator in [19.0, 17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0, 1.0] {
        series = simd.splat(1.0 / denominator) - square * series;
    }
    simd.splat(4.0) * t * series
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
        Self {
            x: simd.load([a.x, b.x, c.x, d.x]),
            y: simd.load([a.y, b.y, c.y, d.y]),
            z: simd.load([a.z, b.z, c.z, d.z]),
        }
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

    /// As an array of components.
    #[inline(always)]
    pub fn components(self) -> [L; 3] {
        [self.x, self.y, self.z]
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
