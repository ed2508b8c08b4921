//! The numbers in VTK's XML files: text, base64 or raw bytes, plain or compressed.
//!
//! Binary data begin with a header of h-byte integers (h = 4 or 8, the file says which): without
//! compression the number of bytes; with it `[blocks, block size, size of the last block or 0,
//! compressed size of every block…]`, in base64 a stream of its own. See the "VTK XML Formats" page
//! of the VTK documentation. Sizes in a header are believed only as far as there are data for them.
//!
//! vtkio decodes such data too, but loses what it does not know and trusts every size; the tests of
//! its faults say where. Its buffers hold the result.

use std::cell::Cell;
use std::io::Read;

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use vtkio::model::{ByteOrder, IOBuffer, ScalarType};

/// Base64 of any writer: with padding or without, whatever the last bits are.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// Arrays of a file may hold so many bytes in all, as numbers of 64 bits, …
const MAX_DECODED_BYTES: usize = 1 << 23;
/// … and more where the file has more than a share of them: what repeats itself shrinks to a hundredth. Much
/// more is nothing that a sheet needs.
const MAX_TIMES: usize = 256;
/// Memory that a decoder of LZMA data may use: a little more than the strongest preset asks for.
const LZMA_MEMORY: u64 = 100 << 20;

/// How much more may be decoded.
#[derive(Debug)]
pub(super) struct Budget {
    left: Cell<usize>,
    all: usize,
}

impl Budget {
    /// That of a file with so many bytes.
    pub(super) fn new(bytes: usize) -> Self {
        let all = bytes.saturating_mul(MAX_TIMES).max(MAX_DECODED_BYTES);
        Self { left: Cell::new(all), all }
    }

    /// Takes `bytes` of it.
    fn take(&self, bytes: usize) -> Result<(), String> {
        let refuse = || {
            let all = self.all;
            format!(
                "makes the file's arrays hold more than {all} bytes: at most {MAX_DECODED_BYTES}, or {MAX_TIMES} \
                 times the size of the file, are decoded; save it with less or no compression"
            )
        };
        self.left.set(self.left.get().checked_sub(bytes).ok_or_else(refuse)?);
        Ok(())
    }
}

