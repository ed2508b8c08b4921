//! Interval extensions of operations: bounds of their values while their operands vary.
//!
//! Bounds are not rounded outwards: the test whether 0 lies in an interval allows for round-off
//! ([`Interval::may_be_zero`]).
//!
//! Reference: R. E. Moore, R. B. Kearfott & M. J. Cloud, Introduction to Interval Analysis (SIAM 2009),
//! doi:10.1137/1.9780898717716.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::graph::Op;

/// All numbers from `low` to `high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Interval {
    pub(super) low: f64,
    pub(super) high: f64,
}

/// Round-off of a bound, relative to the larger of the two.
const ROUNDING: f64 = 1e-14;

impl Interval {
    /// Every number.
    pub(super) const WHOLE: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };

    /// One number; every number where that is none.
    pub(super) fn point(value: f64) -> Self {
        Self::new(value, value)
    }

    /// Between these bounds; every number where one of them is none.
    pub(super) fn new(low: f64, high: f64) -> Self {
        if low <= high { Self { low, high } } else { Self::WHOLE }
    }

    pub(super) fn middle(self) -> f64 {
        0.5 * self.low + 0.5 * self.high
    }

    pub(super) fn contains_zero(self) -> bool {
        self.low <= 0.0 && self.high >= 0.0
    }

    /// Whether a function with these bounds may be 0, round-off included.
    pub(super) fn may_be_zero(self) -> bool {
        let rounding = ROUNDING * self.low.abs().max(self.high.abs());
        // Bounds without end say nothing.
        !(self.low > rounding || self.high < -rounding)
    }

    pub(super) fn add(self, other: Self) -> Self {
        Self::new(self.low + other.low, self.high + other.high)
    }

    pub(super) fn multiply(self, other: Self) -> Self {
        self.corners(other, |x, y| x * y)
    }

    /// The bounds of a function that is monotone in each of two operands.
    fn corners(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let all = [
            f(self.low, other.low),
            f(self.low, other.high),
            f(self.high, other.low),
            f(self.high, other.high),
        ];
        if all.iter().any(|value| value.is_nan()) {
            return Self::WHOLE;
        }
        let (low, high) = (f64::INFINITY, f64::NEG_INFINITY);
        Self {
            low: all.into_iter().fold(low, f64::min),
            high: all.into_iter().fold(high, f64::max),
        }
    }

    /// `x^n`.
    fn power(self, n: i32) -> Self {
        let (a, b) = (self.low.powi(n), self.high.powi(n));
        match (self.contains_zero(), n % 2 == 0) {
            (true, _) if n < 0 => Self::WHOLE,
            (true, true) => Self::new(0.0, a.max(b)),
            _ => Self::new(a.min(b), a.max(b)),
        }
    }

    /// `sin(x + shift)`.
    fn sine(self, shift: f64) -> Self {
        let (low, high) = (self.low + shift, self.high + shift);
        if !(high - low < TAU) {
            return Self { low: -1.0, high: 1.0 };
        }
        let passes = |peak: f64| ((low - peak) / TAU).ceil() <= (high - peak) / TAU;
        let (a, b) = (low.sin(), high.sin());
        let least = if passes(-FRAC_PI_2) { -1.0 } else { a.min(b) };
        let most = if passes(FRAC_PI_2) { 1.0 } else { a.max(b) };
        Self::new(least, most)
    }
}

impl Op {
    /// Bounds of its value for operands between these.
    pub(super) fn bounds(self, a: Interval, b: Interval) -> Interval {
        let increasing = || Interval::new(self.apply(a.low, 0.0), self.apply(a.high, 0.0));
        match self {
            Self::Input(_) => Interval::WHOLE,
            Self::Constant(value) => Interval::point(value),
            Self::Add(..) => a.add(b),
            Self::Subtract(..) => Interval::new(a.low - b.high, a.high - b.low),
            Self::Chain(..) if [a, b].contains(&Interval::point(0.0)) => Interval::point(0.0),
            // As a product of two operands a square would have negative values.
            Self::Multiply(x, y) if x == y => a.power(2),
            Self::Multiply(..) | Self::Chain(..) => a.multiply(b),
            Self::Divide(..) if b.contains_zero() => Interval::WHOLE,
            Self::Divide(..) => a.corners(b, |x, y| x / y),
            Self::PowerI(_, n) => a.power(n),
            Self::Power(..) if a.low > 0.0 || a.low == 0.0 && b.low > 0.0 => {
                a.corners(b, f64::powf)
            }
            Self::Power(..) if a.low == a.high && b.low == b.high => {
                Interval::point(a.low.powf(b.low))
            }
            Self::Power(..) => Interval::WHOLE,
            Self::Negative(_) => Interval::new(-a.high, -a.low),
            Self::Exp(_)
            | Self::Log(_)
            | Self::Sqrt(_)
            | Self::Tanh(_)
            | Self::Sign(_)
            | Self::Pos(_)
            | Self::Step(_)
            | Self::Logistic(_) => increasing(),
            Self::Sin(_) => a.sine(0.0),
            Self::Cos(_) => a.sine(FRAC_PI_2),
            Self::Abs(_) if a.contains_zero() => Interval::new(0.0, a.high.max(-a.low)),
            Self::Abs(_) => {
                Interval::new(a.low.abs().min(a.high.abs()), a.high.abs().max(a.low.abs()))
            }
            Self::Min(..) => Interval::new(a.low.min(b.low), a.high.min(b.high)),
            Self::Max(..) => Interval::new(a.low.max(b.low), a.high.max(b.high)),
        }
    }
}
