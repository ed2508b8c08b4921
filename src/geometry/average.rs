//! Carrying values between faces and vertices.
//!
//! Faces to vertices as the paper prints it: `c_k = Σ_j (c_j/p_jk) / Σ_j (1/p_jk)` over the faces
//! around vertex k, p_jk the distance from the vertex to the face's centre in the current shape.

use rumple_numerics::Vec3;
use rumple_numerics::parallel;
use rumple_sheet::Sheet;

/// Weights of the face → vertex average for one shape.
#[derive(Debug, Clone, Default)]
pub struct FaceVertexAverage {
    /// For every corner of every triangle the normalised weight of that triangle at that vertex.
    weight: Vec<[f64; 3]>,
    total: Vec<f64>,
}

impl FaceVertexAverage {
    /// For the rest positions of `sheet`.
    #[must_use]
    pub fn new(sheet: &Sheet) -> Self {
        let mut average = Self::default();
        average.update(sheet, sheet.rest());
        average
    }

    /// Takes the weights from the shape `x`.
    pub fn update(&mut self, sheet: &Sheet, x: &[Vec3]) {
        let triangles = sheet.triangles();
        self.weight.resize(triangles.len(), [0.0; 3]);
        self.total.resize(sheet.vertex_count(), 0.0);
        parallel::fill(&mut self.weight, |t| {
            let corner = triangles[t].map(|v| x[v as usize]);
            let centre = (corner[0] + corner[1] + corner[2]) / 3.0;
            corner.map(|x| 1.0 / (x - centre).norm())
        });
        let (weight, incident) = (&self.weight, sheet.vertex_triangles());
        parallel::fill(&mut self.total, |i| {
            incident.entries(i).iter().map(|&(t, k)| weight[t as usize][k as usize]).sum()
        });
    }

    /// Share of triangle `t`, of which it is corner `k`, in the average at `vertex`.
    #[must_use]
    #[inline]
    pub fn share(&self, t: usize, k: usize, vertex: usize) -> f64 {
        self.weight[t][k] / self.total[vertex]
    }

    /// Hands the derivatives of the average of `faces` at `vertex` by positions to `emit` as (by
    /// vertex, vector): with `p = 1/|x_k - centre|` the derivative of p is
    /// `-p³ (x_k - centre)` by `x_k - centre`.
    pub fn shape_derivatives(
        &self,
        sheet: &Sheet,
        x: &[Vec3],
        faces: &[f64],
        vertex: usize,
        mut emit: impl FnMut(usize, Vec3),
    ) {
        let around = sheet.vertex_triangles().entries(vertex);
        let mean: f64 = around
            .iter()
            .map(|&(t, k)| self.share(t as usize, k as usize, vertex) * faces[t as usize])
            .sum();
        for &(t, k) in around {
            let (t, k) = (t as usize, k as usize);
            let corners = sheet.triangles()[t].map(|v| v as usize);
            let [a, b, c] = corners.map(|v| x[v]);
            let arm = x[vertex] - (a + b + c) / 3.0;
            let p = self.weight[t][k];
            let by_arm = (-(p * p * p) * (faces[t] - mean) / self.total[vertex]) * arm;
            for (m, v) in corners.into_iter().enumerate() {
                let share = if m == k { 2.0 / 3.0 } else { -1.0 / 3.0 };
                emit(v, share * by_arm);
            }
        }
    }

    /// Writes the average of `faces` at every vertex; scalars or vectors.
    pub fn apply<T>(&self, sheet: &Sheet, faces: &[T], vertices: &mut [T])
    where
        T: Copy + Send + Sync + std::iter::Sum + std::ops::Mul<f64, Output = T>,
    {
        let (weight, total, incident) = (&self.weight, &self.total, sheet.vertex_triangles());
        parallel::fill(vertices, |i| {
            let around = incident.entries(i).iter();
            let sum: T =
                around.map(|&(t, k)| faces[t as usize] * weight[t as usize][k as usize]).sum();
            sum * (1.0 / total[i])
        });
    }
}
