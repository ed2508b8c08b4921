//! Values at the boundary from those within.
//!
//! ```text
//! f_b = Σ_j w_j f_j        w: the linear function of least squares Σ_j (f(ξ_j) - f_j)²/|ξ_j|², at ξ = 0
//! ```
//!
//! over the interior vertices j of the nearest rings around b that determine it, ξ_j their rest positions seen from b along its
//! rest normal. A linear field is extrapolated exactly where the rest shape is flat. Curvatures of a triangulated surface need
//! all triangles around a vertex, so that they have no value of their own at the boundary. On a periodic sheet vertices are those
//! of one period, each at its nearest image.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Matrix3, Vector3};
use rumple_numerics::Vec3;
use rumple_numerics::num::real;
use rumple_sheet::Sheet;

use super::Face;

/// Interior vertices that determine a linear function: few double the errors that curvatures have within on irregular meshes,
/// many lie far away.
const ENOUGH: usize = 16;
/// Most rings in which they are looked for.
const MOST_RINGS: usize = 4;
/// Singular values below this share are those of vertices on a line.
const ON_A_LINE: f64 = 1e-6;

/// The weights of interior vertices at those of the boundary.
#[derive(Debug, Clone, Default)]
pub struct BoundaryFit {
    weights: BTreeMap<usize, Vec<(usize, f64)>>,
}

impl BoundaryFit {
    /// On `sheet`, which is not a part of one, by its rest shape. A boundary vertex without interior ones near it has no weights.
    #[must_use]
    pub fn new(sheet: &Sheet) -> Self {
        let owned = sheet.reduction().owned(sheet.vertex_count());
        let boundary = (0..owned).filter(|i| sheet.boundary()[*i]);
        Self { weights: boundary.map(|i| (i, weights(sheet, i))).collect() }
    }

    /// Interior vertices and weights at the boundary vertex `i`, one that the sheet owns.
    #[must_use]
    pub fn weights(&self, i: usize) -> &[(usize, f64)] {
        self.weights.get(&i).map_or(&[], Vec::as_slice)
    }

    /// Replaces the `values` at the boundary, but for those of images.
    pub fn extend(&self, values: &mut [f64]) {
        for (i, weights) in &self.weights {
            values[*i] = weights.iter().map(|(j, weight)| weight * values[*j]).sum();
        }
    }
}

/// Interior vertices within the nearest rings of `centre` that hold enough of them.
fn interior(sheet: &Sheet, centre: usize) -> Vec<usize> {
    let (mut seen, mut ring) = (BTreeSet::from([centre]), vec![centre]);
    let within = |seen: &BTreeSet<usize>| -> Vec<usize> {
        seen.iter().copied().filter(|v| !sheet.boundary()[*v]).collect()
    };
    for _ in 0..MOST_RINGS {
        let around = |v: usize| {
            let triangles = sheet.vertex_triangles().entries(v).iter();
            let corners = triangles.flat_map(|&(t, _)| sheet.triangles()[t as usize]);
            corners.map(|v| sheet.number(v as usize) as usize)
        };
        ring = ring.into_iter().flat_map(around).filter(|v| seen.insert(*v)).collect();
        if within(&seen).len() >= ENOUGH {
            break;
        }
    }
    within(&seen)
}

