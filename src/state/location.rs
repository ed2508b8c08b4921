//! Carrying values between faces and vertices.
//!
//! Faces to vertices as the paper prints it: `c_k = Σ_j (c_j/p_jk) / Σ_j (1/p_jk)` over the faces
//! around vertex k, p_jk the distance from the vertex to the face's centre in the current shape.

use crate::Vec3;
use crate::parallel;
use crate::sheet::Sheet;

/// Weights of the face → vertex average for one shape.
#[derive(Debug, Clone)]
pub struct FaceVertexAverage {
    /// For every corner of every triangle the normalised weight of that triangle at that vertex.
    weight: Vec<[f64; 3]>,
    total: Vec<f64>,
}

impl FaceVertexAverage {
    /// For the rest positions of `sheet`.
    #[must_use]
    pub fn new(sheet: &Sheet) -> Self {
        let mut average = Self {
            weight: vec![[0.0; 3]; sheet.triangle_count()],
            total: vec![0.0; sheet.vertex_count()],
        };
        average.update(sheet, sheet.rest());
        average
    }

    /// Takes the weights from the shape `x`.
    pub fn update(&mut self, sheet: &Sheet, x: &[Vec3]) {
        let triangles = sheet.triangles();
        parallel::fill(&mut self.weight, |t| {
            let corner = triangles[t].map(|v| x[v as usize]);
            let centre = (corner[0] + corner[1] + corner[2]) / 3.0;
            corner.map(|x| 1.0 / (x - centre).norm())
        });
        let (weight, incident) = (&self.weight, sheet.vertex_triangles());
        parallel::fill(&mut self.total, |i| {
            incident.of(i).iter().map(|&(t, k)| weight[t as usize][k as usize]).sum()
        });
    }

    /// Writes the average of `faces` at every vertex; scalars or vectors.
    pub fn apply<T>(&self, sheet: &Sheet, faces: &[T], vertices: &mut [T])
    where
        T: Copy + Send + Sync + std::iter::Sum + std::ops::Mul<f64, Output = T>,
    {
        let (weight, total, incident) = (&self.weight, &self.total, sheet.vertex_triangles());
        parallel::fill(vertices, |i| {
            let around = incident.of(i).iter();
            let sum: T =
                around.map(|&(t, k)| faces[t as usize] * weight[t as usize][k as usize]).sum();
            sum * (1.0 / total[i])
        });
    }
}
