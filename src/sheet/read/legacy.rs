//! VTK's old format (`.vtk`): PolyData or an UnstructuredGrid of polygons, as text or binary.
//!
//! vtkio reads it. Done here is what it leaves out: field data between the kind of the data set and
//! its points, where ParaView writes the time; titles that are empty; the escapes in names; the
//! zero that begins the offsets of version 5; and saying where and why a file cannot be read. What
//! it would skip without a word, to the end of the file, is an error.

use std::borrow::Cow;

use vtkio::model::{
    Attribute, Attributes, CellType, DataArrayBase, DataSet, ElementType, IOBuffer, Piece,
    VertexNumbers,
};

use super::model;
use crate::Surface;
use crate::surface::Array;

/// Words that begin a part of the file.
const KEYWORDS: [&str; 20] = [
    "DATASET",
    "FIELD",
    "POINTS",
    "VERTICES",
    "LINES",
    "POLYGONS",
    "TRIANGLE_STRIPS",
    "CELLS",
    "OFFSETS",
    "CONNECTIVITY",
    "CELL_TYPES",
    "POINT_DATA",
    "CELL_DATA",
    "SCALARS",
    "COLOR_SCALARS",
    "LOOKUP_TABLE",
    "VECTORS",
    "NORMALS",
    "TEXTURE_COORDINATES",
    "TENSORS",
];

/// Types of numbers that VTK writes and vtkio does not read.
const UNREAD_TYPES: [&str; 5] =
    ["unsigned_short", "signed_char", "vtktypeint64", "vtktypeuint64", "string"];

/// The first lines of a file, checked.
struct Head<'a> {
    /// `# vtk DataFile Version …`.
    version: &'a [u8],
    /// `ASCII` or `BINARY`.
    coding: &'a [u8],
    /// `DATASET …`.
    kind: &'a [u8],
    /// What follows.
    rest: &'a [u8],
}

/// Reads the bytes of a file.
pub(super) fn parse(bytes: &[u8]) -> Result<Surface, String> {
    let head = head(bytes)?;
    let fault = Fault { bytes, binary: head.coding.eq_ignore_ascii_case(b"BINARY") };
    let (rest, time) = without_field_data(&head, &fault)?;
    // As the file has it if nothing is to be left out, or else without its title and field data.
    let plain = rest.len() == head.rest.len() && vtkio_reads_title(bytes);
    let whole = if plain {
        Cow::Borrowed(bytes)
    } else {
        Cow::Owned(assembled(&head, &[head.kind, b"\n", rest]))
    };
    let read = match data_set(&whole, &fault)? {
        (after, _) if after > 0 => Err(fault.at(Some(after))),
        (_, DataSet::PolyData { pieces, .. }) => {
            let piece = only(pieces)?;
            // The order in which VTK numbers them for the arrays on cells.
            let lists = [
                (piece.verts, model::VERTEX),
                (piece.lines, model::LINE),
                (piece.polys, model::POLYGON),
                (piece.strips, model::STRIP),
            ];
            let lists =
                lists.into_iter().filter_map(|(cells, kind)| Some((cells?, Types::All(kind))));
            surface(piece.points, lists, piece.data)
        }
        (_, DataSet::UnstructuredGrid { pieces, .. }) => {
            let piece = only(pieces)?;
            let list = (piece.cells.cell_verts, Types::Each(piece.cells.types));
            surface(piece.points, [list], piece.data)
        }
        _ => Err("holds neither POLYDATA nor an UNSTRUCTURED_GRID".into()),
    };
    read.map(|surface| Surface { time, ..surface })
}

/// The first three lines and the kind of the data set.
fn head(bytes: &[u8]) -> Result<Head<'_>, String> {
    let (version, rest) = line(bytes);
    if !begins(version, "# vtk DataFile Version ") {
        let hint = if version.starts_with(b"<") {
            ": it looks like one of VTK's XML formats, whose names end in .vtu or .vtp"
        } else {
            ""
        };
        return Err(format!(
            "line 1 is \"{}\" instead of \"# vtk DataFile Version …\"{hint}",
            shown(version)
        ));
    }
    let (_, rest) = line(rest);
    let (coding, rest) = line(rest);
    let coding = coding.trim_ascii();
    if ![&b"ASCII"[..], b"BINARY"].iter().any(|known| coding.eq_ignore_ascii_case(known)) {
        return Err(format!("line 3 is \"{}\" instead of ASCII or BINARY", shown(coding)));
    }
    let (kind, rest) = line(rest.trim_ascii_start());
    let words: Vec<&[u8]> =
        kind.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).collect();
    let known = [&b"POLYDATA"[..], b"UNSTRUCTURED_GRID"];
    match words[..] {
        [first, set] if first.eq_ignore_ascii_case(b"DATASET") => {
            if !known.iter().any(|known| set.eq_ignore_ascii_case(known)) {
                return Err(format!(
                    "holds the data set {}; POLYDATA and UNSTRUCTURED_GRID of polygons are read",
                    shown(set)
                ));
            }
        }
        _ => {
            return Err(format!(
                "\"{}\" follows line 3 instead of DATASET POLYDATA or DATASET UNSTRUCTURED_GRID",
                shown(kind)
            ));
        }
    }
    Ok(Head { version, coding, kind, rest })
}

