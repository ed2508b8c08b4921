//! Derivatives of every function of a scalar, against differences and known values.

use rumple_plugin_sdk::{Dual, Scalar};

/// A function written once for both number types.
macro_rules! functions {
    ($($name:literal: $x:ident => $body:expr;)*) => {
        [$(($name, (|$x: f64| $body) as fn(f64) -> f64,
            (|$x: Dual<1>| $body) as fn(Dual<1>) -> Dual<1>)),*]
    };
}

#[test]
fn derivatives_match_differences() {
    let functions = functions! {
        "exp": x => x.exp();
        "ln": x => Scalar::ln(x);
        "sqrt": x => Scalar::sqrt(x);
        "powi": x => Scalar::powi(x, -3);
        "powf": x => Scalar::powf(x, 2.5);
        "sin": x => Scalar::sin(x);
        "cos": x => Scalar::cos(x);
        "tanh": x => Scalar::tanh(x);
        "abs": x => Scalar::abs(-x);
        "positive part": x => (x - 0.5).positive_part();
        "logistic": x => ((x - 0.7) * 5.0).logistic();
        "quotient": x => (x * x - 2.0) / (x + 1.0);
        "mixed": x => (x / 3.0 + 2.0) * x - x.exp() * 0.5;
    };
    for (name, value, dual) in functions {
        for x in [0.2, 0.9, 3.0] {
            let result = dual(Dual::variable(x, 0));
            assert_eq!(result.value.to_bits(), value(x).to_bits(), "{name} at {x}");
            let h = 1e-5;
            let difference = (value(x + h) - value(x - h)) / (2.0 * h);
            let error = (result.derivatives[0] - difference).abs();
            assert!(error < 1e-7 * difference.abs().max(1.0), "{name} at {x}: {error:e}");
        }
    }
}

#[test]
fn logistic_neither_overflows_nor_loses_its_tail() {
    for x in [-1e308, -1e3, -40.0, 0.0, 40.0, 1e3, 1e308, f64::INFINITY, f64::NEG_INFINITY] {
        let y = Dual::<1>::variable(x, 0).logistic();
        assert!((0.0..=1.0).contains(&y.value) && y.derivatives[0].is_finite(), "{x}: {y:?}");
    }
    let tail = 40.0.logistic();
    assert_eq!(tail, 1.0);
    let slope = Dual::<1>::variable(40.0, 0).logistic().derivatives[0];
    assert!((slope / (-40.0_f64).exp() - 1.0).abs() < 1e-14, "{slope:e}");
}

#[test]
fn kinks_and_nan() {
    assert_eq!(Dual::<1>::variable(0.0, 0).positive_part(), Dual::from(0.0));
    assert_eq!(Dual::<1>::variable(0.0, 0).abs().derivatives, [0.0]);
    assert!(f64::NAN.positive_part().is_nan());
    assert_eq!(Dual::<2>::variable(1.5, 1).derivatives, [0.0, 1.0]);
    assert_eq!(Dual::<2>::variable(1.5, 2).derivatives, [0.0, 0.0]);
}

#[test]
fn an_infinite_slope_is_that_of_what_the_root_depends_on() {
    for root in [Dual::<2>::variable(0.0, 1).sqrt(), Dual::variable(0.0, 1).powf(0.5)] {
        assert_eq!(root.derivatives, [0.0, f64::INFINITY]);
    }
}

/// A function of an argument that does not change has the slope 0.
#[test]
fn derivatives_at_the_edges_of_domains() {
    let functions = functions! {
        "root": x => Scalar::sqrt(Scalar::positive_part(x));
        "power": x => Scalar::powf(Scalar::positive_part(x), 0.5);
        "reciprocal": x => Scalar::exp(-((x * 0.0 + 1.0) / Scalar::positive_part(x)));
        "saturation": x => (x * 0.0 + 1.0) / ((x * 0.0 + 1.0) / Scalar::positive_part(x) + 1.0);
        "times itself": x => Scalar::positive_part(x) * Scalar::sqrt(Scalar::positive_part(x));
        "quotient": x => Scalar::positive_part(x) / (Scalar::sqrt(Scalar::positive_part(x)) + 1.0);
    };
    for (name, value, dual) in functions {
        for x in [-1.0, -1e-300, 0.0, 0.3] {
            let (h, result) = (1e-7, dual(Dual::variable(x, 0)));
            let left = (value(x) - value(x - h)) / h;
            let right = (value(x + h) - value(x)) / h;
            assert!(!result.derivatives[0].is_nan(), "{name} at {x}");
            if (left - right).abs() < 1e-5 {
                assert!((result.derivatives[0] - left).abs() < 1e-5, "{name} at {x}: {result:?}");
            }
        }
    }
}
