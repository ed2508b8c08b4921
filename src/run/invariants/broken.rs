//! A law of nature that a run breaks.

use crate::num::Short;

/// A law of nature that a step breaks.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "{law} does not hold at time {time}: it is off by {}, and [invariants] {key} allows {}; {place}; {advice}",
    if value.fract() == 0.0 { Short(*value).to_string() } else { format!("{value:.3e}") },
    Short(*limit)
)]
pub struct BrokenInvariant {
    /// The law, with the unit of value and limit.
    pub law: String,
    /// Its key in the scene.
    pub key: String,
    /// By how much, as the limit counts.
    pub value: f64,
    /// The limit.
    pub limit: f64,
    /// Where and by what.
    pub place: String,
    /// Time at the end of the step.
    pub time: f64,
    /// What to try.
    pub advice: &'static str,
}
