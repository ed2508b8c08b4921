//! Words and numbers of a file that is text or binary, with the place of each: its line, or its byte.

use rumple_numerics::num::real;

/// How the numbers are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coding {
    Text,
    Little,
    Big,
}

/// Types of binary numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    U64,
    F32,
    F64,
}

/// A file that is read from its beginning to its end.
#[derive(Debug)]
pub(super) struct Stream<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Lines ended before `at`, where the file is text.
    ended: usize,
    /// Whether a line that was read ended at `at`: faults found later in it are its own.
    pending: bool,
    pub(super) coding: Coding,
    /// What ends a line.
    pub(super) line_end: u8,
}

impl<'a> Stream<'a> {
    /// Of text, until [`coding`](Self::coding) is set.
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0, ended: 0, pending: false, coding: Coding::Text, line_end: b'\n' }
    }

    /// Number of the line, from 1.
    pub(super) fn number(&self) -> usize {
        self.ended + 1
    }

    /// The place, for people.
    pub(super) fn place(&self) -> String {
        match self.coding {
            Coding::Text => format!("line {}", self.number()),
            _ => format!("byte {}", self.at),
        }
    }

    /// A fault at the place reached.
    pub(super) fn fault(&self, what: impl std::fmt::Display) -> String {
        format!("{}: {what}", self.place())
    }

    /// The rest of the line, without its ending and spaces at both ends; none at the end of the file. The place stays
    /// in that line until the next one is read.
    pub(super) fn line(&mut self) -> Option<&'a [u8]> {
        self.ended += usize::from(std::mem::take(&mut self.pending));
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let end = rest.iter().position(|&b| b == self.line_end);
        self.at += end.map_or(rest.len(), |end| end + 1);
        self.pending = end.is_some();
        Some(rest[..end.unwrap_or(rest.len())].trim_ascii())
    }

    /// The next word of text; `what` is expected there.
    ///
    /// # Errors
    /// The end of the file, and words that are not text.
    pub(super) fn word(&mut self, what: &str) -> Result<&'a str, String> {
        self.ended += usize::from(std::mem::take(&mut self.pending));
        while let Some(&byte) = self.bytes.get(self.at).filter(|byte| byte.is_ascii_whitespace()) {
            self.ended += usize::from(byte == b'\n');
            self.at += 1;
        }
        let rest = &self.bytes[self.at.min(self.bytes.len())..];
        if rest.is_empty() {
            return Err(
                self.fault(format!("the file ends where {what} is expected: it is cut short"))
            );
        }
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += end;
        std::str::from_utf8(&rest[..end])
            .map_err(|_| self.fault(format!("expected {what}, found bytes that are not text")))
    }

    /// The next bytes.
    ///
    /// # Errors
    /// The end of the file.
    pub(super) fn take<const N: usize>(&mut self, what: &str) -> Result<[u8; N], String> {
        let found = self.bytes.get(self.at..).and_then(|rest| rest.first_chunk::<N>());
        let Some(found) = found else {
            return Err(
                self.fault(format!("the file ends where {what} is expected: it is cut short"))
            );
        };
        self.at += N;
        Ok(*found)
    }

    /// The next number.
    ///
    /// # Errors
    /// Words that are not a number, and the end of the file.
    pub(super) fn real(&mut self, kind: Scalar, what: &str) -> Result<f64, String> {
        if self.coding == Coding::Text {
            let word = self.word(what)?;
            return word.parse().map_err(|_| self.unlike("a number", word, what));
        }
        match kind {
            Scalar::F32 => Ok(f64::from(f32::from_le_bytes(self.ordered(what)?))),
            Scalar::F64 => Ok(f64::from_le_bytes(self.ordered(what)?)),
            _ => self.integer(kind, what).map(|number| {
                let size = real(usize::try_from(number.unsigned_abs()).unwrap_or(usize::MAX));
                if number < 0 { -size } else { size }
            }),
        }
    }

    /// The next whole number.
    ///
    /// # Errors
    /// As for [`real`](Self::real), and numbers beyond 63 bits.
    pub(super) fn integer(&mut self, kind: Scalar, what: &str) -> Result<i64, String> {
        if self.coding == Coding::Text {
            let word = self.word(what)?;
            return word.parse().map_err(|_| self.unlike("a whole number", word, what));
        }
        Ok(match kind {
            Scalar::I8 => i8::from_le_bytes(self.ordered(what)?).into(),
            Scalar::U8 => u8::from_le_bytes(self.ordered(what)?).into(),
            Scalar::I16 => i16::from_le_bytes(self.ordered(what)?).into(),
            Scalar::U16 => u16::from_le_bytes(self.ordered(what)?).into(),
            Scalar::I32 => i32::from_le_bytes(self.ordered(what)?).into(),
            Scalar::U32 => u32::from_le_bytes(self.ordered(what)?).into(),
            Scalar::U64 => {
                let number = u64::from_le_bytes(self.ordered(what)?);
                i64::try_from(number).map_err(|_| self.unlike("a count or number", number, what))?
            }
            Scalar::F32 | Scalar::F64 => return Err(self.fault(format!("{what} is a real number"))),
        })
    }

    /// The next whole number, from 0.
    ///
    /// # Errors
    /// As for [`integer`](Self::integer), and negative numbers.
    pub(super) fn count(&mut self, kind: Scalar, what: &str) -> Result<usize, String> {
        let number = self.integer(kind, what)?;
        usize::try_from(number).map_err(|_| self.unlike("a number from 0", number, what))
    }

    /// Moves to what follows `mark` in the file; whether there is one.
    pub(super) fn skip_to(&mut self, mark: &[u8]) -> bool {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let Some(start) = rest.windows(mark.len()).position(|window| window == mark) else {
            return false;
        };
        let end = start + mark.len();
        self.ended += usize::from(std::mem::take(&mut self.pending));
        self.ended += rest[..end].iter().filter(|&&b| b == b'\n').count();
        self.at += end;
        true
    }

    /// The next bytes, in little-endian order.
    fn ordered<const N: usize>(&mut self, what: &str) -> Result<[u8; N], String> {
        let mut bytes = self.take::<N>(what)?;
        if self.coding == Coding::Big {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn unlike(&self, expected: &str, found: impl std::fmt::Display, what: &str) -> String {
        let found: String = found.to_string().chars().take(20).collect();
        self.fault(format!("expected {expected} as {what}, found \"{found}\""))
    }
}
