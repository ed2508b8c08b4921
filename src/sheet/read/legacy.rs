//! VTK's legacy format (`.vtk`) as vtkio reads it: PolyData or an UnstructuredGrid of polygons, as text or binary.
//!
//! vtkio stops without a word at what it does not know: a file that it does not read to its end is refused, with the way
//! to convert it.

use vtkio::model::{
    Attribute, Attributes, CellType, DataArrayBase, DataSet, ElementType, IOBuffer, Piece,
    VertexNumbers,
};

use super::model;
use crate::Surface;
use crate::surface::Array;

/// What to do with a file that is not read.
const CONVERT: &str =
    "save the file as .vtu: `meshio convert a.vtk a.vtu`, or Save Data in ParaView";

/// Reads the bytes of a file.
pub(super) fn parse(bytes: &[u8]) -> Result<Surface, String> {
    let (rest, vtk) = vtkio::parser::parse_be(bytes)
        .map_err(|_| format!("is not a legacy file that vtkio reads; {CONVERT}"))?;
    if !rest.trim_ascii().is_empty() {
        let at = bytes.len() - rest.len();
        return Err(format!("byte {at}: vtkio reads no further; {CONVERT}"));
    }
    match vtk.data {
        DataSet::PolyData { pieces, .. } => {
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
        DataSet::UnstructuredGrid { pieces, .. } => {
            let piece = only(pieces)?;
            let list = (piece.cells.cell_verts, Types::Each(piece.cells.types));
            surface(piece.points, [list], piece.data)
        }
        _ => Err("holds neither POLYDATA nor an UNSTRUCTURED_GRID".into()),
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
             {place}s; {CONVERT}",
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
