//! Numbers that are known to lie in their range, checked where they are read.
//!
//! As the type of a field in a scene's struct they refuse a value while its place in the file is
//! known, so the message points to the number itself.

use serde::de::{Deserialize, Deserializer, Error, Unexpected};

/// A number type with a range, as [`checked_number!`](crate::checked_number) declares it.
pub trait Checked:
    Copy + PartialEq + std::fmt::Debug + serde::Serialize + Send + Sync + 'static
{
    /// The range in words.
    const RANGE: &'static str;

    /// Checks a value; `None` where it is out of range or not finite.
    fn checked(value: f64) -> Option<Self>;

    /// The value.
    fn value(self) -> f64;
}

/// Declares a number type with a range: `checked_number!(Name, "doc", "range in words", |x| test)`; the test can be
/// evaluated at compile time.
///
/// The words complete the sentence "… must be …". Whatever the test, NaN and infinities are
/// refused.
#[macro_export]
macro_rules! checked_number {
    ($name:ident, $doc:literal, $range:literal, |$x:ident| $test:expr) => {
        #[doc = $doc]
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd, serde::Serialize)]
        #[serde(transparent)]
        pub struct $name(f64);

        impl $name {
            /// The range in words.
            pub const RANGE: &'static str = $range;

            /// Checks a value; `None` where it is out of range or not finite.
            #[must_use]
            pub const fn new(value: f64) -> Option<Self> {
                let $x = value;
                if $x.is_finite() && $test { Some(Self(value)) } else { None }
            }

            /// A constant, for `const` alone: one out of range does not compile.
            ///
            /// # Panics
            /// If it is out of range, where it is not evaluated at compile time.
            #[must_use]
            pub const fn constant(value: f64) -> Self {
                match Self::new(value) {
                    Some(number) => number,
                    None => panic!("a constant is out of range"),
                }
            }

            /// The value.
            #[must_use]
            pub const fn get(self) -> f64 {
                self.0
            }
        }

        impl $crate::num::checked::Checked for $name {
            const RANGE: &'static str = $range;

            fn checked(value: f64) -> Option<Self> {
                Self::new(value)
            }

            fn value(self) -> f64 {
                self.0
            }
        }

        impl From<$name> for f64 {
            fn from(number: $name) -> f64 {
                number.0
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                $crate::num::checked::in_range(deserializer, Self::new, $range)
            }
        }
    };
}

/// The least size of a number but 0 that is read: squares and products of two are numbers.
pub const SMALLEST: f64 = 1e-100;

/// The greatest size of a number that is read: see [`SMALLEST`].
pub const LARGEST: f64 = 1e100;

/// Reads a number and checks it, and its size; the words of `range` complete the sentence "… must be …".
///
/// # Errors
/// What is read is not a number, or `check` gives `None` for it.
pub fn in_range<'de, D: Deserializer<'de>, T>(
    deserializer: D,
    check: impl FnOnce(f64) -> Option<T>,
    range: &str,
) -> Result<T, D::Error> {
    let value = f64::deserialize(deserializer)?;
    let wrong = |range: &str| D::Error::invalid_value(Unexpected::Float(value), &range);
    let checked = check(value).ok_or_else(|| wrong(range))?;
    match value == 0.0 || (SMALLEST..=LARGEST).contains(&value.abs()) {
        true => Ok(checked),
        false => Err(wrong(&format!("{range}, of a size between {SMALLEST:e} and {LARGEST:e}"))),
    }
}

checked_number!(Finite, "Any finite number.", "a finite number", |x| true);
checked_number!(Positive, "A number above 0.", "a number above 0", |x| x > 0.0);
checked_number!(NonNegative, "A number from 0 on.", "a number from 0", |x| x >= 0.0);
checked_number!(Fraction, "A number from 0 to 1.", "a number from 0 to 1", |x| x >= 0.0
    && x <= 1.0);

impl Finite {
    /// 0.
    pub const ZERO: Self = Self(0.0);
    /// 1.
    pub const ONE: Self = Self(1.0);
}

impl Default for Finite {
    fn default() -> Self {
        Self::ZERO
    }
}

impl Positive {
    /// 1.
    pub const ONE: Self = Self(1.0);
}

/// An integer from `MIN` on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(transparent)]
pub struct AtLeast<const MIN: usize>(usize);

impl<const MIN: usize> AtLeast<MIN> {
    /// The smallest that is allowed.
    pub const LEAST: Self = Self(MIN);

    /// Checks a value; `None` where it is below `MIN`.
    #[must_use]
    pub const fn new(value: usize) -> Option<Self> {
        if value >= MIN { Some(Self(value)) } else { None }
    }

    /// A constant, for `const` alone: one out of range does not compile.
    ///
    /// # Panics
    /// If it is below `MIN`, where it is not evaluated at compile time.
    #[must_use]
    pub const fn constant(value: usize) -> Self {
        match Self::new(value) {
            Some(number) => number,
            None => panic!("a constant is below its least value"),
        }
    }

    /// The value.
    #[must_use]
    pub const fn get(self) -> usize {
        self.0
    }
}

impl<'de, const MIN: usize> Deserialize<'de> for AtLeast<MIN> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = i64::deserialize(deserializer)?;
        usize::try_from(value).ok().and_then(Self::new).ok_or_else(|| {
            let range = format!("an integer from {MIN}");
            D::Error::invalid_value(Unexpected::Signed(value), &range.as_str())
        })
    }
}

impl Fraction {
    /// All of it.
    pub const ONE: Self = Self(1.0);
}
