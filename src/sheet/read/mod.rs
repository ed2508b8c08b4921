//! Surfaces from files: OBJ, PLY, STL, Gmsh's `.msh`, VTK's XML formats `.vtu`, `.pvtu` and `.vtp`, and its legacy format `.vtk`.
//!
//! The order of vertices and triangles is that of the file; polygons are cut into triangles. Nothing that a file holds makes these
//! readers panic or allocate much more than the file's own size (decompressed).

mod decode;
mod gmsh;
mod legacy;
mod model;
mod obj;
mod outline;
mod physical_groups;
mod ply;
mod polygons;
pub mod pvtu;
mod stl;
mod stream;
mod vtk;
mod xml;

use std::borrow::Cow;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use super::{SheetError, Surface};
pub use outline::{Ring, outline};

/// Largest file that is read into memory (bytes).
const LARGEST_FILE: u64 = 1 << 33;

/// Extensions of the files that are read, for people.
pub const EXTENSIONS: &str = ".obj, .ply, .stl, .msh, .vtu, .pvtu, .vtp and .vtk";

/// Reads a surface; the ending of the name ([`EXTENSIONS`]) says in which format.
///
/// # Errors
/// Files that cannot be opened, are not in the format, are cut short, or hold cells with volume or of higher order;
/// each with the line, the byte, or the number of the cell.
pub fn surface(path: impl AsRef<Path>) -> Result<Surface, SheetError> {
    let path = path.as_ref();
    let wrong = |message: String| SheetError::File { path: path.to_owned(), message };
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    let parse: fn(&[u8]) -> Result<Surface, String> = match ending.as_str() {
        "obj" => obj::parse,
        "ply" => ply::parse,
        "stl" => stl::parse,
        "msh" => gmsh::parse,
        "pvtu" => |_| Err(String::new()),
        "vtu" => |bytes| vtk::parse(bytes, vtk::Kind::UnstructuredGrid),
        "vtp" => |bytes| vtk::parse(bytes, vtk::Kind::PolyData),
        "vtk" => legacy::parse,
        _ => {
            return Err(wrong(format!(
                "unknown extension \"{ending}\" of a mesh file; {EXTENSIONS} are read, and \
                 ParaView and meshio convert others"
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
    // Binary data may end with zeros; the head of an STL file may be nothing else.
    let text =
        Text { begins: ending != "stl", ends: ["obj", "vtu", "pvtu", "vtp"].contains(&&*ending) };
    let bytes = content(path, about.len(), text).map_err(wrong)?;
    let mut surface = match ending.as_str() {
        "pvtu" => pvtu::parse(path, &bytes, |piece| match piece.extension() == path.extension() {
            true => Err(format!("{} is an index itself", piece.display())),
            false => surface(piece).map_err(|e| e.to_string()),
        }),
        _ => parse(&plain(&bytes)),
    }
    .map_err(wrong)?;
    surface.path = Some(path.to_owned());
    Ok(surface)
}

/// Text as the readers take it: without a byte order mark, and with line ends of which a line feed is part.
fn plain(bytes: &[u8]) -> Cow<'_, [u8]> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let head = &bytes[..bytes.len().min(4096)];
    let feeds = head.contains(&b'\n') || !head.contains(&b'\r');
    let binary =
        bytes.starts_with(b"ply") && head.windows(14).any(|words| words == b"\rformat binary");
    if feeds || binary || bytes.iter().any(|byte| [b'\n', 0].contains(byte)) {
        return bytes.into();
    }
    bytes.iter().map(|byte| if *byte == b'\r' { b'\n' } else { *byte }).collect()
}

/// Bytes at both ends of a file that are inspected before the rest of it is read.
const END_BYTES: u64 = 4096;

/// Which ends of a file must be text.
#[derive(Clone, Copy)]
struct Text {
    begins: bool,
    ends: bool,
}

/// The bytes of a file of `length` bytes. One that begins with zero bytes, or ends with a page of them, where it must be
/// text is none of the formats: it is refused before gigabytes of nothing are read.
fn content(path: &Path, length: u64, text: Text) -> Result<Vec<u8>, String> {
    let unread = |e: std::io::Error| format!("cannot be read: {e}");
    let mut file = File::open(path).map_err(unread)?;
    let mut end = Vec::new();
    if text.ends && length > 2 * END_BYTES {
        file.seek(SeekFrom::Start(length - END_BYTES)).map_err(unread)?;
        file.by_ref().take(END_BYTES).read_to_end(&mut end).map_err(unread)?;
        file.rewind().map_err(unread)?;
    }
    let mut bytes = Vec::new();
    file.by_ref().take(END_BYTES).read_to_end(&mut bytes).map_err(unread)?;
    let empty_head = text.begins && bytes.first() == Some(&0);
    if empty_head || (!end.is_empty() && end.iter().all(|byte| *byte == 0)) {
        let place = if empty_head { "begins" } else { "ends" };
        return Err(format!(
            "{place} with zero bytes, as an incomplete file: this is not a mesh file"
        ));
    }
    file.read_to_end(&mut bytes).map_err(unread)?;
    Ok(bytes)
}
