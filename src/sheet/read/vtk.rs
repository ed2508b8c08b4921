//! VTK's XML formats: an UnstructuredGrid (`.vtu`) or PolyData (`.vtp`) of triangles.
//!
//! vtkio reads these files too, but it drops arrays that it cannot decode without a word, so that a
//! species would be missing from a state, and it believes the sizes in a file before it allocates.

use super::decode::{Compressor, Encoding, Number, Scalar, Source, numbers};
use super::xml::{Scanner, Tag, Token};
use crate::Vec3;
use crate::num::index;
use crate::sheet::Surface;
use crate::sheet::surface::Array;

/// VTK's number for a triangle.
const TRIANGLE: usize = 5;

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
    surface.triangles = match kind {
        Kind::UnstructuredGrid => file.cells()?,
        Kind::PolyData => file.polygons()?,
    };
    surface.point_arrays = file.attributes("PointData", points)?;
    surface.cell_arrays = file.attributes("CellData", surface.triangles.len())?;
    Ok(surface)
}

/// Finds the piece, its arrays and the appended data.
fn take_apart(bytes: &[u8], kind: Kind) -> Result<File<'_>, String> {
    let mut scanner = Scanner::new(bytes);
    let mut encoding = None;
    let mut pieces: Vec<Tag> = Vec::new();
    let mut arrays: Vec<Raw> = Vec::new();
    let mut appended = None;
    let mut open: Vec<&str> = Vec::new();
    while let Some(token) = scanner.token()? {
        match token {
            Token::Start(tag) => {
                match tag.name {
                    "VTKFile" if open.is_empty() => encoding = Some(header(&tag, kind)?),
                    _ if encoding.is_none() => {
                        return Err(format!(
                            "line {}: <{}> instead of <VTKFile>",
                            tag.line, tag.name
                        ));
                    }
                    "Piece" => pieces.push(tag.clone()),
                    "DataArray" => {
                        let section = open.last().copied().unwrap_or_default();
                        arrays.push(Raw { section, tag: tag.clone(), text: &[] });
                    }
                    "AppendedData" => {
                        let rest = scanner.rest();
                        let start = rest.iter().position(|&b| b == b'_').ok_or_else(|| {
                            format!("line {}: no underscore begins the appended data", tag.line)
                        })?;
                        let base64 = tag.get("encoding") != Some("raw");
                        appended = Some((&rest[start + 1..], base64));
                    }
                    _ => {}
                }
                if !tag.empty {
                    open.push(tag.name);
                }
                // Raw bytes may look like tags; nothing of interest follows them.
                if appended.is_some() {
                    break;
                }
            }
            Token::End(name) => {
                if open.pop() != Some(name) {
                    return Err(format!("line {}: </{name}> closes nothing", scanner.line()));
                }
            }
            Token::Text(text) => {
                if open.last() == Some(&"DataArray")
                    && let Some(array) = arrays.last_mut()
                    && array.text.is_empty()
                {
                    array.text = text.trim_ascii();
                }
            }
        }
    }
    if appended.is_none() && !open.is_empty() {
        return Err(format!(
            "line {}: the file ends inside <{}>: it is cut short",
            scanner.line(),
            open.join("><")
        ));
    }
    let encoding = encoding.ok_or("is empty: no <VTKFile> in it")?;
    let count = pieces.len();
    match <[Tag; 1]>::try_from(pieces) {
        Ok([piece]) => Ok(File { encoding, piece, arrays, appended }),
        Err(_) => Err(format!("has {count} pieces; exactly one is read (merge the blocks first)")),
    }
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
        big_endian: match tag.get("byte_order") {
            None | Some("LittleEndian") => false,
            Some("BigEndian") => true,
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
    fn decode(&self, raw: &Raw, tuples: usize) -> Result<(usize, Vec<Number>), String> {
        let tag = &raw.tag;
        let name = tag.get("Name").unwrap_or("without a name");
        let at = |why: String| format!("line {}: the array \"{name}\" {why}", tag.line);
        let kind = tag.get("type").unwrap_or_default();
        let scalar =
            Scalar::named(kind).ok_or_else(|| at(format!("has unknown type \"{kind}\"")))?;
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
            return Ok((components, Vec::new()));
        }
        Ok((components, numbers(source, scalar, count, self.encoding).map_err(at)?))
    }

    fn points(&self, count: usize) -> Result<Vec<Vec3>, String> {
        let (components, values) = self.decode(self.array("Points", None)?, count)?;
        if components != 3 {
            return Err(format!("has points of {components} coordinates instead of 3"));
        }
        Ok(values
            .chunks_exact(3)
            .map(|p| Vec3::new(p[0].real(), p[1].real(), p[2].real()))
            .collect())
    }

    /// Triangles of an unstructured grid.
    fn cells(&self) -> Result<Vec<[u32; 3]>, String> {
        let count = self.piece.count("NumberOfCells")?.unwrap_or(0);
        let types = self.positions("Cells", "types", count)?;
        if let Some(cell) = types.iter().position(|&t| t != TRIANGLE) {
            return Err(format!(
                "cell {cell} is {} (VTK type {}); only triangles (type {TRIANGLE}) are read",
                type_name(types[cell]),
                types[cell]
            ));
        }
        self.triangles("Cells", count)
    }

    /// Triangles of polygonal data.
    fn polygons(&self) -> Result<Vec<[u32; 3]>, String> {
        for what in ["Verts", "Lines", "Strips"] {
            let count = self.piece.count(&format!("NumberOf{what}"))?.unwrap_or(0);
            if count > 0 {
                return Err(format!("has {count} {what}; only Polys that are triangles are read"));
            }
        }
        self.triangles("Polys", self.piece.count("NumberOfPolys")?.unwrap_or(0))
    }

    /// `connectivity` and `offsets` of cells that must all be triangles.
    fn triangles(&self, section: &str, count: usize) -> Result<Vec<[u32; 3]>, String> {
        let offsets = self.positions(section, "offsets", count)?;
        for (cell, &end) in offsets.iter().enumerate() {
            if end != 3 * (cell + 1) {
                let start = if cell == 0 { 0 } else { offsets[cell - 1] };
                return Err(match end.checked_sub(start) {
                    Some(n) => format!("cell {cell} has {n} vertices; only triangles are read"),
                    None => format!("the offsets go backwards at cell {cell}"),
                });
            }
        }
        let numbers = self.positions(section, "connectivity", 3 * offsets.len())?;
        let vertex = |v: usize, cell: usize| {
            u32::try_from(v).map_err(|_| format!("cell {cell} names vertex {v}, beyond 32 bits"))
        };
        numbers
            .chunks_exact(3)
            .enumerate()
            .map(|(cell, t)| Ok([vertex(t[0], cell)?, vertex(t[1], cell)?, vertex(t[2], cell)?]))
            .collect()
    }

    /// An array of whole numbers from 0.
    fn positions(&self, section: &str, name: &str, count: usize) -> Result<Vec<usize>, String> {
        let (_, values) = self.decode(self.array(section, Some(name))?, count)?;
        values
            .into_iter()
            .enumerate()
            .map(|(i, n)| {
                n.position()
                    .ok_or_else(|| format!("entry {i} of {name} is {n:?}, no position in an array"))
            })
            .collect()
    }

    /// The arrays of a section, in the file's order.
    fn attributes(&self, section: &str, tuples: usize) -> Result<Vec<Array>, String> {
        self.arrays
            .iter()
            .filter(|a| a.section == section)
            .enumerate()
            .map(|(i, raw)| {
                let (components, values) = self.decode(raw, tuples)?;
                let name = raw
                    .tag
                    .get("Name")
                    .map_or_else(|| format!("array {}", index(i)), str::to_owned);
                Ok(Array {
                    name,
                    components,
                    values: values.into_iter().map(Number::real).collect(),
                })
            })
            .collect()
    }
}

/// What VTK calls a cell of this type.
fn type_name(number: usize) -> &'static str {
    match number {
        1 | 2 => "a vertex",
        3 | 4 => "a line",
        6 => "a triangle strip",
        7 => "a polygon",
        8 => "a pixel",
        9 => "a quadrilateral",
        10 => "a tetrahedron",
        12 => "a hexahedron",
        22 => "a quadratic triangle",
        _ => "something else",
    }
}
