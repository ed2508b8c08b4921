//! Parameters within bounds, by coordinates without any.
//!
//! ```text
//! LOW:HIGH    p = LOW + (HIGH - LOW) (1 + sin u)/2
//! LOW:        p = LOW + L (√(u² + 1) - 1)          L the distance of the start from the bound
//! :HIGH       p = HIGH - L (√(u² + 1) - 1)
//! ```
//!
//! As in MINUIT (James & Roos, Comput. Phys. Commun. 10 (1975) 343, doi:10.1016/0010-4655(75)90039-9).

use crate::run::{Error, Result};

/// Share of its range by which a start is moved off a bound, where p does not change with u.
const INSIDE: f64 = 1e-3;

/// Share of its range that a parameter counts as at least.
const LEAST_SIZE: f64 = 1e-2;

/// A key with its bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounded {
    /// Its key, as by `--set`.
    pub key: String,
    /// Its least and largest values.
    pub bounds: (Option<f64>, Option<f64>),
}

impl std::str::FromStr for Bounded {
    type Err = String;

    /// `KEY`, `KEY=LOW:HIGH`, `KEY=LOW:` or `KEY=:HIGH`.
    fn from_str(text: &str) -> Result<Self, String> {
        let Some((key, range)) = text.split_once('=') else {
            return Ok(Self { key: text.to_owned(), bounds: (None, None) });
        };
        let expected = || "expected KEY or KEY=LOW:HIGH, as material.young=1e3:1e5".to_owned();
        let (low, high) = range.split_once(':').ok_or_else(expected)?;
        let bound = |text: &str| match text.trim() {
            "" => Ok(None),
            text => match text.parse::<f64>() {
                Ok(number) if number.is_finite() => Ok(Some(number)),
                _ => Err(expected()),
            },
        };
        let bounds = (bound(low)?, bound(high)?);
        match bounds {
            (Some(low), Some(high)) if low >= high => Err(format!("{low} is not below {high}")),
            _ => Ok(Self { key: key.trim().to_owned(), bounds }),
        }
    }
}

/// p as a function of u.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coordinate {
    bounds: (Option<f64>, Option<f64>),
    length: f64,
}

impl Coordinate {
    /// That of a parameter that starts at `start`.
    ///
    /// # Errors
    /// A start outside the bounds.
    pub(super) fn new(parameter: &Bounded, start: f64) -> Result<Self> {
        let (low, high) = parameter.bounds;
        if low.is_some_and(|low| start < low) || high.is_some_and(|high| start > high) {
            return Err(Error::Refused(format!(
                "{}: the scene has {start}, which lies outside its bounds: --set {}=VALUE starts inside",
                parameter.key, parameter.key
            )));
        }
        let size = if start == 0.0 { 1.0 } else { start.abs() };
        let away = |bound: f64| if start == bound { size } else { (start - bound).abs() };
        let length = match (low, high) {
            (Some(low), Some(high)) => high - low,
            (Some(bound), None) | (None, Some(bound)) => away(bound),
            (None, None) => size,
        };
        Ok(Self { bounds: (low, high), length })
    }

    /// u(p).
    pub(super) fn inverse(&self, p: f64) -> f64 {
        match self.bounds {
            (Some(low), Some(_)) => {
                let share = ((p - low) / self.length).clamp(INSIDE, 1.0 - INSIDE);
                (2.0 * share - 1.0).asin()
            }
            (Some(bound), None) | (None, Some(bound)) => {
                let root = 1.0 + ((p - bound).abs() / self.length).max(INSIDE);
                (root * root - 1.0).sqrt()
            }
            (None, None) => p / self.length,
        }
    }

    /// p(u).
    pub(super) fn value(&self, u: f64) -> f64 {
        let one_sided = self.length * ((u * u + 1.0).sqrt() - 1.0);
        match self.bounds {
            (Some(low), Some(high)) => (low + 0.5 * self.length * (1.0 + u.sin())).clamp(low, high),
            (Some(low), None) => low + one_sided,
            (None, Some(high)) => high - one_sided,
            (None, None) => self.length * u,
        }
    }

    /// dp/du.
    pub(super) fn slope(&self, u: f64) -> f64 {
        let one_sided = self.length * u / (u * u + 1.0).sqrt();
        match self.bounds {
            (Some(_), Some(_)) => 0.5 * self.length * u.cos(),
            (Some(_), None) => one_sided,
            (None, Some(_)) => -one_sided,
            (None, None) => self.length,
        }
    }

    /// A size of p: that of `p`, or a share of its range where that is more, as next to 0.
    pub(super) fn scale(&self, p: f64) -> f64 {
        p.abs().max(LEAST_SIZE * self.length)
    }

    /// Whether `p` lies at a bound, up to a millionth of the range.
    pub(super) fn at_bound(&self, p: f64) -> bool {
        let near = |bound: Option<f64>| bound.is_some_and(|b| (p - b).abs() <= 1e-6 * self.length);
        near(self.bounds.0) || near(self.bounds.1)
    }

    /// `p` moved by `step`, but not out of its bounds.
    pub(super) fn moved(&self, p: f64, step: f64) -> f64 {
        let (low, high) = self.bounds;
        (p + step).clamp(low.unwrap_or(f64::NEG_INFINITY), high.unwrap_or(f64::INFINITY))
    }

    /// The value at a share of the range; none without two bounds.
    pub(super) fn at_share(&self, share: f64) -> Option<f64> {
        let (low, high) = (self.bounds.0?, self.bounds.1?);
        Some(low + share * (high - low))
    }
}
