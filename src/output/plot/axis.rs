//! Axes: what they reach, and where they have marks.

use std::ops::Range;

use plotters::coord::combinators::{LogCoord, WithKeyPoints};
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;
use rumple_numerics::num::{real, whole};

/// The coordinate along one side.
pub(super) enum Axis {
    Linear(RangedCoordf64),
    Logarithmic(WithKeyPoints<LogCoord<f64>>),
}

impl Ranged for Axis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        match self {
            Self::Linear(axis) => axis.map(value, limit),
            Self::Logarithmic(axis) => axis.map(value, limit),
        }
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        match self {
            Self::Linear(axis) => axis.key_points(hint),
            Self::Logarithmic(axis) => axis.key_points(hint),
        }
    }

    fn range(&self) -> Range<f64> {
        match self {
            Self::Linear(axis) => axis.range(),
            Self::Logarithmic(axis) => axis.range(),
        }
    }
}

/// Whether an axis has a place for `value`.
pub(super) fn reached(value: f64, logarithmic: bool) -> bool {
    value.is_finite() && (!logarithmic || value > 0.0)
}

/// Marks of a logarithmic axis: at powers of ten where there are some, at 1, 2 and 5 times these
/// where there are few.
pub(super) fn ticks(range: &Range<f64>) -> Vec<f64> {
    let decades = (range.end / range.start).log10();
    let digits: &[f64] = if decades > 2.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
    let every = if decades > 2.5 { decades / MAX_TICKS } else { 1.0 }.ceil();
    let first = range.start.log10().floor();
    let count = whole((range.end.log10() - first).max(0.0)) + 1;
    let powers = (0..count).map(|k| first + real(k)).filter(|p| p.rem_euclid(every) == 0.0);
    let all = powers.flat_map(|p| digits.iter().map(move |d| d * 10f64.powf(p)));
    // Edges are ticks themselves, but for round-off.
    let room = 1.0 + 1e-9;
    all.filter(|v| *v * room >= range.start && *v <= range.end * room).collect()
}

/// Most marks of a logarithmic axis over many decades.
const MAX_TICKS: f64 = 7.0;

/// The range of `values` with some room around it; a logarithmic one ends at ticks.
pub(super) fn range(values: impl Iterator<Item = f64>, logarithmic: bool) -> Range<f64> {
    let (least, most) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| (l.min(v), m.max(v)));
    match (least <= most, logarithmic) {
        (false, true) => 0.1..1.0,
        (false, false) => 0.0..1.0,
        (true, true) => {
            let down = round((least / 1.5).max(f64::MIN_POSITIVE), false);
            down..round((most * 1.5).min(f64::MAX), true)
        }
        (true, false) => {
            let room = 0.05 * (most - least);
            let room = if room > 0.0 { room } else { 0.5 * most.abs().max(1e-3) };
            least - room..most + room
        }
    }
}

/// `value` rounded to 1, 2 or 5 times a power of ten, down or up.
fn round(value: f64, up: bool) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|s| s * power);
    let rounded = match up {
        true => steps.iter().find(|s| **s >= value),
        false => steps.iter().rfind(|s| **s <= value),
    };
    let rounded = rounded.copied().unwrap_or(value);
    if rounded > 0.0 && rounded.is_finite() { rounded } else { value }
}
