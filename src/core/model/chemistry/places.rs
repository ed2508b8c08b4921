//! Where species live, and their values carried to vertices and edges.

use std::sync::Arc;

use super::{Chemistry, Surface};
use crate::Vec3;
use crate::geometry::{Face, sum_at_corners};
use crate::kinetics::Location;
use crate::model::parameters::{at_vertices, edge_means};
use crate::parallel;
use crate::sheet::Sheet;

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

    /// Areas that go with the species in the shape `x`, of the triangles or the vertices that they live on.
    #[must_use]
    pub fn point_areas(&self, sheet: &Sheet, x: &[Vec3]) -> Vec<f64> {
        let area = |t: usize| Face::from_corners(&sheet.triangles()[t].map(|v| x[v as usize])).area;
        let mut areas = vec![0.0; self.points(sheet)];
        match self.location {
            Location::Vertex => sum_at_corners(sheet, |t| area(t) / 3.0, &mut areas),
            _ => parallel::fill(&mut areas, area),
        }
        areas
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
                for &(t, k) in sheet.vertex_triangles().entries(vertex) {
                    let (t, k) = (t as usize, k as usize);
                    each(t, average.share(t, k, vertex));
                }
            }
        }
    }
}

impl Chemistry {
    /// Evaluates the transports on the shape `x`.
    pub fn transport(&self, sheet: &Sheet, x: &[Vec3], surface: &mut Surface) {
        surface.operators.truncate(self.transports.len());
        let mut made = 0;
        for (k, term) in self.transports.iter().enumerate() {
            // That of an earlier one.
            if self.which[k] < made {
                continue;
            }
            let _scope = self.transport_scope(k, "operator on a shape");
            match surface.operators.get_mut(made) {
                Some(operator) => term.assemble(sheet, x, operator),
                None => surface.operators.push(term.operator_on(sheet, x)),
            }
            made += 1;
        }
        surface.which = Arc::clone(&self.which);
    }
}
