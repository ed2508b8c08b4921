//! Times in words.

use crate::output::{Predicted, Took};

/// Ends of a range that differ by this factor at most are one number.
const SAME: f64 = 1.5;

/// Units and their seconds.
const UNITS: [(&str, f64); 4] = [("s", 1.0), ("min", 60.0), ("h", 3600.0), ("d", 86400.0)];

/// Times below this are not told apart, s.
pub const NOTHING: f64 = 0.1;

/// Seconds, with a range that they are likely to be in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Likely.
    pub likely: f64,
    /// At least.
    pub least: f64,
    /// At most.
    pub most: f64,
}

impl Range {
    /// These seconds alone.
    #[must_use]
    pub fn of(likely: f64) -> Self {
        Self { likely, least: likely, most: likely }
    }

    /// These seconds, between all of them and `others`.
    pub(super) fn spanning(likely: f64, others: impl IntoIterator<Item = f64>) -> Self {
        others.into_iter().fold(Self::of(likely), |range, other| Self {
            least: range.least.min(other),
            most: range.most.max(other),
            ..range
        })
    }

    /// The range of a function that grows with the seconds.
    #[must_use]
    pub fn map(self, of: impl Fn(f64) -> f64) -> Self {
        Self { likely: of(self.likely), least: of(self.least), most: of(self.most) }
    }
}

/// `less than 0.1 s`, `0.4 s`, `57 s`, `3.1 min`, `45 min`, `2.5 h`, `4 d`: two significant figures at most.
#[must_use]
pub fn duration(seconds: f64) -> String {
    if seconds < NOTHING { format!("less than {NOTHING} s") } else { between(seconds, seconds) }
}

/// `2 to 4 min`, or one duration where that is as good.
fn between(least: f64, most: f64) -> String {
    // The largest unit of which there are one and a half.
    let unit = UNITS.iter().rposition(|unit| two_figures(most) >= 1.5 * unit.1).unwrap_or(0);
    let (name, size) = UNITS[unit];
    // Tenths of a second are below the accuracy of a forecast.
    let rounded = |seconds| match two_figures(seconds / size) {
        value if unit == 0 && value >= 1.0 => value.round(),
        value => value,
    };
    let (low, high) = (rounded(least), rounded(most));
    if low == high { format!("{high} {name}") } else { format!("{low} to {high} {name}") }
}

/// `about 40 s`, or `about 40 s (25 to 80 s)` where that is less certain.
#[must_use]
pub fn about(range: Range) -> String {
    let likely = duration(range.likely);
    match range.likely {
        nothing if nothing < NOTHING => likely,
        _ if range.most <= SAME * range.least => format!("about {likely}"),
        _ => format!("about {likely} ({})", between(range.least, range.most)),
    }
}

/// How far off the prediction of a run was that is over.
#[must_use]
pub fn judged(predicted: &Predicted) -> String {
    let Predicted { seconds, least_seconds, most_seconds, after_seconds, took, .. } = *predicted;
    let range = Range { likely: seconds, least: least_seconds, most: most_seconds };
    let text = format!("predicted after {}: {}", duration(after_seconds), about(range));
    took.map_or(text.clone(), |Took { seconds: took, .. }| {
        let ratio = took / seconds;
        format!("{text}; the run took {} ({ratio:.2} times the prediction)", duration(took))
    })
}

/// `value` rounded to two significant figures, and to tenths.
fn two_figures(value: f64) -> f64 {
    let rounded: f64 = format!("{value:.1e}").parse().unwrap_or(value);
    (10.0 * rounded).round() / 10.0
}
