//! Data sets of HDF5 files in the layout of HDF5 1.0, read row by row.
//!
//! Files of this crate, and those that h5py and VTK write as they do by default. Nothing that a file says makes the reader
//! allocate much more than what it asks for: sizes are compared with the file's.

use std::io::{Read, Seek, SeekFrom};

use rumple_numerics::num::real;

use super::chunk::Wanted;
use super::object::UNDEFINED;

/// Most bytes of a chunk, of a header and of the names of a group.
pub(crate) const MAX_BYTES: u64 = 1 << 31;
/// Deepest tree, longest chain of parts of a header, most links of a group.
const MAX_DEPTH: usize = 16;
const MAX_PARTS: usize = 64;
const MAX_LINKS: usize = 4096;
/// A deflated chunk may grow so many times: what deflate can do.
pub(crate) const MAX_TIMES: u64 = 1100;

/// Types of numbers that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Number {
    Signed(usize),
    Unsigned(usize),
    Float(usize),
}

impl Number {
    pub(crate) fn size(self) -> usize {
        match self {
            Self::Signed(n) | Self::Unsigned(n) | Self::Float(n) => n,
        }
    }

    fn from_message(data: &[u8]) -> Result<Self, String> {
        let size = u32_at(data, 4)? as usize;
        let flags = *data.get(1).unwrap_or(&0);
        let class = data.first().unwrap_or(&0) & 0x0F;
        match (class, size) {
            (0, 1 | 2 | 4 | 8) if flags & 1 == 0 => Ok(match flags & 8 {
                0 => Self::Unsigned(size),
                _ => Self::Signed(size),
            }),
            (1, 4 | 8) if flags & 1 == 0 => Ok(Self::Float(size)),
            _ => Err(format!(
                "numbers of class {class} with {size} bytes; little-endian ones are read"
            )),
        }
    }

    /// One number from its bytes.
    pub(crate) fn value(self, bytes: &[u8]) -> f64 {
        let mut wide = [0; 8];
        wide[..bytes.len()].copy_from_slice(bytes);
        match self {
            Self::Float(4) => {
                f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
            }
            Self::Float(_) => f64::from_le_bytes(wide),
            Self::Unsigned(_) => {
                real(usize::try_from(u64::from_le_bytes(wide)).unwrap_or(usize::MAX))
            }
            Self::Signed(n) => {
                let shift = 64 - 8 * n;
                let value = (i64::from_le_bytes(wide) << shift) >> shift;
                let size = real(usize::try_from(value.unsigned_abs()).unwrap_or(usize::MAX));
                if value < 0 { -size } else { size }
            }
        }
    }
}

/// Where the numbers of a data set are.
#[derive(Debug, Clone)]
enum Storage {
    Contiguous { address: u64, size: u64 },
    Chunked { tree: u64, chunk: Vec<u64> },
}

/// A data set.
#[derive(Debug, Clone)]
pub(crate) struct Dataset {
    pub(crate) extents: Vec<u64>,
    pub(crate) number: Number,
    storage: Storage,
    /// Numbers of the filters, in the order of writing.
    pub(crate) filters: Vec<u16>,
    fill: f64,
    /// The attribute `name`, if there is one.
    pub(crate) title: Option<String>,
}

/// A file.
pub(crate) struct Reader<R> {
    source: R,
    length: u64,
    root: u64,
}

fn u16_at(bytes: &[u8], at: usize) -> Result<u16, String> {
    let found = bytes.get(at..).and_then(|rest| rest.first_chunk());
    found.map(|n| u16::from_le_bytes(*n)).ok_or_else(short)
}

fn u32_at(bytes: &[u8], at: usize) -> Result<u32, String> {
    let found = bytes.get(at..).and_then(|rest| rest.first_chunk());
    found.map(|n| u32::from_le_bytes(*n)).ok_or_else(short)
}

fn u64_at(bytes: &[u8], at: usize) -> Result<u64, String> {
    let found = bytes.get(at..).and_then(|rest| rest.first_chunk());
    found.map(|n| u64::from_le_bytes(*n)).ok_or_else(short)
}

pub(crate) fn short() -> String {
    "an object of the file is cut short".to_owned()
}

