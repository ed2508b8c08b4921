//! Numbers as text and bytes: shortest decimals, base64, and the blocks of VTK's XML files.
//!
//! An array in a VTK XML file is a header of unsigned integers and the data, each in base64 of
//! its own: uncompressed `[bytes]`, compressed `[blocks][block size][size of a partial last
//! block][compressed size of each block …]`. Source: VTK file formats, "XML file formats",
//! <https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html>.

use std::io::Write;
use std::ops::Range;

use base64::Engine;
use base64::engine::general_purpose::STANDARD as BASE64;
use base64::write::EncoderWriter;
use flate2::Compression as Level;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Bytes compressed as one block.
///
/// Blocks are compressed in parallel and cost a dictionary each: 128 KiB keeps all threads of a
/// small machine busy on a 20 000-vertex frame and makes the file 0.02 % larger than one
/// block would.
const BLOCK: usize = 128 * 1024;

/// The shortest decimal that reads back as exactly `value`; `nan`, `inf`, `-inf` for the rest.
pub(super) fn decimal(value: f64) -> String {
    let size = value.abs();
    if value.is_nan() {
        "nan".to_owned()
    } else if value == 0.0 || (1e-5..1e16).contains(&size) || size.is_infinite() {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}

/// The bytes of an array, made block by block: a frame is written while a run holds all that it has.
pub(super) struct Bytes<'a> {
    length: usize,
    make: Box<dyn Fn(Range<usize>) -> Vec<u8> + Sync + 'a>,
}

impl<'a> Bytes<'a> {
    /// Of `count` numbers of N bytes each; N divides [`BLOCK`].
    pub(super) fn new<const N: usize>(
        count: usize,
        number: impl Fn(usize) -> [u8; N] + Sync + 'a,
    ) -> Self {
        let make = move |bytes: Range<usize>| {
            let mut block = Vec::with_capacity(bytes.len());
            (bytes.start / N..bytes.end / N).for_each(|k| block.extend_from_slice(&number(k)));
            block
        };
        Self { length: N * count, make: Box::new(make) }
    }

    /// Block number `k`.
    fn block(&self, k: usize) -> Vec<u8> {
        (self.make)(k * BLOCK..((k + 1) * BLOCK).min(self.length))
    }
}

/// Writes the content of a `<DataArray format="binary">` with 64-bit headers.
pub(super) fn data_array(
    bytes: &Bytes<'_>,
    compression: Compression,
    out: &mut dyn Write,
) -> std::io::Result<()> {
    let count = bytes.length.div_ceil(BLOCK);
    let size = |n: usize| (n as u64).to_le_bytes();
    let Some(level) = compression.level() else {
        let mut text = EncoderWriter::new(out, &BASE64);
        text.write_all(&size(bytes.length))?;
        (0..count).try_for_each(|k| text.write_all(&bytes.block(k)))?;
        return text.finish().map(drop);
    };
    let blocks = (0..count)
        .into_par_iter()
        .map(|k| {
            let mut encoder = ZlibEncoder::new(Vec::new(), Level::new(level));
            encoder.write_all(&bytes.block(k))?;
            encoder.finish()
        })
        .collect::<std::io::Result<Vec<_>>>()?;
    let mut header = Vec::with_capacity(8 * (3 + blocks.len()));
    header.extend(size(blocks.len()));
    header.extend(size(BLOCK));
    // Zero is allowed for a last block that is full, but not every reader then reads that block;
    // its true size is understood by all.
    header.extend(size(bytes.length - BLOCK * blocks.len().saturating_sub(1)));
    for block in &blocks {
        header.extend(size(block.len()));
    }
    out.write_all(BASE64.encode(&header).as_bytes())?;
    let mut text = EncoderWriter::new(out, &BASE64);
    blocks.iter().try_for_each(|block| text.write_all(block))?;
    text.finish().map(drop)
}

/// How arrays are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Compression {
    /// zlib at a level that favours speed; positions keep their full precision, so higher levels
    /// gain little.
    #[default]
    Zlib,
    /// No compression.
    None,
}

impl Compression {
    /// zlib's level, or nothing for uncompressed arrays.
    pub(super) fn level(self) -> Option<u32> {
        match self {
            Self::Zlib => Some(1),
            Self::None => None,
        }
    }

    pub(super) fn attribute(self) -> &'static str {
        match self {
            Self::Zlib => " compressor=\"vtkZLibDataCompressor\"",
            Self::None => "",
        }
    }
}