/// Whether the title is one that vtkio takes: it must not be empty.
fn vtkio_reads_title(bytes: &[u8]) -> bool {
    !line(line(bytes).1).0.is_empty()
}

/// A file of these parts, under the version and coding of `head`.
fn assembled(head: &Head<'_>, parts: &[&[u8]]) -> Vec<u8> {
    let mut whole = [head.version, b"\ntitle\n", head.coding, b"\n"].concat();
    parts.iter().for_each(|part| whole.extend_from_slice(part));
    whole
}

/// What follows the field data of the whole data set, if the file has any, and the time in them: the array `TimeValue`.
fn without_field_data<'a>(
    head: &Head<'a>,
    fault: &Fault<'_>,
) -> Result<(&'a [u8], Option<f64>), String> {
    let rest = head.rest.trim_ascii_start();
    if !begins(rest, "FIELD") {
        return Ok((head.rest, None));
    }
    let (after, data) = data_set(&assembled(head, &[rest]), fault)?;
    let time = match data {
        DataSet::Field { data_array, .. } => {
            let mut times = data_array.into_iter().filter(|array| array.name == "TimeValue");
            times.next().and_then(|array| model::reals(array.data).first().copied())
        }
        _ => None,
    };
    Ok((&rest[rest.len() - after..], time))
}

/// Reads one data set; also how many bytes of the file are left behind it.
fn data_set(whole: &[u8], fault: &Fault<'_>) -> Result<(usize, DataSet), String> {
    match vtkio::parser::parse_be(whole) {
        Ok((after, vtk)) => Ok((after.len(), vtk.data)),
        Err(error) => {
            let mut left = None;
            // Where it is stuck; nothing is known of it where it waits for more bytes.
            let _ = error.map_input(|rest| left = Some(rest.len()));
            Err(fault.at(left.filter(|&left| left < whole.len())))
        }
    }
}

/// The piece of a file; the old format has no others.
fn only<P>(pieces: Vec<Piece<P>>) -> Result<P, String> {
    match pieces.into_iter().next() {
        Some(Piece::Inline(piece)) => Ok(*piece),
        _ => Err("holds no data".into()),
    }
}

/// VTK's types of the cells of a list.
enum Types {
    All(u64),
    Each(Vec<CellType>),
}

/// The surface of these points, lists of cells and attributes.
fn surface(
    points: IOBuffer,
    lists: impl IntoIterator<Item = (VertexNumbers, Types)>,
    data: Attributes,
) -> Result<Surface, String> {
    let mut cells = model::Cells::default();
    for (mut list, types) in lists {
        if let VertexNumbers::XML { offsets, connectivity } = &mut list {
            match offsets.first() {
                Some(0) => drop(offsets.remove(0)),
                None if connectivity.is_empty() => {}
                _ => return Err("the offsets of its cells do not begin with 0".into()),
            }
        }
        let count = match &list {
            VertexNumbers::XML { offsets, .. } => offsets.len(),
            VertexNumbers::Legacy { num_cells, .. } => *num_cells as usize,
        };
        match types {
            Types::All(kind) => model::add(&mut cells, &list, |_| kind)?,
            Types::Each(types) if types.len() == count => {
                model::add(&mut cells, &list, |cell| types[cell] as u64)?;
            }
            Types::Each(types) => {
                return Err(format!("has {} CELL_TYPES for {count} cells", types.len()));
            }
        }
    }
    let mut surface = Surface { points: model::points(points), ..Surface::default() };
    let notes = &mut surface.notes;
    surface.point_arrays = arrays(data.point, "point", surface.points.len(), notes)?;
    let on_cells = arrays(data.cell, "cell", cells.len(), notes)?;
    cells.finish(&mut surface, on_cells)?;
    Ok(surface)
}