impl<R: Read + Seek> Reader<R> {
    /// Reads the superblock.
    pub(crate) fn open(mut source: R) -> Result<Self, String> {
        let length = source.seek(SeekFrom::End(0)).map_err(|e| format!("cannot be read: {e}"))?;
        let mut reader = Self { source, length, root: 0 };
        let head = reader.bytes(0, 96.min(length))?;
        if !head.starts_with(b"\x89HDF\r\n\x1a\n") {
            return Err("does not begin as an HDF5 file does".into());
        }
        let version = head.get(8).copied().unwrap_or(0);
        let base = match version {
            0 => 24,
            1 => 28,
            _ => {
                return Err(format!(
                    "is an HDF5 file with superblock {version}; superblocks 0 and 1 are read (libver=\"earliest\")"
                ));
            }
        };
        if head.get(13..15) != Some(&[8, 8]) {
            return Err("has addresses of other than 8 bytes".into());
        }
        let end = u64_at(&head, base + 16)?;
        if end > length {
            return Err(format!("has {length} bytes instead of {end}: it is cut short"));
        }
        reader.root = u64_at(&head, base + 40)?;
        Ok(reader)
    }

    fn bytes(&mut self, at: u64, size: u64) -> Result<Vec<u8>, String> {
        let end = at.checked_add(size).filter(|end| *end <= self.length && size <= MAX_BYTES);
        if end.is_none() {
            return Err(format!(
                "names {size} bytes at byte {at}, and has {}: it is damaged",
                self.length
            ));
        }
        let mut bytes = vec![0; usize::try_from(size).map_err(|_| short())?];
        let read =
            self.source.seek(SeekFrom::Start(at)).and_then(|_| self.source.read_exact(&mut bytes));
        read.map_err(|e| format!("cannot be read: {e}"))?;
        Ok(bytes)
    }

    /// The messages of an object.
    fn messages(&mut self, address: u64) -> Result<Vec<(u16, Vec<u8>)>, String> {
        let head = self.bytes(address, 16)?;
        if head[0] != 1 {
            return Err(format!(
                "the object at byte {address} has a header of another version than 1"
            ));
        }
        let count = usize::from(u16_at(&head, 2)?);
        let mut parts = vec![(address + 16, u64::from(u32_at(&head, 8)?))];
        let mut found = Vec::new();
        let mut part = 0;
        while part < parts.len() && part < MAX_PARTS {
            let (at, size) = parts[part];
            part += 1;
            let bytes = self.bytes(at, size)?;
            let mut at = 0;
            while at + 8 <= bytes.len() && found.len() < count {
                let (kind, size) = (u16_at(&bytes, at)?, usize::from(u16_at(&bytes, at + 2)?));
                let data = bytes.get(at + 8..at + 8 + size).ok_or_else(short)?.to_vec();
                if kind == 0x10 {
                    parts.push((u64_at(&data, 0)?, u64_at(&data, 8)?));
                }
                found.push((kind, data));
                at += 8 + size;
            }
        }
        Ok(found)
    }

    /// Names and addresses of what a group holds, in their order.
    pub(crate) fn members(&mut self, group: u64) -> Result<Vec<(String, u64)>, String> {
        let messages = self.messages(group)?;
        let table = messages.iter().find(|(kind, _)| *kind == 0x11);
        let (_, table) =
            table.ok_or_else(|| format!("the object at byte {group} is not a group"))?;
        let (tree, heap) = (u64_at(table, 0)?, u64_at(table, 8)?);
        let head = self.bytes(heap, 32)?;
        if !head.starts_with(b"HEAP") {
            return Err(format!("no heap of names at byte {heap}"));
        }
        let names = self.bytes(u64_at(&head, 24)?, u64_at(&head, 8)?)?;
        let mut found = Vec::new();
        self.symbols(tree, &names, &mut found, 0)?;
        Ok(found)
    }

    fn symbols(
        &mut self,
        node: u64,
        names: &[u8],
        found: &mut Vec<(String, u64)>,
        depth: usize,
    ) -> Result<(), String> {
        let head = self.bytes(node, 8)?;
        let count = u64::from(u16_at(&head, 6)?);
        if head.starts_with(b"SNOD") {
            let entries = self.bytes(node + 8, 40 * count)?;
            for entry in entries.chunks_exact(40) {
                let at = usize::try_from(u64_at(entry, 0)?).map_err(|_| short())?;
                let rest = names.get(at..).ok_or_else(short)?;
                let end = rest.iter().position(|b| *b == 0).unwrap_or(rest.len());
                let name = String::from_utf8_lossy(&rest[..end]).into_owned();
                found.push((name, u64_at(entry, 8)?));
                if found.len() > MAX_LINKS {
                    return Err(format!("a group has more than {MAX_LINKS} links"));
                }
            }
            return Ok(());
        }
        if !head.starts_with(b"TREE\0") || depth > MAX_DEPTH {
            return Err(format!("no table of names at byte {node}"));
        }
        let entries = self.bytes(node + 24, 16 * count + 8)?;
        for k in 0..usize::try_from(count).unwrap_or(0) {
            self.symbols(u64_at(&entries, 16 * k + 8)?, names, found, depth + 1)?;
        }
        Ok(())
    }

