//! Cells of three and more corners, and their triangles.
//!
//! A polygon is cut by ears: of the corners whose triangle faces as the polygon does and holds no other corner, the one
//! with the triangle of the best quality goes first, until a triangle is left. The normal of a polygon is Newell's,
//!
//! ```text
//! n = ½ Σ_k x_k × x_(k+1)
//! ```
//!
//! so that polygons need be neither convex nor flat. Orientation is kept. (G. H. Meisters, Polygons have ears, American
//! Mathematical Monthly 82 (1975) 648.)

use rumple_numerics::Vec3;
use rumple_numerics::num::index;

use crate::quality::triangle_quality;
use crate::surface::Array;

/// Most corners of a polygon: the search for ears takes the cube of their number.
const MAX_CORNERS: usize = 64;

/// Polygons of a file, corners one after another.
#[derive(Debug, Default)]
pub(super) struct Polygons {
    corners: Vec<u32>,
    /// Where each polygon ends among the corners.
    ends: Vec<u32>,
}

/// Their triangles.
#[derive(Debug, Default)]
pub(super) struct Triangles {
    pub(super) corners: Vec<[u32; 3]>,
    /// Of every triangle the polygon that it is part of; empty where all polygons are triangles.
    pub(super) polygon: Vec<u32>,
    /// How many polygons of more than three corners were cut.
    pub(super) cut: usize,
}

impl Polygons {
    /// Adds one polygon.
    pub(super) fn push(&mut self, corners: impl IntoIterator<Item = u32>) {
        self.corners.extend(corners);
        self.ends.push(index(self.corners.len()));
    }

    /// Cuts them into triangles; `name` says what polygon number k is called.
    ///
    /// # Errors
    /// Polygons of fewer than three or more than [`MAX_CORNERS`] corners. Polygons of more than three with corners that
    /// do not exist, repeat or are not finite; in triangles the mesh checks find these.
    pub(super) fn triangles(
        self,
        points: &[Vec3],
        name: impl Fn(usize) -> String,
    ) -> Result<Triangles, String> {
        let mut found = Triangles::default();
        found.corners.reserve(self.ends.len());
        let mut start = 0;
        for (k, &end) in self.ends.iter().enumerate() {
            let corners = &self.corners[start..end as usize];
            start = end as usize;
            if let &[a, b, c] = corners {
                found.corners.push([a, b, c]);
                found.record(k);
                continue;
            }
            // From the first larger one on, triangles and polygons differ in number.
            if found.cut == 0 {
                found.polygon = (0..index(k)).collect();
            }
            found.cut += 1;
            let ears = ears(corners, points).map_err(|why| format!("{} {why}", name(k)))?;
            for ear in ears {
                found.corners.push(ear);
                found.record(k);
            }
        }
        Ok(found)
    }
}

impl Triangles {
    fn record(&mut self, polygon: usize) {
        if self.cut > 0 {
            self.polygon.push(index(polygon));
        }
    }

    /// Gives every triangle the entry of its polygon.
    pub(super) fn spread(&self, arrays: &mut [Array]) {
        if self.polygon.is_empty() {
            return;
        }
        for array in arrays {
            let n = array.components;
            let entries = self.polygon.iter().map(|&k| &array.values[n * k as usize..][..n]);
            array.values = entries.flatten().copied().collect();
        }
    }

    /// Entries of `per_polygon`, one for every triangle.
    pub(super) fn spread_lines(&self, per_polygon: Vec<u32>) -> Vec<u32> {
        match self.polygon.is_empty() {
            true => per_polygon,
            false => self.polygon.iter().map(|&k| per_polygon[k as usize]).collect(),
        }
    }

    /// Says how many were cut, where any were.
    pub(super) fn note(&self) -> Option<String> {
        (self.cut > 0).then(|| match self.cut {
            1 => "1 polygon of more than three vertices was cut into triangles".to_owned(),
            n => format!("{n} polygons of more than three vertices were cut into triangles"),
        })
    }
}

/// The triangles of one polygon.
fn ears(corners: &[u32], points: &[Vec3]) -> Result<Vec<[u32; 3]>, String> {
    let n = corners.len();
    if n < 3 {
        return Err(format!("has {n} vertices; a polygon has at least 3"));
    }
    if n > MAX_CORNERS {
        return Err(format!(
            "has {n} vertices; polygons of at most {MAX_CORNERS} are cut into triangles"
        ));
    }
    if let Some(v) = corners.iter().find(|&&v| v as usize >= points.len()) {
        return Err(format!("names vertex {v}, but there are only {} vertices", points.len()));
    }
    if let Some(v) =
        corners.iter().enumerate().find_map(|(i, v)| corners[..i].contains(v).then_some(v))
    {
        return Err(format!("names vertex {v} twice"));
    }
    let place = |v: u32| points[v as usize];
    if let Some(v) = corners.iter().find(|&&v| !place(v).iter().all(|x| x.is_finite())) {
        return Err(format!("has a coordinate that is not a finite number, at vertex {v}"));
    }
    let first = place(corners[0]);
    let side = |k: usize| (place(corners[k]) - first).cross(&(place(corners[(k + 1) % n]) - first));
    let normal: Vec3 = (0..n).map(side).sum();
    let mut left = corners.to_vec();
    let mut triangles = Vec::with_capacity(n - 2);
    while left.len() > 3 {
        let best = (0..left.len()).max_by(|&i, &j| {
            score(&left, i, &normal, points).total_cmp(&score(&left, j, &normal, points))
        });
        let Some(best) = best else { break };
        triangles.push(corner(&left, best));
        left.remove(best);
    }
    triangles.push(corner(&left, 1));
    Ok(triangles)
}

/// The triangle at corner `i` of a polygon.
fn corner(left: &[u32], i: usize) -> [u32; 3] {
    let m = left.len();
    [left[(i + m - 1) % m], left[i], left[(i + 1) % m]]
}

/// How good an ear is: its quality with the sign of its orientation, less 2 if it holds another corner. The last
/// diagonal makes two triangles of a quadrilateral, of which the worse counts.
fn score(left: &[u32], i: usize, normal: &Vec3, points: &[Vec3]) -> f64 {
    let signed = |t: [u32; 3]| {
        let [a, b, c] = t.map(|v| points[v as usize]);
        let outward = (b - a).cross(&(c - a)).dot(normal);
        let quality = triangle_quality([a, b, c]);
        if outward > 0.0 { quality } else { -quality }
    };
    let ear = corner(left, i);
    let [a, b, c] = ear.map(|v| points[v as usize]);
    let inside = |v: &&u32| {
        let p = points[**v as usize];
        [(a, b), (b, c), (c, a)].iter().all(|(s, e)| (e - s).cross(&(p - s)).dot(normal) >= 0.0)
    };
    let holds = left.iter().filter(|v| !ear.contains(v)).any(|v| inside(&v));
    let rest = match left.len() {
        4 => signed(corner(left, (i + 2) % 4)),
        _ => f64::INFINITY,
    };
    let least = signed(ear).min(rest);
    let least = if least.is_nan() { -1.0 } else { least };
    if holds { least - 2.0 } else { least }
}
