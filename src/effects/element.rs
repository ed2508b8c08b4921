//! Energies that are sums over small elements: triangles, hinges.
//!
//! ```text
//! U = Σ_e u_e(x_{e,0}, …, x_{e,K-1})
//! ```
//!
//! An element is pure: from the positions of its K corners it returns its energy and derivatives.
//! The loops over the elements of a sheet are here, once for all of them.

use super::HessianPart;
use crate::Vec3;
use crate::parallel;
use crate::sheet::{Incidence, Sheet};
use crate::solve::linear::{Block, BlockMatrix, LazyStencils};

/// A term of an energy that depends on K vertices.
pub(super) trait Element<const K: usize>: Sync {
    /// The energy, and its derivative by every corner.
    fn gradient(&self, x: &[Vec3; K]) -> (f64, [Vec3; K]);

    /// Second derivatives: block `[k][m]` is `∂²u/∂x_k∂x_m`.
    fn hessian(&self, x: &[Vec3; K], part: HessianPart) -> [[Block; K]; K];
}

/// Which vertices are the corners of which element.
pub(super) struct Mesh<'a, const K: usize> {
    /// Vertices of every element.
    pub(super) corners: &'a [[u32; K]],
    /// `(element, corner)` pairs of every vertex.
    pub(super) incident: &'a Incidence,
}

impl<'a> Mesh<'a, 3> {
    /// The triangles of `sheet`.
    pub(super) fn triangles(sheet: &'a Sheet) -> Self {
        Self { corners: sheet.triangles(), incident: sheet.vertex_triangles() }
    }
}

impl<const K: usize> Mesh<'_, K> {
    fn positions(&self, e: usize, x: &[Vec3]) -> [Vec3; K] {
        self.corners[e].map(|v| x[v as usize])
    }
}

/// The energy of all elements at `x`; with `gradient` given, its derivatives are added there.
/// `pull` is memory for the derivatives by corner.
pub(super) fn evaluate<'e, const K: usize, E: Element<K> + 'e>(
    mesh: &Mesh<'_, K>,
    element: impl Fn(usize) -> &'e E + Sync,
    x: &[Vec3],
    pull: &mut Vec<[Vec3; K]>,
    gradient: Option<&mut [Vec3]>,
) -> f64 {
    pull.resize(mesh.corners.len(), [Vec3::zeros(); K]);
    let energy = parallel::fill_and_sum(pull, |e| {
        let (energy, pull) = element(e).gradient(&mesh.positions(e, x));
        (pull, energy)
    });
    if let Some(gradient) = gradient {
        parallel::update(gradient, |i, g| {
            for &(e, k) in mesh.incident.of(i) {
                *g += pull[e as usize][k as usize];
            }
        });
    }
    energy
}

/// Adds the second derivatives of all elements at `x`; `places` belong to the mesh.
pub(super) fn add_hessian<'e, const K: usize, E: Element<K> + 'e>(
    mesh: &Mesh<'_, K>,
    element: impl Fn(usize) -> &'e E + Sync,
    x: &[Vec3],
    part: HessianPart,
    places: &mut LazyStencils,
    into: &mut BlockMatrix,
) {
    let blocks = |e| element(e).hessian(&mesh.positions(e, x), part);
    add_blocks(mesh.corners, blocks, places, into);
}

/// Adds the symmetric `blocks` of every element between its corners; `places` belong to these.
pub(super) fn add_blocks<const K: usize>(
    corners: &[[u32; K]],
    blocks: impl Fn(usize) -> [[Block; K]; K] + Sync,
    places: &mut LazyStencils,
    into: &mut BlockMatrix,
) {
    let sorted = |corners: &[u32; K]| {
        let mut corners = *corners;
        corners.sort_unstable();
        corners
    };
    let stencils = places.for_pattern(into.pattern(), || corners.iter().map(sorted));
    stencils.assemble(into, |e, sink| {
        let corners = &corners[e];
        // Position of every corner in the ascending order of the sink.
        let rank = corners.map(|v| corners.iter().filter(|other| **other < v).count());
        for (row, &p) in blocks(e).iter().zip(&rank) {
            for (block, &q) in row.iter().zip(&rank) {
                if p <= q {
                    sink.add(p, q, block);
                }
            }
        }
    });
}