/// The arrays on points or cells, of which there are `tuples`.
fn arrays(
    list: Vec<Attribute>,
    place: &str,
    tuples: usize,
    notes: &mut Vec<String>,
) -> Result<Vec<Array>, String> {
    let mut arrays = Vec::new();
    for attribute in list {
        match attribute {
            Attribute::DataArray(DataArrayBase {
                name,
                elem: ElementType::ColorScalars(_) | ElementType::LookupTable,
                ..
            }) => notes.push(format!("the {place} colours \"{}\" were ignored", unescape(&name))),
            Attribute::DataArray(array) => {
                let components = array.num_comp();
                arrays.push(one(&array.name, components, array.data, place, tuples)?);
            }
            Attribute::Field { data_array, .. } => {
                for array in data_array {
                    let components = array.num_comp();
                    arrays.push(one(&array.name, components, array.data, place, tuples)?);
                }
            }
        }
    }
    Ok(arrays)
}

fn one(
    name: &str,
    components: usize,
    data: IOBuffer,
    place: &str,
    tuples: usize,
) -> Result<Array, String> {
    let name = unescape(name);
    let values = model::reals(data);
    if components == 0 || tuples.checked_mul(components) != Some(values.len()) {
        return Err(format!(
            "the {place} array \"{name}\" of {components} components holds {} numbers for {tuples} \
             {place}s",
            values.len()
        ));
    }
    Ok(Array { name, components, values })
}

/// A name with its escapes resolved: `%20` is a space.
fn unescape(name: &str) -> String {
    let mut out = Vec::with_capacity(name.len());
    let mut rest = name.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        let digits = after.get(..2).and_then(|two| std::str::from_utf8(two).ok());
        match digits.and_then(|two| u8::from_str_radix(two, 16).ok()).filter(|_| first == b'%') {
            Some(byte) => {
                out.push(byte);
                rest = &after[2..];
            }
            None => {
                out.push(first);
                rest = after;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// The first line, without its ending, and what follows it.
fn line(bytes: &[u8]) -> (&[u8], &[u8]) {
    let end = bytes.iter().position(|&b| b == b'\n').unwrap_or(bytes.len());
    let line = &bytes[..end];
    (line.strip_suffix(b"\r").unwrap_or(line), bytes.get(end + 1..).unwrap_or_default())
}

fn begins(bytes: &[u8], word: &str) -> bool {
    bytes.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word.as_bytes()))
}

/// The beginning of a piece of the file, for people.
fn shown(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes.trim_ascii()).chars().take(30).collect()
}

/// Says what is wrong with a file, and where.
struct Fault<'a> {
    bytes: &'a [u8],
    binary: bool,
}

impl Fault<'_> {
    /// A fault with `left` bytes to the end of the file, or somewhere.
    fn at(&self, left: Option<usize>) -> String {
        let at = self.bytes.len() - left.unwrap_or(0).min(self.bytes.len());
        let (before, after) = self.bytes.split_at(at);
        let part = last_part(before).map_or_else(String::new, |part| format!(" after \"{part}\""));
        let word = after.trim_ascii_start().split(u8::is_ascii_whitespace).next();
        let word = word.filter(|word| !word.is_empty());
        let Some(word) = word.filter(|_| left.is_some()) else {
            return format!("ends too early{part}: it is cut short, or a count is wrong");
        };
        let (place, found) = if word.is_ascii() && !word.iter().any(u8::is_ascii_control) {
            let skipped = after.len() - after.trim_ascii_start().len();
            let line = self.bytes[..at + skipped].iter().filter(|&&b| b == b'\n').count() + 1;
            // Lines mean little between binary data.
            let place = if self.binary { format!("byte {at}") } else { format!("line {line}") };
            (place, format!("\"{}\"", shown(word)))
        } else {
            (format!("byte {at}"), "something that is not text".to_owned())
        };
        let text = String::from_utf8_lossy(word).to_lowercase();
        let hint = if ["nan", "-nan", "inf", "-inf"].contains(&text.as_str()) {
            "in files of text every number must be finite; save it as binary or as .vtu"
        } else if UNREAD_TYPES.contains(&text.as_str()) {
            "numbers of the types char, short, int, long, float, double, unsigned_char, \
             unsigned_int and unsigned_long are read"
        } else {
            "either a count is wrong, or it is something that is not read here"
        };
        format!("{place}: {found} is not expected{part}: {hint}")
    }
}

/// The last line that begins a part of the file.
fn last_part(before: &[u8]) -> Option<String> {
    let mut lines = before.rsplit(|&b| b == b'\n');
    let found = lines.find(|line| {
        let word = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
        KEYWORDS.iter().any(|known| word.eq_ignore_ascii_case(known.as_bytes()))
    })?;
    Some(shown(found))
}
