//! Where species live, and their values carried to vertices and edges.

use super::{Chemistry, Surface};
use crate::Vec3;
use crate::geometry::FaceVertexAverage;
use crate::kinetics::Location;
use crate::parallel;
use crate::sheet::Sheet;

/// Values at vertices, of values where species live.
pub(in crate::model) fn at_vertices(
    sheet: &Sheet,
    average: Option<&FaceVertexAverage>,
    values: &[f64],
) -> Vec<f64> {
    let Some(average) = average else { return values.to_vec() };
    let mut out = vec![0.0; sheet.vertex_count()];
    average.apply(sheet, values, &mut out);
    out
}

/// Means of the two ends of every edge.
pub(in crate::model) fn edge_means(sheet: &Sheet, at_vertices: &[f64]) -> Vec<f64> {
    let edges = sheet.edges();
    let mut mean = vec![0.0; edges.len()];
    parallel::fill(&mut mean, |e| {
        let [a, b] = edges[e].vertices;
        0.5 * (at_vertices[a as usize] + at_vertices[b as usize])
    });
    mean
}

impl Chemistry {
    /// How many points carry species.
    #[must_use]
    pub fn points(&self, sheet: &Sheet) -> usize {
        match self.location {
            Location::Vertex => sheet.vertex_count(),
            Location::Face => sheet.triangle_count(),
            Location::Edge => sheet.edges().len(),
        }
    }

    /// Evaluates how values on faces are carried to vertices on the shape `x`.
    pub fn average(&self, sheet: &Sheet, x: &[Vec3], surface: &mut Surface) {
        if self.location == Location::Face {
            surface.average.get_or_insert_default().update(sheet, x);
        }
    }

    /// The species carried to the vertices (as they are, if they live there).
    #[must_use]
    pub fn at_vertices(
        &self,
        sheet: &Sheet,
        surface: &Surface,
        species: &[Vec<f64>],
    ) -> Vec<Vec<f64>> {
        species.iter().map(|c| at_vertices(sheet, surface.average.as_ref(), c)).collect()
    }

    /// Means of the ends of every edge.
    pub(super) fn at_edges(
        &self,
        sheet: &Sheet,
        surface: &Surface,
        species: &[Vec<f64>],
    ) -> Vec<Vec<f64>> {
        self.at_vertices(sheet, surface, species).iter().map(|c| edge_means(sheet, c)).collect()
    }

    /// Hands the points whose values make up the value at `vertex` to `each`, with their shares.
    pub(crate) fn sources_of_vertex(
        sheet: &Sheet,
        surface: &Surface,
        vertex: usize,
        mut each: impl FnMut(usize, f64),
    ) {
        match &surface.average {
            None => each(vertex, 1.0),
            Some(average) => {
                for &(t, k) in sheet.vertex_triangles().of(vertex) {
                    let (t, k) = (t as usize, k as usize);
                    each(t, average.share(t, k, vertex));
                }
            }
        }
    }
}
