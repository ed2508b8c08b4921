//! A triangle soup as a file gives it, before anything is known about it.

use std::path::PathBuf;

use rumple_numerics::Vec3;

/// A named array of a file: `values[components * i + k]` is component k at vertex or triangle i.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Name in the file.
    pub name: String,
    /// Numbers per vertex or triangle, at least 1.
    pub components: usize,
    /// All values, `components` × (vertices or triangles) of them.
    pub values: Vec<f64>,
}

/// Points, triangles and arrays in the order of the file they came from.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surface {
    /// The file, if there is one; named in errors.
    pub path: Option<PathBuf>,
    /// Positions.
    pub points: Vec<Vec3>,
    /// Vertex numbers of the triangles, from 0; not checked.
    pub triangles: Vec<[u32; 3]>,
    /// Arrays with one entry per point.
    pub point_arrays: Vec<Array>,
    /// Arrays with one entry per triangle.
    pub cell_arrays: Vec<Array>,
    /// The time that a VTK file gives (field array `TimeValue`).
    pub time: Option<f64>,
    /// Line of every point in a text file; empty where lines mean nothing.
    pub point_lines: Vec<u32>,
    /// Line of every triangle in a text file; empty where lines mean nothing.
    pub triangle_lines: Vec<u32>,
    /// What was met and left aside while reading, for people.
    pub notes: Vec<String>,
}

/// The array of this name, which may have a unit in brackets behind it: `mean_curvature` is `mean_curvature [1/length]`.
pub(crate) fn named<'a>(arrays: &'a [Array], name: &str) -> Option<&'a Array> {
    let with_unit =
        |a: &&Array| a.name.strip_prefix(name).is_some_and(|rest| rest.starts_with(" ["));
    arrays.iter().find(|a| a.name == name).or_else(|| arrays.iter().find(with_unit))
}

impl Surface {
    /// The point array of this name, with or without its unit in brackets.
    #[must_use]
    pub fn point_array(&self, name: &str) -> Option<&Array> {
        named(&self.point_arrays, name)
    }

    /// The cell array of this name, with or without its unit in brackets.
    #[must_use]
    pub fn cell_array(&self, name: &str) -> Option<&Array> {
        named(&self.cell_arrays, name)
    }
}

/// The arrays of one component, of the whole sheet.
#[derive(Debug, Clone, Default)]
pub(crate) struct Attributes {
    /// On points and on cells.
    pub(crate) arrays: [Vec<Array>; 2],
    /// Those of the whole sheet, which a part does not have.
    pub(crate) triangles: Vec<[u32; 3]>,
}

impl Attributes {
    /// Takes the arrays out of `surface`, whose triangles are `triangles`; `None` without any.
    pub(crate) fn take_from(surface: &mut Surface, triangles: &[[u32; 3]]) -> Option<Self> {
        let arrays = [&mut surface.point_arrays, &mut surface.cell_arrays].map(|arrays| {
            arrays.retain(|array| array.components == 1);
            std::mem::take(arrays)
        });
        let any = arrays.iter().any(|arrays| !arrays.is_empty());
        any.then(|| Self { arrays, triangles: triangles.to_vec() })
    }
}
