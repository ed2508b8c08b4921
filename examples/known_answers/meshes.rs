//! Regular meshes: a strip of equilateral triangles with straight sides, and hexagonal patches
//! with one five- or seven-valent vertex in the middle.

use std::f64::consts::TAU;

use rumple::Vec3;
use rumple::num::{index, real, whole};
use rumple::sheet::Sheet;

use super::Outcome;

/// A strip from x = 0 to `length` and from y = 0 to `width`, in straight columns along y.
///
/// `rows` triangles lie across the width in every column; each other column is shifted by half an
/// edge and closed by right-angled half triangles. The number of columns is even, which keeps three
/// boundary vertices from making a triangle, and `stretch` lengthens the strip by so many columns.
#[derive(Debug, Clone, Copy)]
pub struct Strip {
    /// Extent along x, without the added columns.
    pub length: f64,
    /// Extent along y.
    pub width: f64,
    /// Triangles across the width.
    pub rows: usize,
    /// Columns added to the length: the clamps' halves.
    pub extra: f64,
}

impl Strip {
    /// Columns of triangles along the strip.
    pub fn columns(&self) -> usize {
        let height = 0.75f64.sqrt() * self.width / real(self.rows);
        2 * whole(0.5 * (self.length / height + self.extra))
    }

    /// Distance of the columns of vertices.
    pub fn spacing(&self) -> f64 {
        self.length / (real(self.columns()) - self.extra)
    }

    /// The mesh, column after column.
    pub fn mesh(&self) -> Outcome<Sheet> {
        let (n, dx, edge) = (self.rows, self.spacing(), self.width / real(self.rows));
        let mut rest = Vec::new();
        let mut first = Vec::new();
        for c in 0..=self.columns() {
            first.push(rest.len());
            let heights: Vec<f64> = if c % 2 == 0 {
                (0..=n).map(|j| edge * real(j)).collect()
            } else {
                let shifted = (0..n).map(|j| edge * (real(j) + 0.5));
                [0.0].into_iter().chain(shifted).chain([self.width]).collect()
            };
            rest.extend(heights.into_iter().map(|y| Vec3::new(real(c) * dx, y, 0.0)));
        }
        let mut triangles = Vec::new();
        for c in 0..self.columns() {
            let (even, odd) = if c % 2 == 0 { (c, c + 1) } else { (c + 1, c) };
            let e = |j: usize| index(first[even] + j);
            let o = |j: usize| index(first[odd] + j);
            let mut column = vec![[e(0), o(0), o(1)], [e(n), o(n), o(n + 1)]];
            column.extend((0..n).map(|j| [e(j), o(j + 1), e(j + 1)]));
            column.extend((1..n).map(|j| [o(j), o(j + 1), e(j)]));
            let turned = |[a, b, c]: [u32; 3]| if even < odd { [a, b, c] } else { [a, c, b] };
            triangles.extend(column.into_iter().map(turned));
        }
        Ok(Sheet::new(rest, triangles)?)
    }
}

/// A patch of equilateral triangles of side 1 around one vertex with `fold` neighbours, `shells`
/// edges from there to a corner; in space, where all edges have their length.
///
/// `fold` < 6 gives a pyramid, 6 a flat hexagon, more a saddle.
pub fn disclination(fold: usize, shells: usize) -> Outcome<Sheet> {
    let ray = rays(fold);
    let mut rest = vec![Vec3::zeros()];
    let mut number = std::collections::HashMap::new();
    for k in 0..fold {
        for i in 1..=shells {
            for j in 0..=shells - i {
                number.insert((k, i, j), index(rest.len()));
                rest.push(real(i) * ray[k] + real(j) * ray[(k + 1) % fold]);
            }
        }
    }
    let at = |k: usize, i: usize, j: usize| match (i, j) {
        (0, 0) => 0,
        (0, _) => number[&((k + 1) % fold, j, 0)],
        _ => number[&(k, i, j)],
    };
    let mut triangles = Vec::new();
    for k in 0..fold {
        for i in 0..shells {
            for j in 0..shells - i {
                triangles.push([at(k, i, j), at(k, i + 1, j), at(k, i, j + 1)]);
                if i + j + 2 <= shells {
                    triangles.push([at(k, i + 1, j), at(k, i + 1, j + 1), at(k, i, j + 1)]);
                }
            }
        }
    }
    Ok(Sheet::new(rest, triangles)?)
}

/// The same patch pressed flat: every sector spans the same angle.
pub fn pressed_flat(fold: usize, shells: usize) -> Vec<Vec3> {
    let ray: Vec<Vec3> = (0..fold)
        .map(|k| TAU * real(k) / real(fold))
        .map(|angle| Vec3::new(angle.cos(), angle.sin(), 0.0))
        .collect();
    let mut x = vec![Vec3::zeros()];
    for k in 0..fold {
        for i in 1..=shells {
            for j in 0..=shells - i {
                x.push(real(i) * ray[k] + real(j) * ray[(k + 1) % fold]);
            }
        }
    }
    x
}

/// Unit vectors, each 60° from the next, that go once round the z axis.
fn rays(fold: usize) -> Vec<Vec3> {
    if fold <= 6 {
        let radius = 0.5 / (0.5 * TAU / real(fold)).sin();
        let depth = (1.0 - radius * radius).max(0.0).sqrt();
        return (0..fold)
            .map(|k| TAU * real(k) / real(fold))
            .map(|angle| Vec3::new(radius * angle.cos(), radius * angle.sin(), -depth))
            .collect();
    }
    // No closed form: neighbours on a saddle are pushed to distance 1 until they stay there.
    let mut ray: Vec<Vec3> = (0..fold)
        .map(|k| TAU * real(k) / real(fold))
        .map(|a| Vec3::new(a.cos(), a.sin(), 0.5 * (2.0 * a).cos()).normalize())
        .collect();
    for _ in 0..10_000 {
        for k in 0..fold {
            let next = (k + 1) % fold;
            let apart = ray[next] - ray[k];
            let push = 0.5 * (1.0 - 1.0 / apart.norm()) * apart;
            ray[k] = (ray[k] + push).normalize();
            ray[next] = (ray[next] - push).normalize();
        }
    }
    ray
}
