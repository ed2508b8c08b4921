//! The few number conversions that lose nothing at the sizes this crate works with.
//!
//! Lossy casts are denied by a workspace lint; these are the places where the loss is impossible
//! (or stated), so that every other cast in the crate must be exact.

pub mod checked;

use std::fmt;

/// A count as a floating-point number; exact up to 2^53.
#[must_use]
#[allow(clippy::cast_precision_loss)]
#[inline]
pub fn real(count: usize) -> f64 {
    count as f64
}

/// A count with its noun, in the singular or the plural.
#[must_use]
pub fn plural(count: usize, one: &str, more: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { more })
}

/// A vertex, edge or face number as stored in index arrays.
///
/// Sheets are refused on input before they reach 2^32 entities, so saturation is never seen.
#[must_use]
#[inline]
pub fn index(position: usize) -> u32 {
    u32::try_from(position).unwrap_or(u32::MAX)
}

/// The nearest whole number to a non-negative `value`, saturating; NaN gives 0.
#[must_use]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
#[inline]
pub fn whole(value: f64) -> usize {
    value.round().max(0.0) as usize
}

/// In single precision, where memory counts for more than digits; 0 for what is too small for all digits.
#[must_use]
#[inline]
#[allow(clippy::cast_possible_truncation)]
pub fn single(value: f64) -> f32 {
    if value.abs() < f64::from(f32::MIN_POSITIVE) { 0.0 } else { value as f32 }
}

/// The number with twelve digits that is nearest: 1e-4 where a quotient is 0.9999999999999999e-4.
#[must_use]
pub fn decimal(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

/// A number in messages: exact, and with a power of ten where it would have many zeros.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Short(pub f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.0.abs();
        if size == 0.0 || !size.is_finite() || (1e-5..1e9).contains(&size) {
            write!(f, "{}", self.0)
        } else {
            write!(f, "{:e}", self.0)
        }
    }
}

/// Whether no value is infinite or NaN.
#[must_use]
#[inline]
pub fn all_finite(values: &[f64]) -> bool {
    // Zero times what is not finite is NaN.
    none(values, |value| value * 0.0)
}

/// Whether no value is infinite, NaN or less than `least`.
#[must_use]
#[inline]
pub fn all_finite_from(values: &[f64], least: f64) -> bool {
    none(values, |value| value * 0.0 + if value < least { 1.0 } else { 0.0 })
}

/// Whether no value has a fault, which is zero or else positive or NaN. It inspects all of them
/// without short cuts, so that the common case is a few vector instructions.
fn none(values: &[f64], fault: impl Fn(f64) -> f64) -> bool {
    // So few are inspected faster one by one.
    if values.len() < 8 {
        return values.iter().all(|value| fault(*value) == 0.0);
    }
    let mut sums = [0.0; 8];
    let (chunks, rest) = values.as_chunks::<8>();
    for chunk in chunks {
        for (sum, value) in sums.iter_mut().zip(chunk) {
            *sum += fault(*value);
        }
    }
    sums.into_iter().chain(rest.iter().map(|value| fault(*value))).sum::<f64>() == 0.0
}

#[cfg(test)]
mod tests {
    use super::{Short, all_finite, all_finite_from};

    #[test]
    fn numbers_in_messages_are_short_and_exact() {
        let cases = [
            (0.0, "0"),
            (-2.0, "-2"),
            (20000.0, "20000"),
            (0.1, "0.1"),
            (1e-200, "1e-200"),
            (1e308, "1e308"),
            (-1.5e-7, "-1.5e-7"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
        ];
        for (number, text) in cases {
            assert_eq!(Short(number).to_string(), text);
        }
    }

    #[test]
    fn what_is_not_finite_is_found_wherever_it_stands() {
        for length in [0, 1, 7, 8, 9, 100] {
            let mut values = vec![-f64::MAX; length];
            assert!(all_finite(&values));
            for at in 0..length {
                for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                    values[at] = bad;
                    assert!(!all_finite(&values), "{bad} at {at} of {length}");
                    assert!(!all_finite_from(&values, f64::MIN), "{bad} at {at} of {length}");
                }
                values[at] = 1.0;
            }
            assert!(all_finite_from(&values, 1.0));
            for at in 0..length {
                values[at] = 0.5;
                assert!(!all_finite_from(&values, 1.0), "{at} of {length}");
                values[at] = 1.0;
            }
        }
    }
}