/// What the file says about all of its binary data.
#[derive(Debug, Clone, Copy)]
pub(super) struct Encoding {
    pub(super) order: ByteOrder,
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

/// The type of numbers that the XML formats call by this name.
pub(super) fn scalar(name: &str) -> Option<ScalarType> {
    Some(match name {
        "Int8" => ScalarType::I8,
        "UInt8" => ScalarType::U8,
        "Int16" => ScalarType::I16,
        "UInt16" => ScalarType::U16,
        "Int32" => ScalarType::I32,
        "UInt32" => ScalarType::U32,
        "Int64" => ScalarType::I64,
        "UInt64" => ScalarType::U64,
        "Float32" => ScalarType::F32,
        "Float64" => ScalarType::F64,
        _ => return None,
    })
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

/// Decodes an array of exactly `count` numbers.
pub(super) fn numbers(
    source: Source,
    scalar: ScalarType,
    count: usize,
    encoding: Encoding,
    budget: &Budget,
) -> Result<IOBuffer, String> {
    if let Source::Ascii(text) = source {
        return ascii(text, scalar, count);
    }
    let bytes = count.checked_mul(scalar.size()).ok_or("has an impossible size")?;
    let wide = count.checked_mul(size_of::<f64>()).ok_or("has an impossible size")?;
    let data = match encoding.compressor {
        Compressor::None => plain(source, bytes, encoding, budget, wide)?,
        _ => compressed(source, bytes, encoding, budget, wide)?,
    };
    IOBuffer::from_byte_vec(data, scalar, encoding.order).map_err(|e| format!("is broken: {e}"))
}

/// Numbers as text: reals, or whole ones of any type as the widest.
fn ascii(text: &[u8], scalar: ScalarType, count: usize) -> Result<IOBuffer, String> {
    let text = std::str::from_utf8(text).map_err(|_| "holds something that is not text")?;
    let buffer = match scalar {
        ScalarType::F32 | ScalarType::F64 => IOBuffer::F64(words(text, scalar)?),
        _ => IOBuffer::I64(words(text, scalar)?),
    };
    if buffer.len() != count {
        return Err(format!("holds {} numbers instead of {count}", buffer.len()));
    }
    Ok(buffer)
}

fn words<T: std::str::FromStr>(text: &str, scalar: ScalarType) -> Result<Vec<T>, String> {
    text.split_ascii_whitespace()
        .map(|word| {
            word.parse().map_err(|_| {
                let short: String = word.chars().take(20).collect();
                format!("holds \"{short}\", which is not a {scalar}")
            })
        })
        .collect()
}

/// Data without compression: a header with the number of bytes, then these; `wide` bytes as numbers of 64 bits.
fn plain(
    source: Source,
    bytes: usize,
    encoding: Encoding,
    budget: &Budget,
    wide: usize,
) -> Result<Vec<u8>, String> {
    let header = integers(&stretch(source, encoding.header)?.0, encoding);
    let given = header.first().copied().unwrap_or_default();
    if given != bytes {
        return Err(format!("holds {given} bytes instead of {bytes}"));
    }
    let all = encoding.header.checked_add(bytes).ok_or("has an impossible size")?;
    budget.take(wide)?;
    let (mut data, _) = stretch(source, all)?;
    data.drain(..encoding.header);
    Ok(data)
}

/// Data in compressed blocks.
fn compressed(
    source: Source,
    bytes: usize,
    encoding: Encoding,
    budget: &Budget,
    wide: usize,
) -> Result<Vec<u8>, String> {
    let impossible = || "has an impossible size".to_owned();
    let first = integers(&stretch(source, 3 * encoding.header)?.0, encoding);
    let [blocks, block, last] = first[..] else { return Err(impossible()) };
    if blocks == 0 {
        return if bytes == 0 { Ok(Vec::new()) } else { Err("holds no data".into()) };
    }
    let tail = if last == 0 { block } else { last };
    let total = block.checked_mul(blocks - 1).and_then(|b| b.checked_add(tail));
    if total != Some(bytes) {
        return Err(match total {
            Some(total) => format!("holds {total} bytes instead of {bytes}"),
            None => format!("names blocks of more bytes than can be counted instead of {bytes}"),
        });
    }
    budget.take(wide)?;
    let header = blocks.checked_add(3).and_then(|n| n.checked_mul(encoding.header));
    let header = header.ok_or_else(impossible)?;
    budget.take(header)?;
    let (sizes, after) = stretch(source, header)?;
    let sizes = integers(&sizes, encoding).split_off(3);
    let packed_size =
        sizes.iter().try_fold(0usize, |sum, &n| sum.checked_add(n)).ok_or_else(impossible)?;
    // Many arrays may name the same data.
    budget.take(packed_size)?;
    let (packed, _) = stretch(after, packed_size)?;
    // No more than the budget has room for.
    let mut out = Vec::with_capacity(bytes);
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
            let stream = liblzma::stream::Stream::new_stream_decoder(LZMA_MEMORY, 0)
                .map_err(|e| e.to_string())?;
            liblzma::bufread::XzDecoder::new_stream(packed, stream)
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
            let mut data =
                BASE64.decode(taken).map_err(|e| format!("holds invalid base64: {e}"))?;
            data.truncate(bytes);
            if data.len() < bytes {
                return Err(short());
            }
            Ok((data, Source::Base64(after)))
        }
        Source::Ascii(_) => Err("is text where binary data were announced".into()),
    }
}

/// The integers of a header.
fn integers(bytes: &[u8], encoding: Encoding) -> Vec<usize> {
    let scalar = if encoding.header == 8 { ScalarType::U64 } else { ScalarType::U32 };
    let numbers = IOBuffer::from_bytes(bytes, scalar, encoding.order)
        .ok()
        .and_then(|buffer| buffer.cast_into::<u64>())
        .unwrap_or_default();
    numbers.into_iter().map(|n| usize::try_from(n).unwrap_or(usize::MAX)).collect()
}
