//! The date in UTC, from the system's clock alone.

use std::time::{SystemTime, UNIX_EPOCH};

/// Year, month, day, hour, minute and second of `time` in UTC (proleptic Gregorian calendar).
///
/// Years are counted from 1 March, so that the leap day is the last of a year and the lengths
/// of the months before it follow `(153 m + 2) / 5`. Times before 1970 give 1970.
#[must_use]
pub(crate) fn civil(time: SystemTime) -> [u64; 6] {
    let seconds = time.duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs());
    // 0000-03-01 is 719 468 days before 1970-01-01; 146 097 days are four centuries.
    let days = seconds / 86_400 + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    let rest = seconds % 86_400;
    [year, month, day, rest / 3_600, rest / 60 % 60, rest % 60]
}

/// `2026-11-21T12:34:56Z`.
#[must_use]
pub fn iso(time: SystemTime) -> String {
    let [y, mo, d, h, mi, s] = civil(time);
    format!("{y:04}-{mo:02}-{d:02}T{h:02}:{mi:02}:{s:02}Z")
}

/// `20261121-123456`, for names of files.
#[must_use]
pub fn stamp(time: SystemTime) -> String {
    let [y, mo, d, h, mi, s] = civil(time);
    format!("{y:04}{mo:02}{d:02}-{h:02}{mi:02}{s:02}")
}
