//! What solvers remember, as bytes and back to the last bit, in the format of postcard 1.
//!
//! A record in a record is a list of bytes: who passes it on need not know what is in it.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// A value as bytes.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Record(#[serde(with = "serde_bytes")] Vec<u8>);

/// Bytes that are not what was to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("it does not hold what is expected in it")]
pub struct Malformed;

impl Record {
    /// Writes `value`. A value that cannot be written, as one with a sequence of unknown length, leaves a record
    /// that cannot be read.
    #[must_use]
    pub fn encode(value: &impl Serialize) -> Self {
        Self(postcard::to_allocvec(value).unwrap_or_default())
    }

    /// The value that was written.
    ///
    /// # Errors
    /// [`Malformed`] if it was one of another type, or anything is left.
    pub fn read<T: DeserializeOwned>(&self) -> Result<T, Malformed> {
        match postcard::take_from_bytes(&self.0) {
            Ok((value, [])) => Ok(value),
            _ => Err(Malformed),
        }
    }

    /// All of it.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        &self.0
    }
}

impl From<Vec<u8>> for Record {
    fn from(bytes: Vec<u8>) -> Self {
        Self(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vec3;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Value {
        name: String,
        numbers: Vec<f64>,
        points: Vec<Vec3>,
        step: Option<f64>,
        inner: Record,
    }

    #[test]
    fn what_is_written_is_read_bit_by_bit() {
        let odd = [f64::NAN, -0.0, f64::MIN_POSITIVE / 3.0, f64::NEG_INFINITY, 0.1];
        let value = Value {
            name: "Δt".into(),
            numbers: odd.to_vec(),
            points: vec![Vec3::new(1.0, -0.0, 1e-300)],
            step: Some(0.25),
            inner: Record::encode(&(7_u64, false)),
        };
        let record = Record::encode(&value);
        let read: Value = record.read().unwrap();
        assert!(read.numbers.iter().zip(&odd).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert_eq!(read.points[0].y.to_bits(), (-0.0f64).to_bits());
        assert_eq!((read.name.as_str(), read.step), ("Δt", Some(0.25)));
        assert_eq!(read.inner.read(), Ok((7_u64, false)));
        // Cut short anywhere it is refused, and so is what is too long, or a length that nothing has room for.
        let bytes = record.as_bytes();
        for length in 0..bytes.len() {
            let short = Record::from(bytes[..length].to_vec());
            assert_eq!(short.read::<Value>().err(), Some(Malformed), "{length}");
        }
        let long = Record::from([bytes, &[0]].concat());
        assert_eq!(long.read::<Value>().err(), Some(Malformed));
        let count = Record::encode(&u64::MAX);
        assert_eq!(count.read::<Vec<f64>>(), Err(Malformed));
    }
}