fn weights(sheet: &Sheet, i: usize) -> Vec<(usize, f64)> {
    let near = interior(sheet, i);
    let x = sheet.rest();
    let normal: Vec3 = sheet
        .vertex_triangles()
        .entries(i)
        .iter()
        .map(|&(t, _)| {
            let face = Face::from_corners(&sheet.triangles()[t as usize].map(|v| x[v as usize]));
            face.area * face.normal
        })
        .sum();
    let n = normal.normalize();
    let seed = if n.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
    let across = n.cross(&seed).normalize();
    let along = n.cross(&across);
    let arm = |j: &usize| sheet.reduction().nearest_image(x[*j] - x[i]);
    let distances = near.iter().map(|j| arm(j).norm());
    let scale = distances.sum::<f64>() / real(near.len());
    let rows: Vec<(Vector3<f64>, f64)> = near
        .iter()
        .map(|j| {
            let d = arm(j) / scale;
            (Vector3::new(1.0, d.dot(&along), d.dot(&across)), 1.0 / d.norm_squared())
        })
        .collect();
    let normal_matrix: Matrix3<f64> = rows.iter().map(|(p, w)| *w * p * p.transpose()).sum();
    let least = ON_A_LINE * normal_matrix.norm();
    let Ok(inverse) = normal_matrix.pseudo_inverse(least) else { return Vec::new() };
    let at_centre = inverse.row(0).transpose();
    near.into_iter().zip(rows).map(|(j, (p, w))| (j, w * at_centre.dot(&p))).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::{AreaRule, Curvature, RestMetric, Shape, VertexArea};

    /// A square of `n` × `n` vertices, whose interior ones are moved by so many edges.
    fn square(n: usize, size: f64, irregular: f64) -> Sheet {
        let at = |k: usize| size * (real(k) / real(n - 1) - 0.5);
        let noise = |i: usize, j: usize| irregular * size / real(n) * (real(7 * i + 13 * j)).sin();
        let place = |k: usize| {
            let (i, j) = (k / n, k % n);
            let inner = i > 0 && j > 0 && i + 1 < n && j + 1 < n;
            let (dx, dy) = if inner { (noise(i, j), noise(j, i + 5)) } else { (0.0, 0.0) };
            Vec3::new(at(i) + dx, at(j) + dy, 0.0)
        };
        let number = |i: usize, j: usize| u32::try_from(i * n + j).unwrap();
        let squares = (0..n - 1).flat_map(|i| (0..n - 1).map(move |j| (i, j)));
        let triangles = squares.flat_map(|(i, j)| {
            let [a, b] = [number(i, j), number(i + 1, j)];
            let [c, d] = [number(i + 1, j + 1), number(i, j + 1)];
            [[a, b, c], [a, c, d]]
        });
        Sheet::new((0..n * n).map(place).collect(), triangles.collect()).unwrap()
    }

    #[test]
    fn linear_fields_are_extended_exactly() {
        let sheet = square(9, 2.0, 0.2);
        let fit = BoundaryFit::new(&sheet);
        let linear = |x: &Vec3| 3.0 - 2.0 * x.x + 0.7 * x.y;
        let mut values: Vec<f64> = sheet.rest().iter().map(linear).collect();
        let right = values.clone();
        for (value, boundary) in values.iter_mut().zip(sheet.boundary()) {
            *value = if *boundary { f64::NAN } else { *value };
        }
        fit.extend(&mut values);
        for (value, right) in values.iter().zip(right) {
            assert!((value - right).abs() < 1e-12, "{value} {right}");
        }
    }

    /// Root mean squares of the errors of H and K at the boundary and within, of a square of side 1 bent to a surface whose
    /// curvatures are known.
    fn errors(
        (n, irregular): (usize, f64),
        bent: &dyn Fn(&Vec3) -> (Vec3, f64, f64),
    ) -> [[f64; 2]; 2] {
        let sheet = square(n, 1.0, irregular);
        let all: Vec<_> = sheet.rest().iter().map(bent).collect();
        let x: Vec<Vec3> = all.iter().map(|(x, ..)| *x).collect();
        let metric = RestMetric::new(&sheet).unwrap();
        let shape = Shape { sheet: &sheet, metric: &metric, time: 0.0, x: &x };
        let area = VertexArea::new(&sheet, AreaRule::default());
        let Curvature { mut mean, mut gaussian, .. } = Curvature::evaluate(&shape, &area);
        let fit = BoundaryFit::new(&sheet);
        fit.extend(&mut mean);
        fit.extend(&mut gaussian);
        [true, false].map(|boundary| {
            let at: Vec<usize> =
                (0..all.len()).filter(|i| sheet.boundary()[*i] == boundary).collect();
            let mean_square = |error: &dyn Fn(usize) -> f64| {
                at.iter().map(|i| error(*i).powi(2)).sum::<f64>() / real(at.len())
            };
            let of_mean = mean_square(&|i| mean[i] - all[i].1);
            [of_mean, mean_square(&|i| gaussian[i] - all[i].2)].map(f64::sqrt)
        })
    }

    #[test]
    fn curvatures_at_the_edge_converge_on_a_cap_a_saddle_and_a_roll() {
        // z = a x² + b y²: with g = 1 + 4 a² x² + 4 b² y², K = 4ab/g², H = -(a (1 + 4b²y²) + b (1 + 4a²x²))/g^(3/2), > 0 at a top.
        let graph = |a: f64, b: f64| {
            move |p: &Vec3| {
                let (fx, fy) = (2.0 * a * p.x, 2.0 * b * p.y);
                let g = 1.0 + fx * fx + fy * fy;
                let h = -(a * (1.0 + fy * fy) + b * (1.0 + fx * fx)) / g.powf(1.5);
                (Vec3::new(p.x, p.y, a * p.x * p.x + b * p.y * p.y), h, 4.0 * a * b / (g * g))
            }
        };
        let roll = |p: &Vec3| {
            let angle = PI * p.x;
            (Vec3::new(angle.sin() / PI, p.y, angle.cos() / PI), 0.5 * PI, 0.0)
        };
        for bent in [&graph(-0.4, -0.4) as &dyn Fn(&Vec3) -> _, &graph(0.4, -0.4), &roll] {
            let [[coarse, _], [fine, _], [irregular, within]] =
                [(17, 0.0), (33, 0.0), (33, 0.2)].map(|mesh| errors(mesh, bent));
            for k in 0..2 {
                assert!(fine[k] < coarse[k] / 3.0 + 1e-9, "of second order: {coarse:?} {fine:?}");
                assert!(
                    irregular[k] < 2.0 * within[k],
                    "as near as within: {irregular:?} {within:?}"
                );
            }
        }
    }
}
