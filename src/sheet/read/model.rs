//! From vtkio's model of a file to a surface: what VTK's old and new formats have in common.

use vtkio::model::{IOBuffer, ScalarType, VertexNumbers};

use rumple_numerics::Vec3;
use rumple_numerics::num::index;

use super::polygons::Polygons;
use crate::Surface;
use crate::surface::Array;

/// Arrays on cells may grow so many times by the cuts of polygons, or to so many numbers: one strip can be all triangles.
const MAX_TIMES: usize = 64;
const MAX_CUT_NUMBERS: usize = 1 << 20;

/// VTK's numbers for a vertex, a line, a strip of triangles and a polygon; several vertices or edges in a cell make no
/// difference here.
pub(super) const VERTEX: u64 = 1;
pub(super) const LINE: u64 = 3;
pub(super) const STRIP: u64 = 6;
pub(super) const POLYGON: u64 = 7;

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

/// What becomes of a cell of one of VTK's types.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CellUse {
    /// Its corners are those of a polygon, in their order.
    Polygon,
    /// Four corners in the order of a grid.
    Pixel,
    /// A strip of triangles.
    Strip,
    /// A vertex or a line, which has no area.
    Ignored,
}

/// The use of a cell type.
///
/// # Errors
/// What VTK calls a type that is not read.
fn use_of(kind: u64) -> Result<CellUse, &'static str> {
    Ok(match kind {
        1..=4 => CellUse::Ignored,
        5 | 7 | 9 => CellUse::Polygon,
        6 => CellUse::Strip,
        8 => CellUse::Pixel,
        10 => return Err("a tetrahedron: extract the surface of the mesh first"),
        12 => return Err("a hexahedron: extract the surface of the mesh first"),
        22 => return Err("a quadratic triangle: save the mesh with linear elements"),
        23 => return Err("a quadratic quadrilateral: save the mesh with linear elements"),
        _ => return Err("neither a triangle nor another polygon"),
    })
}

/// Cells of a file as triangles, and which cell each comes from.
#[derive(Debug, Default)]
pub(super) struct Cells {
    polygons: Polygons,
    /// The cell of every polygon.
    cells: Vec<u32>,
    /// Cells without area.
    ignored: usize,
    seen: usize,
}

impl Cells {
    /// Adds the cell with these corners.
    ///
    /// # Errors
    /// Types that are not read, and numbers of corners that do not suit the type.
    pub(super) fn push(&mut self, kind: u64, corners: &[u32]) -> Result<(), String> {
        let cell = self.seen;
        self.seen += 1;
        let n = corners.len();
        let what =
            use_of(kind).map_err(|name| format!("cell {cell} has VTK type {kind}, {name}"))?;
        let fits = match what {
            CellUse::Ignored => true,
            CellUse::Pixel => n == 4,
            CellUse::Strip => n >= 3,
            CellUse::Polygon if kind == 5 => n == 3,
            CellUse::Polygon if kind == 9 => n == 4,
            CellUse::Polygon => n >= 3,
        };
        if !fits {
            return Err(format!("cell {cell} of VTK type {kind} has {n} vertices"));
        }
        match what {
            CellUse::Ignored => self.ignored += 1,
            CellUse::Polygon => self.add(corners.iter().copied(), cell),
            CellUse::Pixel => self.add([0, 1, 3, 2].map(|k| corners[k]), cell),
            CellUse::Strip => {
                for (k, t) in corners.windows(3).enumerate() {
                    let [a, b, c] = [t[0], t[1], t[2]];
                    self.add(if k % 2 == 0 { [a, b, c] } else { [b, a, c] }, cell);
                }
            }
        }
        Ok(())
    }

    fn add(&mut self, corners: impl IntoIterator<Item = u32>, cell: usize) {
        self.polygons.push(corners);
        self.cells.push(index(cell));
    }

    /// Gives `surface` the triangles, notes, and cell arrays with one entry per triangle in place of one per cell.
    ///
    /// # Errors
    /// Those of [`Polygons::triangles`].
    pub(super) fn finish(self, surface: &mut Surface, arrays: Vec<Array>) -> Result<(), String> {
        let Self { polygons, cells, ignored, seen } = self;
        let found = polygons.triangles(&surface.points, |k| format!("cell {}", cells[k]))?;
        surface.notes.extend(found.note());
        if ignored > 0 {
            surface.notes.push(format!("{ignored} cells that are vertices or lines were ignored"));
        }
        surface.cell_arrays = arrays;
        if cells.len() != seen
            || found.cut > 0
            || cells.iter().enumerate().any(|(k, &c)| index(k) != c)
        {
            let of = |k: usize| match found.polygon.get(k) {
                Some(&polygon) => cells[polygon as usize],
                None => cells[k],
            };
            for array in &mut surface.cell_arrays {
                let n = array.components;
                let all = n.saturating_mul(found.corners.len());
                if all > MAX_TIMES.saturating_mul(array.values.len()).max(MAX_CUT_NUMBERS) {
                    return Err(format!(
                        "the array \"{}\" on cells would have {all} numbers on triangles: save the mesh with \
                         triangles in place of strips",
                        array.name
                    ));
                }
                let entries =
                    (0..found.corners.len()).map(|t| &array.values[n * of(t) as usize..][..n]);
                array.values = entries.flatten().copied().collect();
            }
        }
        surface.triangles = found.corners;
        Ok(())
    }

    /// How many cells there are.
    pub(super) fn len(&self) -> usize {
        self.seen
    }
}

/// Adds cells whose types are those of `types`, or polygons where these are absent.
///
/// # Errors
/// Types and corners that do not fit one another.
pub(super) fn add(
    cells: &mut Cells,
    list: &VertexNumbers,
    types: impl Fn(usize) -> u64,
) -> Result<(), String> {
    match list {
        VertexNumbers::XML { connectivity, offsets } => {
            let mut corners = Vec::new();
            let mut start = 0;
            for (cell, &end) in offsets.iter().enumerate() {
                let given = usize::try_from(start)
                    .ok()
                    .zip(usize::try_from(end).ok())
                    .and_then(|(start, end)| connectivity.get(start..end));
                let Some(given) = given else {
                    return Err(match end < start {
                        true => format!("the offsets go backwards at cell {cell}"),
                        false => format!(
                            "the offset {end} of cell {cell} is beyond the {} vertex numbers of the cells",
                            connectivity.len()
                        ),
                    });
                };
                start = end;
                corners.clear();
                for &v in given {
                    let v = u32::try_from(v);
                    corners
                        .push(v.map_err(|_| format!("cell {cell} names a vertex beyond 32 bits"))?);
                }
                cells.push(types(cell), &corners)?;
            }
            Ok(())
        }
        VertexNumbers::Legacy { num_cells, vertices } => {
            let mut rest = &vertices[..];
            for cell in 0..*num_cells as usize {
                let split = rest
                    .split_first()
                    .and_then(|(&n, rest)| rest.split_at_checked(n as usize))
                    .ok_or_else(|| {
                        format!("the vertex numbers of the {num_cells} cells end at cell {cell}")
                    })?;
                cells.push(types(cell), split.0)?;
                rest = split.1;
            }
            match rest.is_empty() {
                true => Ok(()),
                false => Err(format!(
                    "{} vertex numbers follow the last of {num_cells} cells",
                    rest.len()
                )),
            }
        }
    }
}
