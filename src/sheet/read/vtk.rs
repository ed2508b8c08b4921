//! VTK's XML formats: an UnstructuredGrid (`.vtu`) or PolyData (`.vtp`) of polygons.
//!
//! vtkio reads these files too, but it drops arrays that it cannot decode without a word, so that a
//! species would be missing from a state; it loses blocks whose size is given as 0, cannot read raw
//! or LZMA data, and panics or allocates where sizes in a file are wrong. Every fault has its test.

use vtkio::model::{ByteOrder, IOBuffer, VertexNumbers};

use super::decode::{Budget, Compressor, Encoding, Source, numbers, scalar};
use super::model::{self, Cells};
use super::xml::{Scanner, Tag, Token};
use crate::Surface;
use crate::surface::Array;
use rumple_numerics::Vec3;
use rumple_numerics::num::index;

/// The two kinds of files that can hold a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    UnstructuredGrid,
    PolyData,
}

/// A `<DataArray>` with the section it stands in, not yet decoded.
struct Raw<'a> {
    section: &'a str,
    tag: Tag<'a>,
    text: &'a [u8],
}

/// The file taken apart.
struct File<'a> {
    encoding: Encoding,
    budget: Budget,
    piece: Tag<'a>,
    arrays: Vec<Raw<'a>>,
    /// What follows the underscore of `<AppendedData>`, and whether it is base64.
    appended: Option<(&'a [u8], bool)>,
}

/// Reads the bytes of a file.
pub(super) fn parse(bytes: &[u8], kind: Kind) -> Result<Surface, String> {
    let file = take_apart(bytes, kind)?;
    let points = file.piece.count("NumberOfPoints")?.unwrap_or(0);
    let mut surface = Surface { points: file.points(points)?, ..Surface::default() };
    let cells = match kind {
        Kind::UnstructuredGrid => file.cells()?,
        Kind::PolyData => file.polygons()?,
    };
    surface.point_arrays = file.attributes("PointData", points, &mut surface.notes)?;
    let on_cells = file.attributes("CellData", cells.len(), &mut surface.notes)?;
    cells.finish(&mut surface, on_cells)?;
    surface.time = file.time()?;
    Ok(surface)
}

/// Finds the piece, its arrays and the appended data.
fn take_apart(bytes: &[u8], kind: Kind) -> Result<File<'_>, String> {
    let mut scanner = Scanner::new(bytes);
    let mut parts = Parts { kind, encoding: None, pieces: Vec::new(), arrays: Vec::new() };
    let mut appended = None;
    let mut open: Vec<&str> = Vec::new();
    while let Some(token) = scanner.token()? {
        match token {
            Token::Start(tag) => {
                parts.open(&tag, &open)?;
                // Raw bytes may look like tags; nothing of interest follows them.
                if tag.name == "AppendedData" {
                    appended = Some(appended_data(scanner.rest(), &tag)?);
                    break;
                }
                if !tag.empty {
                    open.push(tag.name);
                }
            }
            Token::End(name) => {
                if open.pop() != Some(name) {
                    return Err(format!("line {}: </{name}> closes nothing", scanner.line()));
                }
            }
            Token::Text(text) if open.last() == Some(&"DataArray") => parts.text(text),
            Token::Text(_) => {}
        }
    }
    if appended.is_none() && !open.is_empty() {
        return Err(format!(
            "line {}: the file ends inside <{}>: it is cut short",
            scanner.line(),
            open.get(..10).unwrap_or(&open).join("><")
        ));
    }
    let Parts { encoding, pieces, arrays, .. } = parts;
    let encoding = encoding.ok_or("is empty: no <VTKFile> in it")?;
    let count = pieces.len();
    match <[Tag; 1]>::try_from(pieces) {
        Ok([piece]) => {
            let budget = Budget::new(bytes.len());
            Ok(File { encoding, budget, piece, arrays, appended })
        }
        Err(_) => Err(format!("has {count} pieces; exactly one is read (merge the blocks first)")),
    }
}

/// The contents of a file before its appended data.
struct Parts<'a> {
    kind: Kind,
    encoding: Option<Encoding>,
    pieces: Vec<Tag<'a>>,
    arrays: Vec<Raw<'a>>,
}

