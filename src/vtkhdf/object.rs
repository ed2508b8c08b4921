//! Headers and messages of HDF5's objects, version 1, as bytes.

/// An address that is none.
pub(crate) const UNDEFINED: u64 = u64::MAX;

/// Types of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    F64,
    I64,
    U8,
}

impl Kind {
    /// Bytes of a number.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::F64 | Self::I64 => 8,
            Self::U8 => 1,
        }
    }

    /// The datatype message: class and version, bits of the class, size, properties.
    fn message(self) -> Vec<u8> {
        let mut out = match self {
            // Little-endian, mantissa normalised, sign in bit 63.
            Self::F64 => vec![0x11, 0x20, 63, 0, 8, 0, 0, 0],
            Self::I64 => vec![0x10, 0x08, 0, 0, 8, 0, 0, 0],
            Self::U8 => vec![0x10, 0x00, 0, 0, 1, 0, 0, 0],
        };
        match self {
            // Offset 0, 64 bits; exponent of 11 bits from 52 on, mantissa of 52 from 0 on, bias 1023.
            Self::F64 => out.extend([0, 0, 64, 0, 52, 11, 0, 52, 0xFF, 0x03, 0, 0]),
            Self::I64 => out.extend([0, 0, 64, 0]),
            Self::U8 => out.extend([0, 0, 8, 0]),
        }
        out
    }
}

/// Where the pieces of a data set are.
pub(crate) enum Layout {
    /// In one place.
    Contiguous { address: u64, size: u64 },
    /// In chunks of these extents, in a tree at an address yet to be written.
    Chunked { chunk: Vec<u64> },
}

/// Bytes padded with zeros to a multiple of 8.
pub(crate) fn padded(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

/// A message of an object: its type and data.
pub(crate) type Message = (u16, Vec<u8>);

/// The header of an object, and where the data of each message begin in it.
pub(crate) fn header(messages: Vec<Message>, links: u32) -> (Vec<u8>, Vec<usize>) {
    let body: usize = messages.iter().map(|(_, data)| 8 + data.len().next_multiple_of(8)).sum();
    let mut out = vec![1, 0];
    out.extend(u16::try_from(messages.len()).unwrap_or(u16::MAX).to_le_bytes());
    out.extend(links.to_le_bytes());
    out.extend(u32::try_from(body).unwrap_or(u32::MAX).to_le_bytes());
    out.extend([0; 4]);
    let mut places = Vec::new();
    for (kind, data) in messages {
        let data = padded(data);
        out.extend(kind.to_le_bytes());
        out.extend(u16::try_from(data.len()).unwrap_or(u16::MAX).to_le_bytes());
        out.extend([0; 4]);
        places.push(out.len());
        out.extend(data);
    }
    (out, places)
}

/// Extents; the first may grow without end if `grows`.
pub(crate) fn dataspace(dims: &[u64], grows: bool) -> Vec<u8> {
    let rank = u8::try_from(dims.len()).unwrap_or(u8::MAX);
    let mut out = vec![1, rank, u8::from(grows), 0, 0, 0, 0, 0];
    out.extend(dims.iter().flat_map(|d| d.to_le_bytes()));
    if grows {
        let most = dims.iter().enumerate().map(|(k, d)| if k == 0 { u64::MAX } else { *d });
        out.extend(most.flat_map(u64::to_le_bytes));
    }
    out
}

/// The messages of a data set; the tree of one in chunks is at byte 3 of the layout's data.
pub(crate) fn dataset(
    kind: Kind,
    dims: &[u64],
    layout: &Layout,
    fill: u64,
    compressed: bool,
) -> Vec<Message> {
    let size = u8::try_from(kind.size()).unwrap_or(8);
    // Space is allocated incrementally, a fill value is written if set.
    let mut filling = vec![2, 3, 2, 1, size, 0, 0, 0];
    filling.extend(&fill.to_le_bytes()[..kind.size()]);
    let mut place = vec![3];
    match layout {
        Layout::Contiguous { address, size } => {
            place.push(1);
            place.extend(address.to_le_bytes());
            place.extend(size.to_le_bytes());
        }
        Layout::Chunked { chunk } => {
            place.extend([2, u8::try_from(chunk.len() + 1).unwrap_or(u8::MAX)]);
            place.extend(UNDEFINED.to_le_bytes());
            let extents = chunk.iter().map(|&c| u32::try_from(c).unwrap_or(u32::MAX));
            place.extend(extents.chain([u32::from(size)]).flat_map(u32::to_le_bytes));
        }
    }
    let grows = matches!(layout, Layout::Chunked { .. });
    let mut messages = vec![
        (0x01, dataspace(dims, grows)),
        (0x03, kind.message()),
        (0x05, filling),
        (0x08, place),
    ];
    if compressed {
        let mut filters = vec![1, 2, 0, 0, 0, 0, 0, 0];
        // Number of the filter, length of its name, flags, one number of the client: shuffle of bytes, then deflate.
        for (filter, value) in [(2u16, u32::from(size)), (1, 1)] {
            filters.extend([filter, 0, 0, 1].iter().flat_map(|n| n.to_le_bytes()));
            filters.extend(value.to_le_bytes());
            filters.extend([0; 4]);
        }
        messages.push((0x0B, filters));
    }
    messages
}

/// An attribute with numbers, or with one text.
pub(crate) fn attribute(name: &str, value: &Attribute) -> Message {
    let (kind, space, data) = match value {
        Attribute::Number(n) => {
            (Kind::I64.message(), dataspace(&[], false), n.to_le_bytes().to_vec())
        }
        Attribute::Pair(pair) => {
            (Kind::I64.message(), dataspace(&[2], false), pair.map(i64::to_le_bytes).concat())
        }
        Attribute::Text(text) => {
            let mut kind = vec![0x13, 0, 0, 0];
            kind.extend(u32::try_from(text.len()).unwrap_or(u32::MAX).to_le_bytes());
            // UTF-8 where it is more than ASCII.
            kind[1] = if text.is_ascii() { 0x01 } else { 0x11 };
            (kind, dataspace(&[], false), text.as_bytes().to_vec())
        }
    };
    let mut out = vec![1, 0];
    let short = |n: usize| u16::try_from(n).unwrap_or(u16::MAX).to_le_bytes();
    out.extend(short(name.len() + 1));
    out.extend(short(kind.len()));
    out.extend(short(space.len()));
    let mut zero_ended = name.as_bytes().to_vec();
    zero_ended.push(0);
    out.extend(padded(zero_ended));
    out.extend(padded(kind));
    out.extend(padded(space));
    out.extend(data);
    (0x0C, out)
}

/// The value of an attribute.
#[derive(Debug, Clone)]
pub(crate) enum Attribute {
    Number(i64),
    Pair([i64; 2]),
    Text(String),
}
