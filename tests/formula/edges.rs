//! Derivatives at the edges of the domains of functions, against one-sided differences.

use super::{evaluate, made};
use crate::common::Noise;

/// Parts that compositions are made of, of an argument `#`.
const OUTER: [&str; 17] = [
    "sqrt(#)",
    "(#)^0.5",
    "(#)^1.5",
    "(#)^n",
    "(#)^2",
    "hill(#, 1, 0.5)",
    "hill(#, 1, 2)",
    "exp(-(#))",
    "exp(-1/(#))",
    "log(1 + #)",
    "tanh(1/(#))",
    "1/(1 + 1/(#))",
    "logistic(-1/(#))",
    "min(#, 1)",
    "max(#, -1)",
    "abs(#)",
    "u*(#)",
];
/// Arguments with an edge at 0.
const INNER: [&str; 8] =
    ["pos(u)", "max(u, 0)", "max(0, -u)", "pos(u)*v", "abs(u)", "u^2", "pos(u - v)", "step(u)*u"];
/// The differences that derivatives are compared with.
const STEP: f64 = 1e-7;

/// The rate, its derivative by u, and its one-sided differences.
fn slopes(rate: &str, u: f64, v: f64) -> (f64, f64, [f64; 2]) {
    let us = [u, u - STEP, u + STEP].to_vec();
    let (rates, partials) = evaluate(&made(rate), &[us, vec![v; 3]]);
    let of = |k: usize, sign: f64| sign * (rates[0][k] - rates[0][0]) / STEP;
    (rates[0][0], partials[0][0], [of(1, -1.0), of(2, 1.0)])
}

/// Where the differences on both sides are the same, so is the derivative; where a value has a finite difference on one
/// side, the derivative is not a NaN.
fn check(rate: &str, u: f64, v: f64) {
    let (value, slope, [left, right]) = slopes(rate, u, v);
    if !(value.is_finite() && left.is_finite() && right.is_finite()) {
        return;
    }
    let unit = 1e-3 * (1.0 + left.abs().max(right.abs()));
    assert!(!slope.is_nan(), "{rate} at u = {u}, v = {v}: NaN for {left}, {right}");
    if (left - right).abs() < 0.1 * unit {
        assert!((slope - left).abs() < unit, "{rate} at {u}, {v}: {slope} for {left}, {right}");
    }
}

#[test]
fn derivatives_of_roots_below_zero_are_zero() {
    for rate in
        ["sqrt(pos(u))", "pos(u)^0.5", "sqrt(max(u,0))", "hill(u,1,0.5)", "min(1/pos(u), 5)"]
    {
        for u in [-1.0, -1e-3, -1e-300] {
            let (_, slope, _) = slopes(rate, u, 1.0);
            assert_eq!(slope, 0.0, "{rate} at {u}");
        }
        let (_, slope, [left, right]) = slopes(rate, 0.3, 1.0);
        assert!((slope - 0.5 * (left + right)).abs() < 1e-6, "{rate}: {slope}");
    }
}

#[test]
fn derivatives_of_compositions_are_those_of_their_sides() {
    let mut noise = Noise::new(7);
    for outer in OUTER {
        for inner in INNER {
            for second in ["#", "sqrt(#)", "min(#, 2)", "pos(# - 0.1)"] {
                let rate = second.replace('#', &outer.replace('#', inner));
                for u in [-1.0, 0.0, 0.3, 1.0, noise.number(), 2.0 * noise.number()] {
                    check(&rate, u, 0.7);
                }
            }
        }
    }
}