impl<'a> Parts<'a> {
    /// A tag opens inside of those that are `open`.
    fn open(&mut self, tag: &Tag<'a>, open: &[&'a str]) -> Result<(), String> {
        match tag.name {
            "VTKFile" if open.is_empty() => self.encoding = Some(header(tag, self.kind)?),
            name if self.encoding.is_none() => {
                return Err(format!("line {}: <{name}> instead of <VTKFile>", tag.line));
            }
            "Piece" => self.pieces.push(tag.clone()),
            "DataArray" | "Array" => {
                let section = open.last().copied().unwrap_or_default();
                self.arrays.push(Raw { section, tag: tag.clone(), text: &[] });
            }
            _ => {}
        }
        Ok(())
    }

    /// The text of the array that is open.
    fn text(&mut self, text: &'a [u8]) {
        if let Some(array) = self.arrays.last_mut().filter(|array| array.text.is_empty()) {
            array.text = text.trim_ascii();
        }
    }
}

/// The appended data, after the underscore in `rest`, and whether they are coded in base 64.
fn appended_data<'a>(rest: &'a [u8], tag: &Tag<'_>) -> Result<(&'a [u8], bool), String> {
    let start = rest.iter().position(|&b| b == b'_');
    let start = start
        .ok_or_else(|| format!("line {}: no underscore begins the appended data", tag.line))?;
    Ok((&rest[start + 1..], tag.get("encoding") != Some("raw")))
}

/// The attributes of `<VTKFile>`.
fn header(tag: &Tag, kind: Kind) -> Result<Encoding, String> {
    let wrong = |name: &str, known: &str| {
        let given = tag.get(name).unwrap_or("nothing");
        format!("line {}: {name} is \"{given}\"; {known} can be read here", tag.line)
    };
    let expected = match kind {
        Kind::UnstructuredGrid => "UnstructuredGrid",
        Kind::PolyData => "PolyData",
    };
    if tag.get("type") != Some(expected) {
        return Err(wrong("type", expected));
    }
    Ok(Encoding {
        order: match tag.get("byte_order") {
            None | Some("LittleEndian") => ByteOrder::LittleEndian,
            Some("BigEndian") => ByteOrder::BigEndian,
            _ => return Err(wrong("byte_order", "LittleEndian or BigEndian")),
        },
        header: match tag.get("header_type") {
            None | Some("UInt32") => 4,
            Some("UInt64") => 8,
            _ => return Err(wrong("header_type", "UInt32 or UInt64")),
        },
        compressor: match tag.get("compressor") {
            None | Some("") => Compressor::None,
            Some("vtkZLibDataCompressor") => Compressor::Zlib,
            Some("vtkLZ4DataCompressor") => Compressor::Lz4,
            Some("vtkLZMADataCompressor") => Compressor::Lzma,
            _ => return Err(wrong("compressor", "zlib, LZ4 or LZMA as VTK names them")),
        },
    })
}

