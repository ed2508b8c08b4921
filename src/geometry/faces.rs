//! Unit normals and areas of the current triangles, and unit normals of vertices.
//!
//! `N = (x_b - x_a) × (x_c - x_a)`, `A = |N|/2`, `n = N/|N|`, with `∂A/∂x_k = ½ n × e_k` where
//! `e_k` is the edge opposite corner `k`, oriented with the triangle.

use rumple_numerics::Vec3;
use rumple_numerics::parallel;
use rumple_sheet::Sheet;

/// One triangle of the current shape.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Face {
    /// Unit normal; not finite for a triangle without area.
    pub normal: Vec3,
    /// Area, length².
    pub area: f64,
}

impl Face {
    /// Of a triangle with these corners.
    #[must_use]
    #[inline]
    pub fn from_corners([a, b, c]: &[Vec3; 3]) -> Self {
        let cross = (b - a).cross(&(c - a));
        let double_area = cross.norm();
        Self { normal: cross / double_area, area: 0.5 * double_area }
    }
}

/// All triangles of the current shape.
#[derive(Debug, Clone, Default)]
pub struct Faces {
    face: Vec<Face>,
}

impl Faces {
    /// Computes the faces of `x`; the memory is reused.
    pub fn update(&mut self, sheet: &Sheet, x: &[Vec3]) {
        self.face.resize(sheet.triangle_count(), Face::default());
        let triangles = sheet.triangles();
        parallel::fill(&mut self.face, |t| {
            Face::from_corners(&triangles[t].map(|v| x[v as usize]))
        });
    }

    /// The faces, in the order of the sheet's triangles.
    #[must_use]
    #[inline]
    pub fn all(&self) -> &[Face] {
        &self.face
    }
}

/// Areas of the triangles at `x`, length².
#[must_use]
pub fn face_areas(sheet: &Sheet, x: &[Vec3]) -> Vec<f64> {
    let mut faces = Faces::default();
    faces.update(sheet, x);
    faces.face.iter().map(|face| face.area).collect()
}

/// Unit normals of the vertices at `x`, the mean of those of their triangles by area; 0 where these cancel.
#[must_use]
pub fn vertex_normals(sheet: &Sheet, x: &[Vec3]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::zeros(); x.len()];
    parallel::fill(&mut normals, |i| {
        let around = sheet.vertex_triangles().entries(i).iter();
        let sum: Vec3 = around
            .map(|&(t, _)| {
                let [a, b, c] = sheet.triangles()[t as usize].map(|v| x[v as usize]);
                (b - a).cross(&(c - a))
            })
            .sum();
        sum.try_normalize(0.0).unwrap_or_else(Vec3::zeros)
    });
    normals
}
