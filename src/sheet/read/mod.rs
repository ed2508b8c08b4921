//! Surfaces from files: OBJ, VTK's XML formats `.vtu` and `.vtp`, and its old format `.vtk`.
//!
//! The order of vertices and triangles is that of the file. Nothing that a file holds makes these
//! readers panic or allocate much more than the file's own size (decompressed).

mod decode;
mod legacy;
mod model;
mod obj;
mod vtk;
mod xml;

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use super::{SheetError, Surface};

/// Largest file that is read into memory (bytes).
const LARGEST_FILE: u64 = 1 << 33;

/// Reads a surface; the ending of the name (`.obj`, `.vtu`, `.vtp`, `.vtk`) says in which format.
///
/// # Errors
/// Files that cannot be opened, are not in the format, are cut short, or hold cells other than
/// triangles; each with the line, or the number of the cell.
pub fn surface(path: impl AsRef<Path>) -> Result<Surface, SheetError> {
    let path = path.as_ref();
    let wrong = |message: String| SheetError::File { path: path.to_owned(), message };
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    let parse: fn(&[u8]) -> Result<Surface, String> = match ending.as_str() {
        "obj" => obj::parse,
        "vtu" => |bytes| vtk::parse(bytes, vtk::Kind::UnstructuredGrid),
        "vtp" => |bytes| vtk::parse(bytes, vtk::Kind::PolyData),
        "vtk" => legacy::parse,
        _ => {
            return Err(wrong(format!(
                "unknown extension \"{ending}\" of a mesh file; .obj, .vtu, .vtp and .vtk are read"
            )));
        }
    };
    let about = std::fs::metadata(path).map_err(|e| wrong(format!("cannot be read: {e}")))?;
    if !about.is_file() {
        return Err(wrong("is not a file".into()));
    }
    if about.len() > LARGEST_FILE {
        return Err(wrong(format!("has {} bytes; at most {LARGEST_FILE} are read", about.len())));
    }
    // Binary data of the old format may end with zeros.
    let text_ends = ending != "vtk";
    let bytes = content(path, about.len(), text_ends).map_err(wrong)?;
    let mut surface = parse(&bytes).map_err(wrong)?;
    surface.path = Some(path.to_owned());
    Ok(surface)
}

/// Bytes at both ends of a file that are inspected before the rest of it is read.
const ENDS: u64 = 4096;

/// The bytes of a file of `length` bytes. One that begins with zero bytes, or with `text_ends` ends with a page of them,
/// is none of the formats: it is refused before gigabytes of nothing are read.
fn content(path: &Path, length: u64, text_ends: bool) -> Result<Vec<u8>, String> {
    let unread = |e: std::io::Error| format!("cannot be read: {e}");
    let mut file = File::open(path).map_err(unread)?;
    let mut end = Vec::new();
    if text_ends && length > 2 * ENDS {
        file.seek(SeekFrom::Start(length - ENDS)).map_err(unread)?;
        file.by_ref().take(ENDS).read_to_end(&mut end).map_err(unread)?;
        file.rewind().map_err(unread)?;
    }
    let mut bytes = Vec::new();
    file.by_ref().take(ENDS).read_to_end(&mut bytes).map_err(unread)?;
    if bytes.first() == Some(&0) || (!end.is_empty() && end.iter().all(|byte| *byte == 0)) {
        let place = if bytes.first() == Some(&0) { "begins" } else { "ends" };
        return Err(format!(
            "{place} with zero bytes, as a file that was never written to its end: this is no mesh file"
        ));
    }
    file.read_to_end(&mut bytes).map_err(unread)?;
    Ok(bytes)
}