impl File<'_> {
    /// The only array of a section, or the one of this name.
    fn array(&self, section: &str, name: Option<&str>) -> Result<&Raw<'_>, String> {
        self.arrays
            .iter()
            .find(|a| a.section == section && (name.is_none() || a.tag.get("Name") == name))
            .ok_or_else(|| format!("has no array {} in <{section}>", name.unwrap_or_default()))
    }

    /// Decodes an array with `tuples` entries; returns the components too.
    fn decode(&self, raw: &Raw, tuples: usize) -> Result<(usize, IOBuffer), String> {
        let tag = &raw.tag;
        let name = tag.get("Name").unwrap_or("without a name");
        let at = |why: String| format!("line {}: the array \"{name}\" {why}", tag.line);
        let kind = tag.get("type").unwrap_or_default();
        let scalar = scalar(kind).ok_or_else(|| at(format!("has unknown type \"{kind}\"")))?;
        let components = tag.count("NumberOfComponents")?.unwrap_or(1).max(1);
        let count =
            tuples.checked_mul(components).ok_or_else(|| at("has an impossible size".into()))?;
        let source = match tag.get("format") {
            Some("ascii") => Source::Ascii(raw.text),
            Some("binary") => Source::Base64(raw.text),
            Some("appended") => {
                let (data, base64) = self
                    .appended
                    .ok_or_else(|| at("is in appended data that are missing".into()))?;
                let offset = tag.count("offset")?.unwrap_or(0);
                let data = data
                    .get(offset..)
                    .ok_or_else(|| at("begins behind the end: the file is cut short".into()))?;
                if base64 { Source::Base64(data) } else { Source::Raw(data) }
            }
            other => return Err(at(format!("has unknown format {other:?}"))),
        };
        if count == 0 {
            return Ok((components, IOBuffer::U8(Vec::new())));
        }
        Ok((components, numbers(source, scalar, count, self.encoding, &self.budget).map_err(at)?))
    }

    fn points(&self, count: usize) -> Result<Vec<Vec3>, String> {
        let (components, values) = self.decode(self.array("Points", None)?, count)?;
        if components != 3 {
            return Err(format!("has points of {components} coordinates instead of 3"));
        }
        Ok(model::points(values))
    }

    /// Cells of an unstructured grid.
    fn cells(&self) -> Result<Cells, String> {
        let count = self.piece.count("NumberOfCells")?.unwrap_or(0);
        let types = self.positions("Cells", "types", count)?;
        let mut cells = Cells::default();
        self.add(&mut cells, "Cells", count, |cell| types[cell])?;
        Ok(cells)
    }

    /// Cells of polygonal data, in the order in which VTK numbers them.
    fn polygons(&self) -> Result<Cells, String> {
        let mut cells = Cells::default();
        for (section, kind) in [
            ("Verts", model::VERTEX),
            ("Lines", model::LINE),
            ("Polys", model::POLYGON),
            ("Strips", model::STRIP),
        ] {
            let count = self.piece.count(&format!("NumberOf{section}"))?.unwrap_or(0);
            if count > 0 {
                self.add(&mut cells, section, count, |_| kind)?;
            }
        }
        Ok(cells)
    }

    /// Adds the cells that `connectivity` and `offsets` of a section give.
    fn add(
        &self,
        cells: &mut Cells,
        section: &str,
        count: usize,
        types: impl Fn(usize) -> u64,
    ) -> Result<(), String> {
        let offsets = self.positions(section, "offsets", count)?;
        let corners = offsets.last().map_or(Ok(0), |&last| {
            usize::try_from(last).map_err(|_| format!("the last offset of <{section}> is {last}"))
        })?;
        let connectivity = self.positions(section, "connectivity", corners)?;
        model::add(cells, &VertexNumbers::XML { connectivity, offsets }, types)
    }

    /// An array of whole numbers from 0.
    fn positions(&self, section: &str, name: &str, count: usize) -> Result<Vec<u64>, String> {
        let (_, values) = self.decode(self.array(section, Some(name))?, count)?;
        model::positions(values, name)
    }

    /// The field array `TimeValue`, if there is one.
    fn time(&self) -> Result<Option<f64>, String> {
        let is_time =
            |raw: &&Raw<'_>| raw.section == "FieldData" && raw.tag.get("Name") == Some("TimeValue");
        let Some(raw) = self.arrays.iter().find(is_time) else { return Ok(None) };
        let (_, values) = self.decode(raw, 1)?;
        Ok(model::reals(values).first().copied())
    }

    /// The arrays of a section, in the file's order; those that are not of numbers, as bits and text, are noted.
    fn attributes(
        &self,
        section: &str,
        tuples: usize,
        notes: &mut Vec<String>,
    ) -> Result<Vec<Array>, String> {
        let mut arrays = Vec::new();
        for (i, raw) in self.arrays.iter().filter(|a| a.section == section).enumerate() {
            let name =
                raw.tag.get("Name").map_or_else(|| format!("array {}", index(i)), str::to_owned);
            let kind = raw.tag.get("type").unwrap_or_default();
            if ["Bit", "String"].contains(&kind) {
                notes.push(format!("the array \"{name}\" of type {kind} was ignored"));
                continue;
            }
            let (components, values) = self.decode(raw, tuples)?;
            arrays.push(Array { name, components, values: model::reals(values) });
        }
        Ok(arrays)
    }
}
