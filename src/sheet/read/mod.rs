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
    let bytes = std::fs::read(path).map_err(|e| wrong(format!("cannot be read: {e}")))?;
    let mut surface = parse(&bytes).map_err(wrong)?;
    surface.path = Some(path.to_owned());
    Ok(surface)
}
