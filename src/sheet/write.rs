//! Writing a sheet as Wavefront OBJ or in one of VTK's XML formats.

use std::io::{self, Write};
use std::path::Path;

use vtkio::model::{
    Attributes, ByteOrder, CellType, Cells, DataSet, PolyDataPiece, UnstructuredGridPiece, Version,
    VertexNumbers, Vtk,
};
use vtkio::xml::Compressor;

use super::Sheet;

/// A format that a sheet can be written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeshFormat {
    /// Wavefront OBJ.
    Obj,
    /// VTK's XML format for unstructured grids.
    Vtu,
    /// VTK's XML format for polygons.
    Vtp,
}

impl MeshFormat {
    /// The format that the ending of a file's name asks for.
    #[must_use]
    pub fn from_path(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_lowercase();
        Some(match ending.as_str() {
            "obj" => Self::Obj,
            "vtu" => Self::Vtu,
            "vtp" => Self::Vtp,
            _ => return None,
        })
    }
}

/// Writes the rest positions and triangles; every number reads back with the same bits.
///
/// # Errors
/// Those of the writer.
pub fn mesh(sheet: &Sheet, format: MeshFormat, out: &mut impl Write) -> io::Result<()> {
    let xml = |data, out: &mut _| -> Result<(), vtkio::Error> {
        let file = model(data).try_into_xml_format(Compressor::ZLib, 1)?;
        Ok(file.write(out)?)
    };
    match format {
        MeshFormat::Obj => return obj(sheet, out),
        MeshFormat::Vtu => xml(grid(sheet), out),
        MeshFormat::Vtp => xml(polygons(sheet), out),
    }
    .map_err(io::Error::other)
}

/// Writes the rest positions and triangles as OBJ; every number reads back with the same bits.
///
/// # Errors
/// Those of the writer.
pub fn obj(sheet: &Sheet, out: &mut impl Write) -> io::Result<()> {
    for p in sheet.rest() {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for t in sheet.triangles() {
        let [a, b, c] = t.map(|v| u64::from(v) + 1);
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}

/// A file with this data set.
fn model(data: DataSet) -> Vtk {
    let (version, byte_order) = (Version::new_xml(1, 0), ByteOrder::LittleEndian);
    Vtk { version, title: String::new(), byte_order, file_path: None, data }
}

fn points(sheet: &Sheet) -> Vec<f64> {
    sheet.rest().iter().flat_map(|p| [p.x, p.y, p.z]).collect()
}

fn corners(sheet: &Sheet) -> VertexNumbers {
    VertexNumbers::Legacy {
        num_cells: rumple_numerics::num::index(sheet.triangles().len()),
        vertices: sheet.triangles().iter().flat_map(|&[a, b, c]| [3, a, b, c]).collect(),
    }
}

fn polygons(sheet: &Sheet) -> DataSet {
    DataSet::inline(PolyDataPiece {
        points: points(sheet).into(),
        polys: Some(corners(sheet)),
        ..PolyDataPiece::default()
    })
}

fn grid(sheet: &Sheet) -> DataSet {
    let types = vec![CellType::Triangle; sheet.triangles().len()];
    DataSet::inline(UnstructuredGridPiece {
        points: points(sheet).into(),
        cells: Cells { cell_verts: corners(sheet), types },
        data: Attributes::new(),
    })
}