    /// The bytes of an attribute of the object at `address`.
    pub(crate) fn attribute(
        &mut self,
        address: u64,
        name: &str,
    ) -> Result<Option<Vec<u8>>, String> {
        let messages = self.messages(address)?;
        messages
            .iter()
            .filter(|(kind, _)| *kind == 0x0C)
            .find_map(|(_, data)| named(data, name))
            .transpose()
    }

    /// The data set at `address`.
    pub(crate) fn dataset(&mut self, address: u64) -> Result<Dataset, String> {
        let messages = self.messages(address)?;
        let of = |kind: u16| {
            messages.iter().find(|(other, _)| *other == kind).map(|(_, data)| &data[..])
        };
        let missing = |what: &str| {
            format!("the object at byte {address} has no {what}: it is not a data set")
        };
        let space = of(0x01).ok_or_else(|| missing("extent"))?;
        let rank = usize::from(*space.get(1).ok_or_else(short)?);
        let start = if space.first() == Some(&1) { 8 } else { 4 };
        if rank > 3 {
            return Err(format!("a data set has {rank} dimensions; at most 3 are read"));
        }
        let extents: Result<Vec<u64>, _> =
            (0..rank).map(|k| u64_at(space, start + 8 * k)).collect();
        let number = Number::from_message(of(0x03).ok_or_else(|| missing("type"))?)?;
        let layout = of(0x08).ok_or_else(|| missing("layout"))?;
        let storage = match layout.get(..2) {
            Some([3, 1]) => {
                Storage::Contiguous { address: u64_at(layout, 2)?, size: u64_at(layout, 10)? }
            }
            Some([3, 2]) => {
                let dimensions = usize::from(*layout.get(2).ok_or_else(short)?);
                if dimensions != rank + 1 {
                    return Err(format!("chunks of {dimensions} extents for a data set of {rank}"));
                }
                let extent = |k: usize| u32_at(layout, 11 + 4 * k).map(u64::from);
                let chunk: Result<Vec<u64>, _> = (0..rank).map(extent).collect();
                Storage::Chunked { tree: u64_at(layout, 3)?, chunk: chunk? }
            }
            found => return Err(format!("the layout {found:?} of a data set is not read")),
        };
        let filters = of(0x0B).map_or(Ok(Vec::new()), filters)?;
        let fill = of(0x05).filter(|data| data.first() == Some(&2) && data.get(3) == Some(&1));
        let fill =
            fill.and_then(|data| data.get(8..8 + number.size())).map_or(0.0, |b| number.value(b));
        let title =
            messages.iter().filter(|(kind, _)| *kind == 0x0C).find_map(|(_, d)| named(d, "name"));
        let title = title.transpose()?.map(|text| String::from_utf8_lossy(&text).into_owned());
        Ok(Dataset { extents: extents?, number, storage, filters, fill, title })
    }

