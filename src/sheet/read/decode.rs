//! The numbers in VTK's XML files: text, base64 or raw bytes, plain or compressed.
//!
//! Binary data begin with a header of h-byte integers (h = 4 or 8, the file says which): without
//! compression the number of bytes; with it `[blocks, block size, size of the last block or 0,
//! compressed size of every block…]`, in base64 a stream of its own. See the "VTK XML Formats" page
//! of the VTK documentation. Sizes in a header are believed only as far as there are data for them.

use std::io::Read;

/// What the file says about all of its binary data.
#[derive(Debug, Clone, Copy)]
pub(super) struct Encoding {
    pub(super) big_endian: bool,
    /// Bytes of a header's integers: 4 or 8.
    pub(super) header: usize,
    pub(super) compressor: Compressor,
}

/// How blocks are compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Compressor {
    None,
    Zlib,
    Lz4,
    Lzma,
}

/// The types of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    Int8,
    UInt8,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Int64,
    UInt64,
    Float32,
    Float64,
}

impl Scalar {
    /// The type of this name.
    pub(super) fn named(name: &str) -> Option<Self> {
        Some(match name {
            "Int8" => Self::Int8,
            "UInt8" => Self::UInt8,
            "Int16" => Self::Int16,
            "UInt16" => Self::UInt16,
            "Int32" => Self::Int32,
            "UInt32" => Self::UInt32,
            "Int64" => Self::Int64,
            "UInt64" => Self::UInt64,
            "Float32" => Self::Float32,
            "Float64" => Self::Float64,
            _ => return None,
        })
    }

    /// Bytes of one number.
    pub(super) fn size(self) -> usize {
        match self {
            Self::Int8 | Self::UInt8 => 1,
            Self::Int16 | Self::UInt16 => 2,
            Self::Int32 | Self::UInt32 | Self::Float32 => 4,
            Self::Int64 | Self::UInt64 | Self::Float64 => 8,
        }
    }
}

