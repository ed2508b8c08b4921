//! Frames in VTK's old format (`.vtk`), for programs that read nothing newer.
//!
//! Binary and not compressed: every number keeps its bits. All fields go into FIELD blocks, since
//! VTK's reader takes only the first of several SCALARS or VECTORS unless told otherwise. The time
//! is the field array `TimeValue`, as in the XML format.
//!
//! vtkio writes it, but for three things it does wrong, which the tests of its faults show: it has no
//! field data beside points and cells, it does not escape names, and offsets of version 5 are without
//! their first entry, so that version 4.2 is asked of it.

use std::io::Write;
use std::path::Path;

use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataSet, FieldArray, UnstructuredGridPiece,
    Version, VertexNumbers, Vtk,
};

use super::{Field, Frame, OutputError, atomic};

/// Ends the head of a file: what follows is the data set.
const HEAD_END: &[u8] = b"BINARY\n\n";
/// The kind of the data set; field data follow it.
const DATASET_KIND: &[u8] = b"DATASET UNSTRUCTURED_GRID\n";

/// The file for `frame` as bytes.
///
/// # Errors
/// [`OutputError::Frame`] if [`Frame::check`] refuses the frame.
pub fn encode(frame: &Frame<'_>) -> Result<Vec<u8>, OutputError> {
    frame.check()?;
    let numbers = [("TimeValue", frame.time)]
        .into_iter()
        .chain(frame.field_data.iter().map(|(name, value)| (name.as_str(), *value)))
        .map(|(name, value)| FieldArray::new(escape(name), 1).with_vec(vec![value]));
    let whole =
        DataSet::Field { name: "FieldData".to_owned(), data_array: numbers.collect::<Vec<_>>() };
    // `check` holds every index below 2^31.
    let vertices = frame.triangles.iter().flat_map(|&[a, b, c]| [3, a, b, c]).collect();
    let num_cells = rumple_numerics::num::index(frame.triangles.len());
    let grid = UnstructuredGridPiece {
        points: Field::vector("", frame.points).data.into_owned().into(),
        cells: Cells {
            cell_verts: VertexNumbers::Legacy { num_cells, vertices },
            types: vec![CellType::Triangle; frame.triangles.len()],
        },
        data: Attributes { point: attributes(&frame.point), cell: attributes(&frame.cell) },
    };
    let numbers = written(frame, whole)?;
    let mut file = written(frame, DataSet::inline(grid))?;
    let missing = || OutputError::Frame {
        step: frame.step,
        message: "vtkio wrote a file that is not as expected".to_owned(),
    };
    let numbers = after(&numbers, HEAD_END).map(|start| &numbers[start..]).ok_or_else(missing)?;
    let place = after(&file, DATASET_KIND).ok_or_else(missing)?;
    file.splice(place..place, numbers.iter().copied());
    Ok(file)
}

/// Writes `frame` as the file `path`, whole or not at all.
///
/// # Errors
/// [`OutputError::Frame`] if the frame contradicts itself, [`OutputError::Write`] if the
/// operating system refuses.
pub fn write(path: &Path, frame: &Frame<'_>) -> Result<(), OutputError> {
    let file = encode(frame)?;
    atomic::replace(path, |writer: &mut dyn Write| writer.write_all(&file))
}

/// A file with this data set.
fn written(frame: &Frame<'_>, data: DataSet) -> Result<Vec<u8>, OutputError> {
    let vtk = Vtk {
        version: Version::new_legacy(4, 2),
        title: format!("rumple, step {}", frame.step),
        byte_order: ByteOrder::BigEndian,
        file_path: None,
        data,
    };
    let mut bytes = Vec::new();
    vtk.write_legacy(&mut bytes)
        .map_err(|e| OutputError::Frame { step: frame.step, message: e.to_string() })?;
    Ok(bytes)
}

/// Where the first `word` in `bytes` ends.
fn after(bytes: &[u8], word: &[u8]) -> Option<usize> {
    bytes.windows(word.len()).position(|window| window == word).map(|start| start + word.len())
}

/// The fields as one FIELD block.
fn attributes(fields: &[Field<'_>]) -> Vec<Attribute> {
    if fields.is_empty() {
        return Vec::new();
    }
    let arrays = fields.iter().map(|field| {
        let components = rumple_numerics::num::index(field.components);
        FieldArray::new(escape(&field.name), components).with_vec(field.data.to_vec())
    });
    vec![Attribute::field("FieldData").with_field_data(arrays)]
}

/// A name in one word, with the escapes that VTK's reader resolves.
fn escape(name: &str) -> String {
    let mut text = String::with_capacity(name.len());
    for byte in name.bytes() {
        match byte {
            b'!'..=b'~' if !matches!(byte, b'"' | b'%') => text.push(char::from(byte)),
            _ => text.push_str(&format!("%{byte:02X}")),
        }
    }
    text
}
