//! The paper's Green-Gauss diffusion of a species on faces.
//!
//! Vertex values are averages of the adjacent faces (weights 1/distance); the gradient of a face
//! is `(∇c)_j = (1/A_j) Σ_edges ½ (c_i + c_k) l n`, n the outward edge normal in the face; the
//! Laplacian applies the same rule to the vertex averages of the gradient,
//! `(Δc)_j = (1/A_j) Σ_edges ½ (g_i + g_k)·n l`.
//!
//! At the boundary the conormal part of the averaged gradient is removed at the vertices (no flux).
//! Setting the flux of the boundary edges to zero instead leaves modes at the boundary that grow.
//!
//! Known faults, kept because this is here for comparison: as many modes as there are more faces
//! than vertices (half of the faces, about) are never damped; it does not converge on random
//! meshes, where a few modes inside the sheet even grow, if slowly (at 0.4 % of the fastest decay
//! on a lattice jittered by a fifth of its edges; none on generated meshes); and it conserves only
//! on flat sheets.
//!
//! Source: Zakharov & Dasbiswas (2021), section on numerical methods; Ferziger & Perić,
//! Computational Methods for Fluid Dynamics (2002).

use super::Transport;
use crate::Vec3;
use crate::geometry::{FaceVertexAverage, Faces};
use crate::parallel;
use crate::sheet::Sheet;

/// Green-Gauss diffusion of one species.
#[derive(Debug)]
pub struct GreenGauss {
    species: usize,
    coefficient: f64,
    /// The operator on a surface that does not change, if it is to be that.
    frozen: Option<GreenGaussOperator>,
}

/// The operator on one surface.
#[derive(Debug, Default)]
pub struct GreenGaussOperator {
    average: FaceVertexAverage,
    /// Outward edge normals times half the edge length over the area, by opposite corner.
    edge_normal: Vec<[Vec3; 3]>,
    /// Unit conormal at boundary vertices, zero elsewhere.
    conormal: Vec<Vec3>,
    /// Bound on the spectral radius of Δ: its row sums, taken factor by factor.
    bound: f64,
}

impl GreenGauss {
    /// On `sheet` in its rest state; `frozen` keeps that surface.
    #[must_use]
    pub fn new(sheet: &Sheet, species: usize, coefficient: f64, frozen: bool) -> Self {
        // Without diffusion nothing needs to follow the shape.
        let frozen = (frozen || coefficient == 0.0).then(|| {
            let mut at_rest = GreenGaussOperator::default();
            at_rest.assemble(sheet, sheet.rest());
            at_rest
        });
        Self { species, coefficient, frozen }
    }

    /// The operator in use where that of the shape is `operator`.
    fn effective_operator<'a>(
        &'a self,
        operator: &'a GreenGaussOperator,
    ) -> &'a GreenGaussOperator {
        self.frozen.as_ref().unwrap_or(operator)
    }
}

impl GreenGaussOperator {
    /// `(Δc)_j` at every face.
    #[must_use]
    pub fn laplacian(&self, sheet: &Sheet, c: &[f64]) -> Vec<f64> {
        let (triangles, normal) = (sheet.triangles(), &self.edge_normal);
        let mut at_vertex = vec![0.0; sheet.vertex_count()];
        self.average.apply(sheet, c, &mut at_vertex);
        // Of the outermost ghosts some faces are missing here.
        sheet.reduction().update_ghost_columns(std::slice::from_mut(&mut at_vertex));
        let mut gradient = vec![Vec3::zeros(); c.len()];
        parallel::fill(&mut gradient, |t| {
            let v = triangles[t].map(|v| at_vertex[v as usize]);
            (0..3).map(|k| (v[(k + 1) % 3] + v[(k + 2) % 3]) * normal[t][k]).sum()
        });
        let mut vertex_gradient = vec![Vec3::zeros(); sheet.vertex_count()];
        self.average.apply(sheet, &gradient, &mut vertex_gradient);
        parallel::update(&mut vertex_gradient, |i, g| {
            let n = self.conormal[i];
            *g -= n * n.dot(g);
        });
        let mut out = vec![0.0; c.len()];
        parallel::fill(&mut out, |t| {
            let g = triangles[t].map(|v| vertex_gradient[v as usize]);
            (0..3).map(|k| (g[(k + 1) % 3] + g[(k + 2) % 3]).dot(&normal[t][k])).sum()
        });
        out
    }

