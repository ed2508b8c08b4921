//! Frames as VTK XML unstructured grids (`.vtu`), the format that ParaView opens.
//!
//! Arrays are inline base64 with 64-bit headers, compressed in blocks by zlib. Raw appended data
//! would save the third that base64 adds, but the file would no longer be XML, and some readers
//! refuse it. Positions and fields are Float64 and come back to the last bit; connectivity is Int32.
//!
//! vtkio writes the format too, but has no place for field data and with them the time. It also
//! compresses in one thread and numbers vertices by 64 bits.

use std::io::Write;

use rumple_numerics::num::index;

use super::encode::{Bytes, Compression, data_array, decimal};
use super::{Field, Frame, OutputError};

/// VTK's number for a triangle.
const TRIANGLE: u8 = 5;

/// An array to be encoded: its attributes in XML, and its bytes, which are made block by block.
struct Array<'a> {
    attributes: String,
    bytes: Bytes<'a>,
}

impl<'a> Array<'a> {
    /// Of `count` numbers.
    fn new<const N: usize>(
        (kind, name, components): (&str, &str, usize),
        count: usize,
        number: impl Fn(usize) -> [u8; N] + Sync + 'a,
    ) -> Self {
        let name = escape(name);
        let attributes =
            format!("type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"");
        Self { attributes, bytes: Bytes::new(count, number) }
    }

    fn field(field: &'a Field<'_>) -> Self {
        let what = ("Float64", field.name.as_str(), field.components);
        Self::new(what, field.data.len(), |k| field.data[k].to_le_bytes())
    }

    fn number(name: &str, value: f64) -> Self {
        let mut array = Self::new(("Float64", name, 1), 1, move |_| value.to_le_bytes());
        array.attributes += " NumberOfTuples=\"1\"";
        array
    }
}

/// Escapes what XML gives a meaning, and control characters, which it has no way to hold.
pub(super) fn escape(name: &str) -> String {
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

/// Writes the file for a frame that has been checked. Only one array at a time is held in memory, packed.
fn put<'a>(
    frame: &'a Frame<'_>,
    compression: Compression,
    out: &mut dyn Write,
) -> std::io::Result<()> {
    let fields = |fields: &'a [Field<'_>]| fields.iter().map(Array::field).collect();
    let numbers = frame.field_data.iter().map(|(name, x)| Array::number(name, *x)).collect();
    let (triangles, points) = (frame.triangles, frame.points);
    // `check` holds every index below 2^31, so unsigned bytes are the bytes of an Int32.
    let corners = triangles.as_flattened();
    let cells = vec![
        Array::new(("Int32", "connectivity", 1), corners.len(), |k| corners[k].to_le_bytes()),
        Array::new(("Int32", "offsets", 1), triangles.len(), |t| (3 * index(t + 1)).to_le_bytes()),
        Array::new(("UInt8", "types", 1), triangles.len(), |_| [TRIANGLE]),
    ];
    let coordinate = |k: usize| points[k / 3][k % 3].to_le_bytes();
    let points = vec![Array::new(("Float64", "Points", 3), 3 * points.len(), coordinate)];
    let sections: [(&str, Vec<Array<'_>>); 5] = [
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
        for Array { attributes, bytes } in arrays {
            write!(out, "<DataArray {attributes} format=\"binary\">")?;
            data_array(&bytes, compression, out)?;
            writeln!(out, "</DataArray>")?;
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
