//! The number type that a law is written for.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number: `f64`, or a [`Dual`](crate::Dual) that carries derivatives along.
///
/// Plain `f64` may stand on the right of every operator (`c * 2.0`); on the left it needs
/// `S::from(2.0)`. Comparisons go through [`value`](Scalar::value), so that a branch follows the
/// value and the derivative is the one of the branch taken.
pub trait Scalar:
    Copy
    + From<f64>
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// The value without derivatives.
    fn value(self) -> f64;

    /// The function with this value and this slope at `self.value()`, by the chain rule.
    ///
    /// A slope of exactly zero gives a zero derivative whatever the argument's derivative, and the other way round.
    #[must_use]
    fn chain(self, value: f64, slope: f64) -> Self;

    /// 0.
    #[must_use]
    #[inline]
    fn zero() -> Self {
        Self::from(0.0)
    }

    /// 1.
    #[must_use]
    #[inline]
    fn one() -> Self {
        Self::from(1.0)
    }

    /// e^x.
    #[must_use]
    #[inline]
    fn exp(self) -> Self {
        let value = self.value().exp();
        self.chain(value, value)
    }

    /// ln x.
    #[must_use]
    #[inline]
    fn ln(self) -> Self {
        let x = self.value();
        self.chain(x.ln(), 1.0 / x)
    }

    /// √x.
    #[must_use]
    #[inline]
    fn sqrt(self) -> Self {
        let value = self.value().sqrt();
        self.chain(value, 0.5 / value)
    }

    /// x^n for a whole n.
    #[must_use]
    #[inline]
    fn powi(self, n: i32) -> Self {
        let x = self.value();
        let slope = if n == 0 { 0.0 } else { f64::from(n) * x.powi(n - 1) };
        self.chain(x.powi(n), slope)
    }

    /// x^a for any real a, x > 0.
    #[must_use]
    #[inline]
    fn powf(self, a: f64) -> Self {
        let x = self.value();
        let slope = if a == 0.0 { 0.0 } else { a * x.powf(a - 1.0) };
        self.chain(x.powf(a), slope)
    }

    /// sin x.
    #[must_use]
    #[inline]
    fn sin(self) -> Self {
        let (sin, cos) = self.value().sin_cos();
        self.chain(sin, cos)
    }

    /// cos x.
    #[must_use]
    #[inline]
    fn cos(self) -> Self {
        let (sin, cos) = self.value().sin_cos();
        self.chain(cos, -sin)
    }

    /// tanh x.
    #[must_use]
    #[inline]
    fn tanh(self) -> Self {
        let value = self.value().tanh();
        self.chain(value, (1.0 - value) * (1.0 + value))
    }

    /// |x|; slope 0 at 0.
    #[must_use]
    #[inline]
    fn abs(self) -> Self {
        let x = self.value();
        let slope = if x > 0.0 {
            1.0
        } else if x < 0.0 {
            -1.0
        } else {
            x * 0.0
        };
        self.chain(x.abs(), slope)
    }

    /// x⁺ = max(x, 0); slope 0 at 0. NaN stays NaN.
    #[must_use]
    #[inline]
    fn positive_part(self) -> Self {
        let x = self.value();
        // Choices, not branches: signs of signals are unpredictable.
        let dropped = x <= 0.0;
        self.chain(if dropped { 0.0 } else { x }, if dropped { 0.0 } else { 1.0 })
    }

    /// 1/(1 + e^-x), without overflow for any x.
    #[must_use]
    #[inline]
    fn logistic(self) -> Self {
        let x = self.value();
        let e = (-x.abs()).exp();
        let value = (if x >= 0.0 { 1.0 } else { e }) / (1.0 + e);
        self.chain(value, e / ((1.0 + e) * (1.0 + e)))
    }
}

impl Scalar for f64 {
    #[inline]
    fn value(self) -> f64 {
        self
    }

    #[inline]
    fn chain(self, value: f64, _slope: f64) -> Self {
        value
    }
}
