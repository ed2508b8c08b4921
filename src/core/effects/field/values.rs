//! The values of a field: one number, or one for each vertex, edge or triangle.

use std::fmt;

/// The values of a field on a sheet.
#[derive(Debug, Clone, PartialEq)]
pub enum FieldValues {
    /// The same everywhere.
    Same(f64),
    /// One for each vertex, edge or triangle.
    Each(Vec<f64>),
}

impl From<f64> for FieldValues {
    fn from(value: f64) -> Self {
        Self::Same(value)
    }
}

impl FieldValues {
    /// The value at number `i`.
    #[must_use]
    #[inline(always)]
    pub fn at(&self, i: usize) -> f64 {
        match self {
            Self::Same(value) => *value,
            Self::Each(all) => all[i],
        }
    }

    /// Whether it is one number.
    #[must_use]
    pub fn is_uniform(&self) -> bool {
        matches!(self, Self::Same(_))
    }

    /// The number at every place, by what is there.
    #[must_use]
    pub fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        match self {
            Self::Same(value) => Self::Same(f(*value)),
            Self::Each(all) => Self::Each(all.iter().map(|value| f(*value)).collect()),
        }
    }

    /// The largest; minus infinity of none.
    #[must_use]
    pub fn largest(&self) -> f64 {
        match self {
            Self::Same(value) => *value,
            Self::Each(all) => all.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        }
    }

    /// The smallest; infinity of none.
    #[must_use]
    pub fn smallest(&self) -> f64 {
        match self {
            Self::Same(value) => *value,
            Self::Each(all) => all.iter().copied().fold(f64::INFINITY, f64::min),
        }
    }

    /// The mean.
    #[must_use]
    pub fn mean(&self) -> f64 {
        match self {
            Self::Same(value) => *value,
            Self::Each(all) => all.iter().sum::<f64>() / crate::num::real(all.len().max(1)),
        }
    }
}

/// The number, or the smallest and the largest.
impl fmt::LowerExp for FieldValues {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (least, most) = (self.smallest(), self.largest());
        fmt::LowerExp::fmt(&least, f)?;
        if most > least {
            f.write_str(" to ")?;
            fmt::LowerExp::fmt(&most, f)?;
        }
        Ok(())
    }
}
