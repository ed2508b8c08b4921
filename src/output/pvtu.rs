//! The index of a frame in pieces, one a rank (`.pvtu`): which arrays they have, and where they are.

use std::path::PathBuf;

use super::vtu::escape;
use super::{Field, Frame};

/// The index of pieces like `frame` in the files `sources`, relative to that of the index.
pub(super) fn encode(frame: &Frame<'_>, sources: impl Iterator<Item = PathBuf>) -> String {
    let array = |name: &str, components: usize| {
        let name = escape(name);
        format!(
            "<PDataArray type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"{components}\"/>\n"
        )
    };
    let arrays = |fields: &[Field<'_>]| -> String {
        fields.iter().map(|field| array(&field.name, field.components)).collect()
    };
    let pieces: String = sources
        .map(|path| format!("<Piece Source=\"{}\"/>\n", escape(&path.to_string_lossy())))
        .collect();
    format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n<PUnstructuredGrid GhostLevel=\"0\">\n<PPointData>\n{}</PPointData>\n\
         <PCellData>\n{}</PCellData>\n<PPoints>\n{}</PPoints>\n{pieces}</PUnstructuredGrid>\n</VTKFile>\n",
        arrays(&frame.point),
        arrays(&frame.cell),
        array("Points", 3),
    )
}
