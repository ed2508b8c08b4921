//! The few number conversions that lose nothing at the sizes this crate works with.
//!
//! Lossy casts are denied by a workspace lint; these are the places where the loss is impossible
//! (or stated), so that every other cast in the crate must be exact.

pub mod checked;

/// A count as a floating-point number; exact up to 2^53.
#[must_use]
#[allow(clippy::cast_precision_loss)]
pub fn real(count: usize) -> f64 {
    count as f64
}

/// A vertex, edge or face number as stored in index arrays.
///
/// Sheets are refused on input before they reach 2^32 entities, so saturation is never seen.
#[must_use]
pub fn index(position: usize) -> u32 {
    u32::try_from(position).unwrap_or(u32::MAX)
}

/// The nearest whole number to a non-negative `value`, saturating; NaN gives 0.
#[must_use]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
pub fn whole(value: f64) -> usize {
    value.round().max(0.0) as usize
}
