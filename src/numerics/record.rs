//! Numbers as bytes and back, to the last bit.
//!
//! Every number takes 64 bits, little-endian; lists and texts begin with their length. What is written in
//! some order is read in the same.

use crate::Vec3;

/// Bytes being written.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub struct Record {
    bytes: Vec<u8>,
}

/// Bytes being read.
#[derive(Debug, Clone)]
pub struct Reading<'a> {
    rest: &'a [u8],
}

/// Bytes that are not what was to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("it does not hold what is expected in it")]
pub struct Malformed;

impl Record {
    /// Adds a count.
    pub fn count(&mut self, count: u64) {
        self.bytes.extend(count.to_le_bytes());
    }

    /// Adds a number.
    pub fn number(&mut self, number: f64) {
        self.count(number.to_bits());
    }

    /// Adds a yes or no.
    pub fn flag(&mut self, flag: bool) {
        self.count(flag.into());
    }

    /// Adds whether there is something; that itself is up to the caller.
    pub fn option<T>(&mut self, option: Option<T>, add: impl FnOnce(&mut Self, T)) {
        self.flag(option.is_some());
        if let Some(value) = option {
            add(self, value);
        }
    }

    /// Adds a text.
    pub fn text(&mut self, text: &str) {
        self.count(text.len() as u64);
        self.bytes.extend(text.as_bytes());
    }

    /// Adds a list of numbers.
    pub fn numbers<'a>(&mut self, numbers: impl IntoIterator<Item = &'a f64>) {
        let place = self.bytes.len();
        self.count(0);
        for number in numbers {
            self.bytes.extend_from_slice(&number.to_bits().to_le_bytes());
        }
        let count = (self.bytes.len() - place) as u64 / 8 - 1;
        self.bytes[place..place + 8].copy_from_slice(&count.to_le_bytes());
    }

    /// Adds a list of points.
    pub fn points(&mut self, points: &[Vec3]) {
        self.numbers(points.iter().flat_map(|point| point.iter()));
    }

    /// Adds another record, as a list of numbers.
    pub fn record(&mut self, other: &Self) {
        self.count(other.bytes.len() as u64 / 8);
        self.bytes.extend(&other.bytes);
    }

    /// All of it.
    #[must_use]
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }
}

impl<'a> Reading<'a> {
    /// Of these bytes.
    #[must_use]
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    fn take(&mut self, length: usize) -> Result<&'a [u8], Malformed> {
        let (taken, rest) = self.rest.split_at_checked(length).ok_or(Malformed)?;
        self.rest = rest;
        Ok(taken)
    }

    /// A length that the bytes have room for, with so many bytes each.
    fn length(&mut self, each: usize) -> Result<usize, Malformed> {
        let length = usize::try_from(self.count()?).map_err(|_| Malformed)?;
        length.checked_mul(each).filter(|bytes| *bytes <= self.rest.len()).ok_or(Malformed)
    }

    /// The next count.
    ///
    /// # Errors
    /// [`Malformed`] at the end of the bytes, as all of these.
    pub fn count(&mut self) -> Result<u64, Malformed> {
        let word = self.take(8)?.first_chunk().ok_or(Malformed)?;
        Ok(u64::from_le_bytes(*word))
    }

    /// The next record within this one.
    ///
    /// # Errors
    /// [`Malformed`].
    pub fn record(&mut self) -> Result<Self, Malformed> {
        let bytes = self.length(8)?;
        Ok(Self { rest: self.take(bytes)? })
    }

    /// The next count, as of what is in memory.
    ///
    /// # Errors
    /// [`Malformed`].
    pub fn size(&mut self) -> Result<usize, Malformed> {
        usize::try_from(self.count()?).map_err(|_| Malformed)
    }

    /// The next number.
    ///
    /// # Errors
    /// [`Malformed`].
    pub fn number(&mut self) -> Result<f64, Malformed> {
        self.count().map(f64::from_bits)
    }

    /// The next yes or no.
    ///
    /// # Errors
    /// [`Malformed`] also for anything else.
    pub fn flag(&mut self) -> Result<bool, Malformed> {
        match self.count()? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(Malformed),
        }
    }

    /// What `read` reads, if there is something.
    ///
    /// # Errors
    /// [`Malformed`].
    pub fn option<T>(
        &mut self,
        read: impl FnOnce(&mut Self) -> Result<T, Malformed>,
    ) -> Result<Option<T>, Malformed> {
        if self.flag()? { read(self).map(Some) } else { Ok(None) }
    }

    /// The next text.
    ///
    /// # Errors
    /// [`Malformed`] also if it is none.
    pub fn text(&mut self) -> Result<String, Malformed> {
        let length = self.length(1)?;
        String::from_utf8(self.take(length)?.to_vec()).map_err(|_| Malformed)
    }

    /// The next list of numbers.
    ///
    /// # Errors
    /// [`Malformed`].
    pub fn numbers(&mut self) -> Result<Vec<f64>, Malformed> {
        let bytes = self.length(8)?;
        let number = |word: &[u8; 8]| f64::from_bits(u64::from_le_bytes(*word));
        Ok(self.take(bytes)?.as_chunks::<8>().0.iter().map(number).collect())
    }

    /// The next list of points, which has to be one of `count`.
    ///
    /// # Errors
    /// [`Malformed`].
    pub fn points(&mut self, count: usize) -> Result<Vec<Vec3>, Malformed> {
        let numbers = self.numbers()?;
        let (points, rest) = numbers.as_chunks::<3>();
        if points.len() != count || !rest.is_empty() {
            return Err(Malformed);
        }
        Ok(points.iter().map(|point| Vec3::from(*point)).collect())
    }

    /// That there is nothing left.
    ///
    /// # Errors
    /// [`Malformed`] if there is.
    pub fn end(&self) -> Result<(), Malformed> {
        if self.rest.is_empty() { Ok(()) } else { Err(Malformed) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_bit_by_bit() {
        let mut record = Record::default();
        let odd = [f64::NAN, -0.0, f64::MIN_POSITIVE / 3.0, f64::NEG_INFINITY, 0.1];
        record.text("Δt");
        record.numbers(&odd);
        record.points(&[Vec3::new(1.0, -0.0, 1e-300)]);
        record.option(Some(7), Record::count);
        record.option(None, Record::number);
        let bytes = record.into_bytes();
        let mut reading = Reading::new(&bytes);
        assert_eq!(reading.text().unwrap(), "Δt");
        let read = reading.numbers().unwrap();
        assert!(read.iter().zip(&odd).all(|(a, b)| a.to_bits() == b.to_bits()));
        let point = reading.points(1).unwrap()[0];
        assert_eq!(point.y.to_bits(), (-0.0f64).to_bits());
        assert_eq!(reading.option(Reading::count), Ok(Some(7)));
        assert_eq!(reading.option(Reading::number), Ok(None));
        assert_eq!(reading.end(), Ok(()));
        // Cut short anywhere it is refused, not misread; so is a length that nothing has room for.
        for length in 0..bytes.len() {
            let mut reading = Reading::new(&bytes[..length]);
            let all = reading.text().and_then(|_| reading.numbers());
            let all =
                all.and_then(|_| reading.points(1)).and_then(|_| reading.option(Reading::count));
            assert!(all.and_then(|_| reading.option(Reading::number)).is_err(), "{length}");
        }
        assert_eq!(Reading::new(&u64::MAX.to_le_bytes()).numbers(), Err(Malformed));
    }
}
