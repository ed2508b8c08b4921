//! Frames as VTK XML unstructured grids (`.vtu`), the format that ParaView opens.
//!
//! Arrays are inline base64 with 64-bit headers, compressed in blocks by zlib. Raw appended data
//! would save the third that base64 adds, but the file would no longer be XML, and some readers
//! refuse it. Positions and fields are Float64 and come back to the last bit; connectivity is Int32.
//!
//! vtkio writes the format too, but has no place for field data and with them the time. It also
//! compresses in one thread and numbers vertices by 64 bits.

use std::io::Write;

use rayon::prelude::*;
use rumple_numerics::Vec3;
use rumple_numerics::num::index;
use serde::{Deserialize, Serialize};

use super::encode::{data_array, decimal};
use super::{Field, Frame, OutputError};

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

    fn attribute(self) -> &'static str {
        match self {
            Self::Zlib => " compressor=\"vtkZLibDataCompressor\"",
            Self::None => "",
        }
    }
}

/// VTK's number for a triangle.
const TRIANGLE: u8 = 5;

/// An array ready to be encoded: its attributes in XML and its bytes, little-endian.
struct Array {
    attributes: String,
    bytes: Vec<u8>,
}

impl Array {
    fn new(kind: &str, name: &str, components: usize, bytes: Vec<u8>) -> Self {
        let name = escape(name);
        let attributes =
            format!("type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"");
        Self { attributes, bytes }
    }

    fn field(field: &Field) -> Self {
        let bytes = field.data.iter().flat_map(|x| x.to_le_bytes()).collect();
        Self::new("Float64", &field.name, field.components, bytes)
    }

    fn number(name: &str, value: f64) -> Self {
        let mut array = Self::new("Float64", name, 1, value.to_le_bytes().to_vec());
        array.attributes += " NumberOfTuples=\"1\"";
        array
    }
}

/// Escapes what XML gives a meaning, and control characters, which it has no way to hold.
fn escape(name: &str) -> String {
    let mut text = String::with_capacity(name.len());
    for c in name.chars() {
        match c {
            '&' => text.push_str("&amp;"),
            '<' => text.push_str("&lt;"),
            '>' => text.push_str("&gt;"),
            '"' => text.push_str("&quot;"),
            c if c.is_control() => text.push(' '),
            c => text.push(c),
        }
    }
    text
}

/// The bytes of positions.
fn coordinates(points: &[Vec3]) -> Vec<u8> {
    points.iter().flat_map(|x| x.iter().copied()).flat_map(f64::to_le_bytes).collect()
}

/// Makes an array when it is written.
type Maker<'a> = Box<dyn Fn() -> Array + Sync + 'a>;

/// The file for `frame` as bytes.
///
/// Time is the field array `TimeValue`, where VTK's reader looks for it.
///
/// # Errors
/// [`OutputError::Frame`] if [`Frame::check`] refuses the frame.
pub fn encode(frame: &Frame<'_>, compression: Compression) -> Result<Vec<u8>, OutputError> {
    frame.check()?;
    let mut file = Vec::new();
    put(frame, compression, &mut file)
        .map_err(|e| OutputError::Frame { step: frame.step, message: e.to_string() })?;
    Ok(file)
}

/// Writes the file for a frame that has been checked. Only one section at a time is held in memory.
fn put(frame: &Frame<'_>, compression: Compression, out: &mut dyn Write) -> std::io::Result<()> {
    fn fields(fields: &[Field]) -> Vec<Maker<'_>> {
        fields.iter().map(|field| Box::new(|| Array::field(field)) as Maker<'_>).collect()
    }
    let numbers = frame.field_data.iter();
    let numbers =
        numbers.map(|(name, x)| Box::new(|| Array::number(name, *x)) as Maker<'_>).collect();
    let bytes =
        |numbers: &mut dyn Iterator<Item = u32>| numbers.flat_map(u32::to_le_bytes).collect();
    let triangles = frame.triangles;
    // `check` holds every index below 2^31, so unsigned bytes are the bytes of an Int32.
    let cells: Vec<Maker<'_>> = vec![
        Box::new(|| {
            let corners = bytes(&mut triangles.iter().flatten().copied());
            Array::new("Int32", "connectivity", 1, corners)
        }),
        Box::new(|| {
            let ends = bytes(&mut (1..=index(triangles.len())).map(|t| 3 * t));
            Array::new("Int32", "offsets", 1, ends)
        }),
        Box::new(|| Array::new("UInt8", "types", 1, vec![TRIANGLE; triangles.len()])),
    ];
    let points: Vec<Maker<'_>> =
        vec![Box::new(|| Array::new("Float64", "Points", 3, coordinates(frame.points)))];
    let sections: [(&str, Vec<Maker<'_>>); 5] = [
        ("FieldData", numbers),
        ("PointData", fields(&frame.point)),
        ("CellData", fields(&frame.cell)),
        ("Points", points),
        ("Cells", cells),
    ];
    writeln!(
        out,
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" \
         byte_order=\"LittleEndian\" header_type=\"UInt64\"{}>\n<UnstructuredGrid>",
        compression.attribute()
    )?;
    for (section, arrays) in sections {
        if section == "PointData" {
            let (points, cells) = (frame.points.len(), triangles.len());
            writeln!(out, "<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">")?;
        }
        writeln!(out, "<{section}>")?;
        if section == "FieldData" {
            writeln!(
                out,
                "<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" \
                 format=\"ascii\">{}</DataArray>",
                decimal(frame.time)
            )?;
        }
        let encoded = arrays
            .par_iter()
            .map(|array| {
                let Array { attributes, bytes } = array();
                Ok((attributes, data_array(bytes, compression)?))
            })
            .collect::<std::io::Result<Vec<_>>>()?;
        for (attributes, content) in encoded {
            writeln!(out, "<DataArray {attributes} format=\"binary\">{content}</DataArray>")?;
        }
        writeln!(out, "</{section}>")?;
    }
    out.write_all(b"</Piece>\n</UnstructuredGrid>\n</VTKFile>\n")
}

/// Writes `frame` as the file `path`, whole or not at all.
///
/// # Errors
/// [`OutputError::Frame`] if the frame contradicts itself, [`OutputError::Write`] if the
/// operating system refuses.
pub fn write(
    path: &std::path::Path,
    frame: &Frame<'_>,
    compression: Compression,
) -> Result<(), OutputError> {
    frame.check()?;
    super::atomic::replace(path, |writer: &mut dyn Write| put(frame, compression, writer))
}