/// Where the bytes of an array are.
#[derive(Debug, Clone, Copy)]
pub(super) enum Source<'a> {
    /// Numbers as text.
    Ascii(&'a [u8]),
    /// Base64 from here on.
    Base64(&'a [u8]),
    /// The bytes themselves from here on.
    Raw(&'a [u8]),
}

/// A number of a file: whole ones stay whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Number {
    Whole(i64),
    Real(f64),
}

impl Number {
    /// As a real number; whole numbers beyond 2^53 are rounded.
    #[allow(clippy::cast_precision_loss)]
    pub(super) fn real(self) -> f64 {
        match self {
            Self::Whole(i) => i as f64,
            Self::Real(x) => x,
        }
    }

    /// As a position in an array.
    pub(super) fn position(self) -> Option<usize> {
        match self {
            Self::Whole(i) => usize::try_from(i).ok(),
            Self::Real(_) => None,
        }
    }
}

/// Decodes an array of exactly `count` numbers.
pub(super) fn numbers(
    source: Source,
    scalar: Scalar,
    count: usize,
    encoding: Encoding,
) -> Result<Vec<Number>, String> {
    if let Source::Ascii(text) = source {
        return ascii(text, scalar, count);
    }
    let bytes = count.checked_mul(scalar.size()).ok_or("has an impossible size")?;
    let data = match encoding.compressor {
        Compressor::None => plain(source, bytes, encoding)?,
        _ => compressed(source, bytes, encoding)?,
    };
    Ok(data.chunks_exact(scalar.size()).map(|c| number(c, scalar, encoding.big_endian)).collect())
}

fn ascii(text: &[u8], scalar: Scalar, count: usize) -> Result<Vec<Number>, String> {
    let text = std::str::from_utf8(text).map_err(|_| "holds something that is not text")?;
    let real = matches!(scalar, Scalar::Float32 | Scalar::Float64);
    let mut out = Vec::new();
    for word in text.split_ascii_whitespace() {
        let number = if real {
            word.parse().map(Number::Real).ok()
        } else {
            word.parse().map(Number::Whole).ok()
        };
        out.push(number.ok_or_else(|| {
            let short: String = word.chars().take(20).collect();
            format!("holds \"{short}\", which is no {scalar:?}")
        })?);
    }
    if out.len() != count {
        return Err(format!("holds {} numbers instead of {count}", out.len()));
    }
    Ok(out)
}

/// Data without compression: a header with the number of bytes, then these.
fn plain(source: Source, bytes: usize, encoding: Encoding) -> Result<Vec<u8>, String> {
    let header = integers(&stretch(source, encoding.header)?.0, encoding);
    let given = header.first().copied().unwrap_or_default();
    if given != bytes {
        return Err(format!("holds {given} bytes instead of {bytes}"));
    }
    let all = encoding.header.checked_add(bytes).ok_or("has an impossible size")?;
    let (mut data, _) = stretch(source, all)?;
    data.drain(..encoding.header);
    Ok(data)
}

/// Data in compressed blocks.
fn compressed(source: Source, bytes: usize, encoding: Encoding) -> Result<Vec<u8>, String> {
    let impossible = || "has an impossible size".to_owned();
    let first = integers(&stretch(source, 3 * encoding.header)?.0, encoding);
    let [blocks, block, last] = first[..] else { return Err(impossible()) };
    if blocks == 0 {
        return if bytes == 0 { Ok(Vec::new()) } else { Err("holds no data".into()) };
    }
    let tail = if last == 0 { block } else { last };
    let total = block.checked_mul(blocks - 1).and_then(|b| b.checked_add(tail));
    if total != Some(bytes) {
        return Err(format!("holds {total:?} bytes instead of {bytes}"));
    }
    let header = blocks.checked_add(3).and_then(|n| n.checked_mul(encoding.header));
    let (sizes, after) = stretch(source, header.ok_or_else(impossible)?)?;
    let sizes = integers(&sizes, encoding).split_off(3);
    let packed_size =
        sizes.iter().try_fold(0usize, |sum, &n| sum.checked_add(n)).ok_or_else(impossible)?;
    let (packed, _) = stretch(after, packed_size)?;
    let mut out = Vec::new();
    let mut rest = &packed[..];
    for (i, size) in sizes.into_iter().enumerate() {
        let (one, after) = rest.split_at(size);
        rest = after;
        let want = if i + 1 == blocks { tail } else { block };
        unpack(one, want, encoding.compressor, &mut out)
            .map_err(|why| format!("has a broken block {i}: {why}"))?;
    }
    Ok(out)
}

/// Appends the `want` bytes of one block.
fn unpack(
    packed: &[u8],
    want: usize,
    compressor: Compressor,
    out: &mut Vec<u8>,
) -> Result<(), String> {
    let start = out.len();
    // One byte more shows a block that is too long.
    let limit = u64::try_from(want).unwrap_or(u64::MAX).saturating_add(1);
    match compressor {
        Compressor::Zlib => {
            flate2::bufread::ZlibDecoder::new(packed)
                .take(limit)
                .read_to_end(out)
                .map_err(|e| e.to_string())?;
        }
        Compressor::Lzma => {
            xz2::bufread::XzDecoder::new(packed)
                .take(limit)
                .read_to_end(out)
                .map_err(|e| e.to_string())?;
        }
        Compressor::Lz4 => {
            // LZ4 expands at most 255-fold, so a larger claim is refused before it is allocated.
            if want > packed.len().saturating_mul(255).saturating_add(64) {
                return Err(format!("{} bytes cannot hold {want}", packed.len()));
            }
            let block = lz4_flex::block::decompress(packed, want).map_err(|e| e.to_string())?;
            out.extend_from_slice(&block);
        }
        Compressor::None => out.extend_from_slice(packed),
    }
    if out.len() - start != want {
        return Err(format!("{} bytes instead of {want}", out.len() - start));
    }
    Ok(())
}

/// The first `bytes` decoded bytes of a source, and what follows them.
fn stretch(source: Source, bytes: usize) -> Result<(Vec<u8>, Source), String> {
    let short = || "ends too early: the file is cut short".to_owned();
    match source {
        Source::Raw(data) => {
            let (taken, after) = data.split_at_checked(bytes).ok_or_else(short)?;
            Ok((taken.to_vec(), Source::Raw(after)))
        }
        Source::Base64(text) => {
            let letters = bytes.div_ceil(3).checked_mul(4).ok_or_else(short)?;
            let (taken, after) = text.split_at_checked(letters).ok_or_else(short)?;
            let mut data = base64(taken)?;
            data.truncate(bytes);
            if data.len() < bytes {
                return Err(short());
            }
            Ok((data, Source::Base64(after)))
        }
        Source::Ascii(_) => Err("is text where binary data were announced".into()),
    }
}

/// Base64 (RFC 4648) in whole groups of four letters; padding ends the data.
fn base64(text: &[u8]) -> Result<Vec<u8>, String> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    for group in text.chunks_exact(4) {
        let mut bits = 0u32;
        let mut kept = 3;
        for (k, &letter) in group.iter().enumerate() {
            let value = match letter {
                b'A'..=b'Z' => letter - b'A',
                b'a'..=b'z' => letter - b'a' + 26,
                b'0'..=b'9' => letter - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                b'=' if k >= 2 => {
                    kept = kept.min(k - 1);
                    0
                }
                _ => return Err("holds a letter that is no base64".into()),
            };
            bits = (bits << 6) | u32::from(value);
        }
        out.extend_from_slice(&bits.to_be_bytes()[1..=kept]);
    }
    Ok(out)
}

/// The integers of a header.
fn integers(bytes: &[u8], encoding: Encoding) -> Vec<usize> {
    let scalar = if encoding.header == 8 { Scalar::UInt64 } else { Scalar::UInt32 };
    bytes
        .chunks_exact(encoding.header)
        .map(|c| number(c, scalar, encoding.big_endian).position().unwrap_or(usize::MAX))
        .collect()
}

/// One number from its bytes, of which there are `scalar.size()`.
fn number(bytes: &[u8], scalar: Scalar, big_endian: bool) -> Number {
    let mut eight = [0; 8];
    for (place, &byte) in bytes.iter().rev().enumerate() {
        let place = if big_endian { place } else { bytes.len() - 1 - place };
        if let Some(b) = eight.get_mut(place) {
            *b = byte;
        }
    }
    // Little-endian now, in the lowest bytes.
    let [a, b, c, d, ..] = eight;
    let whole = |n: u64| Number::Whole(i64::try_from(n).unwrap_or(i64::MAX));
    match scalar {
        Scalar::Int8 => Number::Whole(i64::from(i8::from_le_bytes([a]))),
        Scalar::Int16 => Number::Whole(i64::from(i16::from_le_bytes([a, b]))),
        Scalar::Int32 => Number::Whole(i64::from(i32::from_le_bytes([a, b, c, d]))),
        Scalar::Int64 => Number::Whole(i64::from_le_bytes(eight)),
        Scalar::UInt8 | Scalar::UInt16 | Scalar::UInt32 | Scalar::UInt64 => {
            whole(u64::from_le_bytes(eight))
        }
        Scalar::Float32 => Number::Real(f64::from(f32::from_le_bytes([a, b, c, d]))),
        Scalar::Float64 => Number::Real(f64::from_le_bytes(eight)),
    }
}
