//! The elastic constants of a sheet.
//!
//! ```text
//! Y = E h/(1-ν²)         stretching modulus, force per length
//! B = E h³/(12(1-ν²))    bending rigidity, energy
//! ```
//!
//! E, ν and h may differ from triangle to triangle, and are constant on each: Y and B then are those of the
//! triangles. What belongs to an edge or a vertex has the mean over the triangles there, weighted by rest areas, which
//! keeps the energy of a uniform strain or curvature that of an integral over the triangles.

use super::field::FieldValues;
use crate::geometry::face_areas;
use crate::sheet::{Edge, Sheet};

/// Material of the sheet: the same constants everywhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Young's modulus E, stress.
    pub young: f64,
    /// Poisson's ratio ν.
    pub poisson: f64,
    /// Thickness h, length.
    pub thickness: f64,
}

impl Material {
    /// Stretching modulus `Y = E h/(1-ν²)`, force per length, as the paper defines it.
    #[must_use]
    pub fn stretching_modulus(&self) -> f64 {
        self.young * self.thickness / (1.0 - self.poisson * self.poisson)
    }

    /// Bending rigidity `B = E h³/(12(1-ν²))`, energy.
    #[must_use]
    pub fn bending_rigidity(&self) -> f64 {
        self.stretching_modulus() * self.thickness * self.thickness / 12.0
    }
}

/// Material of the sheet whose constants may differ from triangle to triangle.
#[derive(Debug, Clone, PartialEq)]
pub struct MaterialField {
    /// Young's modulus E, stress.
    pub young: FieldValues,
    /// Poisson's ratio ν.
    pub poisson: FieldValues,
    /// Thickness h, length.
    pub thickness: FieldValues,
}

impl From<&Material> for MaterialField {
    fn from(Material { young, poisson, thickness }: &Material) -> Self {
        let [young, poisson, thickness] =
            [young, poisson, thickness].map(|c| FieldValues::Same(*c));
        Self { young, poisson, thickness }
    }
}

impl MaterialField {
    fn constants(&self) -> [&FieldValues; 3] {
        [&self.young, &self.poisson, &self.thickness]
    }

    /// Whether all of it is the same everywhere.
    #[must_use]
    pub fn is_uniform(&self) -> bool {
        self.constants().iter().all(|values| values.is_uniform())
    }

    /// The largest of each constant.
    #[must_use]
    pub fn largest(&self) -> Material {
        let [young, poisson, thickness] = self.constants().map(FieldValues::largest);
        Material { young, poisson, thickness }
    }

    /// The smallest of each constant.
    #[must_use]
    pub fn smallest(&self) -> Material {
        let [young, poisson, thickness] = self.constants().map(FieldValues::smallest);
        Material { young, poisson, thickness }
    }

    /// Y of the triangles, force per length.
    #[must_use]
    pub fn stretching_modulus(&self) -> FieldValues {
        self.per_triangle(Material::stretching_modulus)
    }

    /// B of the triangles, energy.
    #[must_use]
    pub fn bending_rigidity(&self) -> FieldValues {
        self.per_triangle(Material::bending_rigidity)
    }

    /// What `of` makes of the constants of every triangle.
    pub(crate) fn per_triangle(&self, of: impl Fn(&Material) -> f64) -> FieldValues {
        let at = |t: usize| {
            let [young, poisson, thickness] = self.constants().map(|values| values.at(t));
            of(&Material { young, poisson, thickness })
        };
        let count = self.constants().into_iter().find_map(|values| match values {
            FieldValues::Same(_) => None,
            FieldValues::Each(all) => Some(all.len()),
        });
        count.map_or_else(
            || FieldValues::Same(at(0)),
            |count| FieldValues::Each((0..count).map(at).collect()),
        )
    }
}

/// Means over the triangles around every vertex of what these have, weighted by rest areas.
pub(super) fn at_vertices(values: &FieldValues, sheet: &Sheet) -> FieldValues {
    let FieldValues::Each(values) = values else { return values.clone() };
    let area = face_areas(sheet, sheet.rest());
    let mean =
        |i: usize| mean(sheet.vertex_triangles().entries(i).iter().map(|&(t, _)| t), values, &area);
    FieldValues::Each((0..sheet.vertex_count()).map(mean).collect())
}

/// Means over the triangles on both sides of the `edges` of what these have, weighted by rest areas.
pub(super) fn at_edges(values: &FieldValues, sheet: &Sheet, edges: &[u32]) -> FieldValues {
    let FieldValues::Each(values) = values else { return values.clone() };
    let area = face_areas(sheet, sheet.rest());
    let of = |e: &u32| {
        let sides = sheet.edges()[*e as usize].triangles;
        mean(sides.into_iter().filter(|t| *t != Edge::NONE), values, &area)
    };
    FieldValues::Each(edges.iter().map(of).collect())
}

/// Mean of `values` over `triangles`, weighted by `area`; 0 of none.
fn mean(triangles: impl Iterator<Item = u32>, values: &[f64], area: &[f64]) -> f64 {
    let (mut sum, mut all) = (0.0, 0.0);
    for t in triangles.map(|t| t as usize) {
        sum += area[t] * values[t];
        all += area[t];
    }
    if all > 0.0 { sum / all } else { 0.0 }
}
