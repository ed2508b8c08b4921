//! Times as people say them.

use super::Range;
use crate::output::Predicted;

/// Ends of a range that differ by this factor at most are one number.
const SAME: f64 = 1.5;

/// Units and their seconds.
const UNITS: [(&str, f64); 4] = [("s", 1.0), ("min", 60.0), ("h", 3600.0), ("d", 86400.0)];

/// Times below this are not told apart, s.
pub const NOTHING: f64 = 0.1;

/// `less than 0.1 s`, `0.4 s`, `57 s`, `3.1 min`, `45 min`, `2.5 h`, `4 d`: two significant figures at most.
#[must_use]
pub fn duration(seconds: f64) -> String {
    if seconds < NOTHING {
        return format!("less than {NOTHING} s");
    }
    let (value, unit) = in_units(seconds, unit_of(seconds));
    format!("{value} {unit}")
}

/// `2 to 4 min`, or one duration where that is as good.
#[must_use]
pub fn between(least: f64, most: f64) -> String {
    let unit = unit_of(most);
    let ((low, _), (high, name)) = (in_units(least, unit), in_units(most, unit));
    if low == high { format!("{high} {name}") } else { format!("{low} to {high} {name}") }
}

/// `about 40 s`, or `about 40 s (25 to 80 s)` where that is less certain.
#[must_use]
pub fn about(range: Range) -> String {
    let likely = duration(range.likely);
    if range.likely < NOTHING {
        return likely;
    }
    if range.most <= SAME * range.least {
        return format!("about {likely}");
    }
    format!("about {likely} ({})", between(range.least, range.most))
}

/// `about 40 s`, or `about 2 to 4 min` where that is less certain.
#[must_use]
pub fn shortly(range: Range) -> String {
    if range.most <= SAME * range.least {
        return format!("about {}", duration(range.likely));
    }
    format!("about {}", between(range.least, range.most))
}

/// How far off the prediction of a run was that is over.
#[must_use]
pub fn judged(predicted: &Predicted) -> String {
    let Predicted { seconds, least_seconds, most_seconds, after_seconds, took, .. } = *predicted;
    let range = Range { likely: seconds, least: least_seconds, most: most_seconds };
    let mut text = format!("predicted after {}: {}", duration(after_seconds), about(range));
    if let Some(took) = took {
        text += &format!(
            "; the run took {} ({:.2} times the prediction)",
            duration(took.seconds),
            took.seconds / seconds
        );
    }
    text
}

/// The largest unit of which there are one and a half.
fn unit_of(seconds: f64) -> usize {
    UNITS.iter().rposition(|unit| two_figures(seconds) >= 1.5 * unit.1).unwrap_or(0)
}

fn in_units(seconds: f64, unit: usize) -> (f64, &'static str) {
    let (name, size) = UNITS[unit];
    let value = two_figures(seconds / size);
    // Tenths of a second are below the accuracy of a forecast.
    let value = if unit == 0 && value >= 1.0 { value.round() } else { value };
    (value, name)
}

/// `value` rounded to two significant figures, and to tenths.
fn two_figures(value: f64) -> f64 {
    let rounded: f64 = format!("{value:.1e}").parse().unwrap_or(value);
    (10.0 * rounded).round() / 10.0
}
