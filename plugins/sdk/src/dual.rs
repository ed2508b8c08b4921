//! Forward dual numbers: x + Σ_k ẋ_k ε_k with ε_j ε_k = 0.
//!
//! Arithmetic on them carries N exact directional derivatives along with a value (Griewank &
//! Walther, Evaluating Derivatives, SIAM 2008, chapter 3).

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::Scalar;

/// A value with its derivatives in N directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub value: f64,
    /// Its derivatives.
    pub derivatives: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A constant, or the independent variable of one direction if `direction < N`.
    #[must_use]
    #[inline]
    pub fn variable(value: f64, direction: usize) -> Self {
        let mut derivatives = [0.0; N];
        if let Some(derivative) = derivatives.get_mut(direction) {
            *derivative = 1.0;
        }
        Self { value, derivatives }
    }

    /// A function of one number: its value, and its derivative in a direction by that of the argument.
    #[inline]
    fn unary(self, value: f64, tangent: impl Fn(f64) -> f64) -> Self {
        Self { value, derivatives: self.derivatives.map(tangent) }
    }

    /// A function of two numbers, likewise.
    #[inline]
    fn binary(self, other: Self, value: f64, tangent: impl Fn(f64, f64) -> f64) -> Self {
        let derivatives =
            std::array::from_fn(|k| tangent(self.derivatives[k], other.derivatives[k]));
        Self { value, derivatives }
    }
}

/// A derivative times a factor of the chain rule: 0 where one of them is. The slope of √x at 0 is infinite for what x
/// depends on, and 0 for all else.
#[inline]
fn scaled(derivative: f64, factor: f64) -> f64 {
    // A choice, not a branch: signs of signals are unpredictable.
    if derivative == 0.0 || factor == 0.0 { 0.0 } else { derivative * factor }
}

impl<const N: usize> Scalar for Dual<N> {
    #[inline]
    fn value(self) -> f64 {
        self.value
    }

    #[inline]
    fn chain(self, value: f64, slope: f64) -> Self {
        self.unary(value, |d| scaled(d, slope))
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    #[inline]
    fn from(value: f64) -> Self {
        Self { value, derivatives: [0.0; N] }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        self.unary(-self.value, |d| -d)
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        self.binary(other, self.value + other.value, |a, b| a + b)
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        self.binary(other, self.value - other.value, |a, b| a - b)
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;

    #[inline]
    #[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule is a sum")]
    fn mul(self, other: Self) -> Self {
        let value = self.value * other.value;
        self.binary(other, value, |a, b| scaled(a, other.value) + scaled(b, self.value))
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;

    #[inline]
    fn div(self, other: Self) -> Self {
        let quotient = self.value / other.value;
        let reciprocal = 1.0 / other.value;
        self.binary(other, quotient, |a, b| scaled(a - scaled(b, quotient), reciprocal))
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;

    #[inline]
    fn add(self, other: f64) -> Self {
        Self { value: self.value + other, ..self }
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;

    #[inline]
    fn sub(self, other: f64) -> Self {
        Self { value: self.value - other, ..self }
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;

    #[inline]
    fn mul(self, other: f64) -> Self {
        self.unary(self.value * other, |d| d * other)
    }
}

impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;

    #[inline]
    fn div(self, other: f64) -> Self {
        self.unary(self.value / other, |d| d / other)
    }
}