    /// `count` rows of a data set from row `start` on, columns together.
    pub(crate) fn rows(
        &mut self,
        set: &Dataset,
        start: u64,
        count: u64,
    ) -> Result<Vec<f64>, String> {
        let columns: u64 = set
            .extents
            .iter()
            .skip(1)
            .try_fold(1u64, |n, e| n.checked_mul(*e))
            .ok_or_else(short)?;
        let rows = set.extents.first().copied().unwrap_or(1);
        let all = start
            .checked_add(count)
            .filter(|end| *end <= rows)
            .and_then(|_| count.checked_mul(columns));
        // What fits in memory and what deflate can make of the file's bytes.
        let most = self.length.saturating_mul(MAX_TIMES).min(MAX_BYTES);
        let Some(all) = all.filter(|all| *all <= most) else {
            return Err(format!(
                "rows {start} to {} of a data set of {rows} are needed",
                start.saturating_add(count)
            ));
        };
        let size = set.number.size();
        match &set.storage {
            Storage::Contiguous { address, size: stored } => {
                let from = start * columns * size as u64;
                if from.saturating_add(all * size as u64) > *stored {
                    return Err(short());
                }
                let bytes = self.bytes(address.saturating_add(from), all * size as u64)?;
                Ok(bytes.chunks_exact(size).map(|b| set.number.value(b)).collect())
            }
            Storage::Chunked { tree, chunk } => {
                if chunk.first().copied().unwrap_or(0) == 0 || chunk[1..] != set.extents[1..] {
                    return Err("a data set has chunks that are not whole rows".into());
                }
                let mut values = vec![set.fill; usize::try_from(all).map_err(|_| short())?];
                if *tree != UNDEFINED {
                    let wanted = Wanted { set, chunk: chunk[0], columns, start, count };
                    self.chunks(*tree, &wanted, &mut values, 0)?;
                }
                Ok(values)
            }
        }
    }

    /// Fills in the chunks below a node that hold wanted rows.
    fn chunks(
        &mut self,
        node: u64,
        wanted: &Wanted,
        values: &mut [f64],
        depth: usize,
    ) -> Result<(), String> {
        let rank = wanted.set.extents.len();
        let head = self.bytes(node, 8)?;
        if !head.starts_with(b"TREE\x01") || depth > MAX_DEPTH {
            return Err(format!("no index of chunks at byte {node}"));
        }
        let (level, count) = (head[5], usize::from(u16_at(&head, 6)?));
        let step = 8 + 8 * (rank + 1) + 8;
        let entries = self.bytes(node + 24, (step * count + step - 8) as u64)?;
        for k in 0..count {
            let entry = &entries[k * step..];
            let first = u64_at(entry, 8)?;
            // Of the last entry everything from its first row on.
            let last = k + 1 == count;
            let end = if last { u64::MAX } else { u64_at(entry, step + 8)? };
            let end = if level == 0 { first.saturating_add(wanted.chunk) } else { end };
            if end <= wanted.start || first >= wanted.start + wanted.count {
                continue;
            }
            let child = u64_at(entry, step - 8)?;
            if level > 0 {
                self.chunks(child, wanted, values, depth + 1)?;
                continue;
            }
            let stored = self.bytes(child, u32_at(entry, 0)?.into())?;
            let bytes = wanted.unpacked(stored, u32_at(entry, 4)?)?;
            wanted.copy(first, &bytes, values)?;
        }
        Ok(())
    }

    /// The address of the root group.
    pub(crate) fn root(&self) -> u64 {
        self.root
    }
}

/// The numbers of filters.
fn filters(data: &[u8]) -> Result<Vec<u16>, String> {
    if data.first() != Some(&1) {
        return Err("the filters of a data set are of another version than 1".into());
    }
    let mut at = 8;
    let mut found = Vec::new();
    for _ in 0..*data.get(1).unwrap_or(&0) {
        found.push(u16_at(data, at)?);
        let (name, values) =
            (usize::from(u16_at(data, at + 2)?), usize::from(u16_at(data, at + 6)?));
        at += 8 + name + 4 * values.next_multiple_of(2);
    }
    Ok(found)
}

/// The bytes of an attribute, if it has this name.
fn named(data: &[u8], name: &str) -> Option<Result<Vec<u8>, String>> {
    let sizes = [2, 4, 6].map(|at| u16_at(data, at).map(usize::from));
    let [Ok(n), Ok(kind), Ok(space)] = sizes else { return None };
    // Version 3 has no padding, and the coding of the name in one more byte.
    let (start, pad): (usize, fn(usize) -> usize) = match data.first()? {
        1 => (8, |n| n.next_multiple_of(8)),
        2 => (8, |n| n),
        3 => (9, |n| n),
        _ => return None,
    };
    let text = data.get(start..start + n)?;
    if text.strip_suffix(b"\0").unwrap_or(text) != name.as_bytes() {
        return None;
    }
    let value = start + pad(n) + pad(kind) + pad(space);
    let size = u32_at(data, start + pad(n) + 4).ok()? as usize;
    // Padding of the message is not part of it; no attribute that is read has more than one value.
    Some(data.get(value..value + size).map(<[u8]>::to_vec).ok_or_else(short))
}
