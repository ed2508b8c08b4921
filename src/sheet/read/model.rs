//! From vtkio's model of a file to a surface: what VTK's old and new formats have in common.

use vtkio::model::{IOBuffer, ScalarType, VertexNumbers};

use rumple_numerics::Vec3;

/// VTK's number for a triangle.
const TRIANGLE: u64 = 5;

/// The numbers of a buffer; whole ones beyond 2^53 are rounded.
pub(super) fn reals(buffer: IOBuffer) -> Vec<f64> {
    match buffer {
        IOBuffer::F64(values) => values,
        // Only packed bits cannot be had as reals, and are then too few for what they are to be.
        other => other.cast_into().unwrap_or_default(),
    }
}

/// A buffer of whole numbers from 0, the array `name`.
pub(super) fn positions(buffer: IOBuffer, name: &str) -> Result<Vec<u64>, String> {
    if matches!(buffer.scalar_type(), ScalarType::F32 | ScalarType::F64) {
        return Err(format!("{name} holds real numbers, which are not array indices"));
    }
    let numbers = match buffer {
        IOBuffer::U64(numbers) => return Ok(numbers),
        other => other.cast_into::<i64>().unwrap_or_default(),
    };
    let position = |(i, n): (usize, i64)| {
        u64::try_from(n).map_err(|_| format!("entry {i} of {name} is {n}, not an array index"))
    };
    numbers.into_iter().enumerate().map(position).collect()
}

/// Points from their coordinates.
pub(super) fn points(buffer: IOBuffer) -> Vec<Vec3> {
    reals(buffer).chunks_exact(3).map(|p| Vec3::new(p[0], p[1], p[2])).collect()
}

/// Refuses cells that are not triangles by VTK's numbers for their types.
pub(super) fn only_triangles(types: impl IntoIterator<Item = u64>) -> Result<(), String> {
    match types.into_iter().enumerate().find(|&(_, kind)| kind != TRIANGLE) {
        None => Ok(()),
        Some((cell, kind)) => Err(format!(
            "cell {cell} is {} (VTK type {kind}); only triangles (type {TRIANGLE}) are read",
            type_name(kind)
        )),
    }
}

/// The corners of cells that must all be triangles.
pub(super) fn triangles(cells: &VertexNumbers) -> Result<Vec<[u32; 3]>, String> {
    match cells {
        VertexNumbers::XML { connectivity, offsets } => {
            triples(offsets)?;
            if connectivity.len() != 3 * offsets.len() {
                return Err(format!(
                    "{} cells name {} vertices, 3 each are expected",
                    offsets.len(),
                    connectivity.len()
                ));
            }
            connectivity.chunks_exact(3).enumerate().map(|(cell, t)| corners(cell, t)).collect()
        }
        VertexNumbers::Legacy { num_cells, vertices } => {
            let groups = vertices.chunks(4);
            if let Some((cell, group)) = groups.clone().enumerate().find(|(_, g)| g[0] != 3) {
                return Err(not_three(cell, group[0].into()));
            }
            if vertices.len() != 4 * *num_cells as usize {
                return Err(format!(
                    "{num_cells} cells are given by {} numbers, 4 each are expected",
                    vertices.len()
                ));
            }
            Ok(groups.map(|g| [g[1], g[2], g[3]]).collect())
        }
    }
}

/// Refuses offsets of cells that have more or less than three vertices.
pub(super) fn triples(offsets: &[u64]) -> Result<(), String> {
    let mut start = 0;
    for (cell, &end) in offsets.iter().enumerate() {
        match end.checked_sub(start) {
            Some(3) => start = end,
            Some(n) => return Err(not_three(cell, n)),
            None => return Err(format!("the offsets go backwards at cell {cell}")),
        }
    }
    Ok(())
}

fn not_three(cell: usize, corners: u64) -> String {
    format!("cell {cell} has {corners} vertices; only triangles are read")
}

fn corners(cell: usize, given: &[u64]) -> Result<[u32; 3], String> {
    let vertex = |v: u64| {
        u32::try_from(v).map_err(|_| format!("cell {cell} names vertex {v}, beyond 32 bits"))
    };
    Ok([vertex(given[0])?, vertex(given[1])?, vertex(given[2])?])
}

/// What VTK calls a cell of this type.
fn type_name(number: u64) -> &'static str {
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