    fn assemble(&mut self, sheet: &Sheet, x: &[Vec3]) {
        self.edge_normal.resize(sheet.triangle_count(), [Vec3::zeros(); 3]);
        self.conormal.resize(sheet.vertex_count(), Vec3::zeros());
        self.average.update(sheet, x);
        let mut faces = Faces::default();
        faces.update(sheet, x);
        let (triangles, face) = (sheet.triangles(), faces.all());
        parallel::fill(&mut self.edge_normal, |t| {
            let [a, b, c] = triangles[t].map(|v| x[v as usize]);
            // An edge that runs counter-clockwise has its outward normal at e × n.
            [c - b, a - c, b - a].map(|e| e.cross(&face[t].normal) / (2.0 * face[t].area))
        });
        self.conormal.fill(Vec3::zeros());
        let edges = sheet.edges().iter().enumerate().filter(|(_, edge)| edge.is_boundary());
        for (e, edge) in edges {
            let t = edge.triangles[0] as usize;
            let k = sheet.triangle_edges()[t].iter().position(|&o| o as usize == e).unwrap_or(0);
            for v in edge.vertices {
                self.conormal[v as usize] += self.edge_normal[t][k] * face[t].area;
            }
        }
        for n in &mut self.conormal {
            if *n != Vec3::zeros() {
                *n = n.normalize();
            }
        }
        // |∇c| ≤ max_signs |Σ ±n_k| = 2 max|n_k| for |c| ≤ 1, since the n_k add up to zero.
        let (normal, incident) = (&self.edge_normal, sheet.vertex_triangles());
        let steepest = |t: usize| 2.0 * normal[t].iter().map(Vec3::norm).fold(0.0, f64::max);
        let mut around = vec![0.0; sheet.vertex_count()];
        parallel::fill(&mut around, |i| {
            incident.entries(i).iter().map(|&(t, _)| steepest(t as usize)).fold(0.0, f64::max)
        });
        self.bound = parallel::max(normal.len(), |t| {
            (0..3).map(|k| normal[t][k].norm() * around[triangles[t][k] as usize]).sum()
        });
    }
}

impl Transport for GreenGauss {
    type Operator = GreenGaussOperator;

    fn name(&self) -> &'static str {
        "diffusion"
    }

    fn species(&self) -> usize {
        self.species
    }

    /// The coefficient is not in it.
    fn has_operator_of(&self, other: &Self) -> bool {
        self.frozen.is_none() && other.frozen.is_none()
    }

    fn assemble(&self, sheet: &Sheet, x: &[Vec3], operator: &mut GreenGaussOperator) {
        if self.frozen.is_none() {
            operator.assemble(sheet, x);
        }
    }

    fn add_rate(
        &self,
        (sheet, _): (&Sheet, f64),
        operator: &GreenGaussOperator,
        c: &[f64],
        out: &mut [f64],
    ) {
        if self.coefficient == 0.0 {
            return;
        }
        let laplacian = self.effective_operator(operator).laplacian(sheet, c);
        parallel::update(out, |t, rate| *rate += self.coefficient * laplacian[t]);
    }

    fn spectral_bound(&self, _: (&Sheet, f64), operator: &GreenGaussOperator) -> f64 {
        self.coefficient * self.effective_operator(operator).bound
    }

    fn entries(
        &self,
        (sheet, _): (&Sheet, f64),
        operator: &GreenGaussOperator,
        emit: &mut dyn FnMut(usize, usize, f64),
    ) {
        let GreenGaussOperator { average, edge_normal, conormal, .. } =
            self.effective_operator(operator);
        let (triangles, around) = (sheet.triangles(), sheet.vertex_triangles());
        // The four steps of the Laplacian, backwards from each face: mean gradients at the corners,
        // gradients of the faces around, means of the values at their corners.
        for (t, corners) in triangles.iter().enumerate() {
            for k in 0..3 {
                let outer =
                    self.coefficient * (edge_normal[t][(k + 1) % 3] + edge_normal[t][(k + 2) % 3]);
                let v = corners[k] as usize;
                let outer = outer - conormal[v] * conormal[v].dot(&outer);
                for &(f, own) in around.entries(v) {
                    let f = f as usize;
                    let share = average.share(f, own as usize, v);
                    for m in 0..3 {
                        let normal = edge_normal[f][(m + 1) % 3] + edge_normal[f][(m + 2) % 3];
                        let slope = share * outer.dot(&normal);
                        let w = triangles[f][m] as usize;
                        for &(g, own) in around.entries(w) {
                            let share = average.share(g as usize, own as usize, w);
                            emit(t, g as usize, slope * share);
                        }
                    }
                }
            }
        }
    }
}
