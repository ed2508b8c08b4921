//! Spheres: random and relaxed, or the regular icosphere.

use std::collections::HashMap;
use std::f64::consts::{PI, TAU};

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rumple_numerics::Vec3;
use rumple_numerics::num::{index, real, whole};

use super::density::edge_length;
use super::domain::{Domain, Frame, delaunay};
use super::irregular::too_narrow;
use crate::SheetError;

/// Fewest edges around the equator of a random sphere.
const FEWEST_AROUND: usize = 8;

/// A sphere to be filled with random vertices; all of them are free.
pub(super) struct Ball {
    radius: f64,
    frame: Frame,
}

impl Ball {
    pub(super) fn new(radius: f64, vertices: usize) -> Result<Self, SheetError> {
        let edge = edge_length(2.0 * TAU * radius * radius, 0.0, 4.0, vertices);
        if TAU * radius < real(FEWEST_AROUND) * edge {
            return Err(too_narrow("the equator", TAU * radius / edge, FEWEST_AROUND, vertices));
        }
        let bounds = [Vec3::repeat(-radius), Vec3::repeat(radius)];
        Ok(Self { radius, frame: Frame::new(Vec::new(), edge, 2, bounds) })
    }
}

impl Domain for Ball {
    fn frame(&self) -> &Frame {
        &self.frame
    }

    fn sample(&self, rng: &mut ChaCha8Rng) -> Option<Vec3> {
        // Archimedes: z and the longitude are uniform.
        let z = 2.0 * rng.random::<f64>() - 1.0;
        let longitude = TAU * rng.random::<f64>();
        let r = (1.0 - z * z).max(0.0).sqrt();
        Some(self.radius * Vec3::new(r * longitude.cos(), r * longitude.sin(), z))
    }

    fn constrain(&self, point: Vec3) -> Vec3 {
        point * (self.radius / point.norm().max(f64::MIN_POSITIVE))
    }

    fn triangles(&self, points: &[Vec3]) -> Vec<[u32; 3]> {
        on_sphere(points, self.radius)
    }
}

/// Delaunay on the sphere: stereographic projection from the last vertex maps circles to
/// circles, so the plane's Delaunay triangles are the sphere's, and its hull is the ring of
/// neighbours of the last vertex.
pub(super) fn on_sphere(points: &[Vec3], radius: f64) -> Vec<[u32; 3]> {
    let Some((pole, others)) = points.split_last() else { return Vec::new() };
    let axis = pole.normalize();
    let across = if axis.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
    let e1 = axis.cross(&across).normalize();
    let e2 = axis.cross(&e1);
    let flat: Vec<Vec3> = others
        .iter()
        .map(|p| {
            let below = (radius - p.dot(&axis)).max(f64::MIN_POSITIVE);
            Vec3::new(p.dot(&e1) / below, p.dot(&e2) / below, 0.0)
        })
        .collect();
    let mut triangles = delaunay(&flat);
    // Boundary edges of the flat triangles are the half-edges without a partner.
    let mut half: Vec<(u32, u32, u32, u32)> = triangles
        .iter()
        .flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])])
        .map(|(a, b)| (a.min(b), a.max(b), a, b))
        .collect();
    half.sort_unstable();
    let last = index(others.len());
    for group in half.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1)) {
        if let [(_, _, a, b)] = *group {
            triangles.push([b, a, last]);
        }
    }
    // The frame (e1, e2, axis) seen from the pole shows the plane from behind.
    for t in &mut triangles {
        let [a, b, c] = t.map(|v| points[v as usize]);
        if a.dot(&b.cross(&c)) < 0.0 {
            t.swap(1, 2);
        }
    }
    triangles
}

/// The icosphere with the nearest number of vertices: every face of an icosahedron is cut into n²
/// triangles whose corners are moved out to the sphere, which gives 10n² + 2 vertices.
pub(super) fn icosphere(
    radius: f64,
    vertices: usize,
) -> Result<(Vec<Vec3>, Vec<[u32; 3]>), SheetError> {
    if vertices < 12 {
        return Err(SheetError::Unusable(format!(
            "an icosphere has at least 12 vertices, but {vertices} were asked for"
        )));
    }
    // Of the two neighbouring counts the nearer one.
    let below = whole(((real(vertices) - 2.0) / 10.0).sqrt().floor()).max(1);
    let count = |n: usize| 10 * n * n + 2;
    let nearer = vertices.abs_diff(count(below + 1)) < vertices.abs_diff(count(below));
    let n = if nearer { below + 1 } else { below };

    let (corners, faces) = icosahedron();
    let mut points = Vec::with_capacity(count(n));
    // A point is known by its corners' weights, wherever it is met.
    let mut known: HashMap<[(usize, usize); 3], u32> = HashMap::new();
    let mut triangles = Vec::with_capacity(20 * n * n);
    for face in faces {
        let mut vertex = |i: usize, j: usize| {
            let mut weights = [(face[0], n - i - j), (face[1], i), (face[2], j)];
            for w in &mut weights {
                if w.1 == 0 {
                    *w = (usize::MAX, 0);
                }
            }
            weights.sort_unstable();
            *known.entry(weights).or_insert_with(|| {
                let sum: Vec3 =
                    weights.iter().filter(|w| w.1 > 0).map(|&(c, w)| corners[c] * real(w)).sum();
                points.push(sum.normalize() * radius);
                index(points.len() - 1)
            })
        };
        for i in 0..n {
            for j in 0..n - i {
                triangles.push([vertex(i, j), vertex(i + 1, j), vertex(i, j + 1)]);
                if i + j + 2 <= n {
                    triangles.push([vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)]);
                }
            }
        }
    }
    Ok((points, triangles))
}

/// Corners on the unit sphere and faces, counter-clockwise from outside: two poles and two rings
/// of five at latitude ±atan(1/2).
fn icosahedron() -> ([Vec3; 12], Vec<[usize; 3]>) {
    let mut corners = [Vec3::z(); 12];
    let (z, r) = (1.0 / 5f64.sqrt(), 2.0 / 5f64.sqrt());
    for k in 0..5 {
        let angle = TAU * real(k) / 5.0;
        corners[1 + k] = Vec3::new(r * angle.cos(), r * angle.sin(), z);
        let angle = angle + PI / 5.0;
        corners[6 + k] = Vec3::new(r * angle.cos(), r * angle.sin(), -z);
    }
    corners[11] = -Vec3::z();
    let mut faces = Vec::with_capacity(20);
    for k in 0..5 {
        let next = (k + 1) % 5;
        faces.push([0, 1 + k, 1 + next]);
        faces.push([1 + k, 6 + k, 1 + next]);
        faces.push([6 + k, 6 + next, 1 + next]);
        faces.push([11, 6 + next, 6 + k]);
    }
    (corners, faces)
}
