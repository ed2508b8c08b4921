//! Second derivatives of the Meyer bending energy.
//!
//! `U = Σ_i f(L_i, A_i, Θ_i)` with Θ the angle sum, so `∂²U` has an outer part from `f''`, one ring
//! of vertices at a time, and an inner part `f'·∂²(L, A, Θ)`, one triangle at a time.
//!
//! **Outer part.** With `J = ∂L - (L/A) ∂A` (the change of `L/A`, times A),
//!
//! ```text
//! p = 1:  f'' = (B/4A) |J|²                                             (convex)
//! p = 2:  f'' = (B/4A²) [ |J|² - 2 (L·J)(∂A)/A ] - 2G(2π-Θ)/A³ (∂A)² - 2(G/A²) ∂Θ ∂A
//! ```
//!
//! with `∂L_i/∂x_m = Σ_T (e_i·e_m)/(2A) n nᵀ + s_im [n]×`, s = +1 for m = i+2 and -1 for m = i+1,
//! and `G = B(1-ν)`. The first term is the positive part.
//!
//! **Inner part.** The gradient of a triangle is `Q × e_k + h_k × n` with `h_k = g_{k+1} - g_{k+2}`,
//! `Q = P V/(2A) + ½ a_T n` (see the parent module); moving corner m by δ changes
//! `n` by `P (e_m × δ)/(2A)`, `2A` by `n·(e_m × δ)`, `V` by `-h_m × δ` and `e_k` by `±δ`.
//!
//! Derivatives by angles, `Σ_k w_k ∂θ_k`, add `γ_k e_k` to `g_k` in `h` (not in `V`), with
//! `γ_k = (w_{k+1} - w_{k+2})/|e_k|²`, whose own change is `∂(γ e) = γ (1 - 2 e eᵀ/|e|²) ∂e`.
//!
//! **At the boundary.** Boundary vertices have no mean curvature, so the first term knows no stiffness for shapes
//! whose curvature vanishes inside, one for every boundary vertex. The file `boundary.rs` gives the positive part
//! what the Gaussian curvature has for them.
//!
//! Exact for frozen-Voronoi and barycentric areas; for `area = "mixed-voronoi"` the second
//! derivatives of the area fractions are left out.

pub(super) mod boundary;
pub(super) mod curved;
mod rings;
mod triangles;

use super::parts::{At, Local, Places};
use super::weight::BendingWeight;
use crate::effects::HessianPart;
use crate::geometry::Shape;
use crate::linear::{BlockMatrix, Stencils};
use crate::num::index;
use crate::sheet::Sheet;

use boundary::BoundaryHinges;
use rings::OuterPart;
use triangles::InnerPart;

impl Local {
    fn new(sheet: &Sheet) -> Self {
        let mut local = Self { start: vec![0], corners: Vec::new() };
        let mut vertices = Vec::new();
        for i in 0..sheet.vertex_count() {
            ring(sheet, i, &mut vertices);
            if !vertices.is_empty() {
                local.corners.extend(sheet.vertex_triangles().entries(i).iter().map(|&(t, _)| {
                    sheet.triangles()[t as usize].map(|v| {
                        let found = vertices.binary_search(&v).ok();
                        found.and_then(|place| u16::try_from(place).ok()).unwrap_or(u16::MAX)
                    })
                }));
            }
            local.start.push(index(local.corners.len()));
        }
        local
    }

    #[inline(always)]
    fn corners_of(&self, i: usize) -> &[[u16; 3]] {
        &self.corners[self.start[i] as usize..self.start[i + 1] as usize]
    }
}

/// A vertex and its neighbours, ascending; none on the boundary, where no outer part exists.
pub(super) fn ring(sheet: &Sheet, i: usize, vertices: &mut Vec<u32>) {
    vertices.clear();
    if !sheet.boundary()[i] {
        vertices.push(index(i));
        vertices.extend(sheet.vertex_edges().entries(i).iter().map(|&(_, j)| j));
        vertices.sort_unstable();
    }
}

impl At<'_> {
    /// Whether the vertices are unbent elsewhere than in the plane, and hinges take the place of the Gaussian part.
    fn is_shaped(&self) -> bool {
        self.curved.is_some_and(|curved| curved.rest.hinges().is_some())
    }
}

/// Adds the wanted part of the Hessian; `places` belong to the sheet.
pub(super) fn add(
    at: &At<'_>,
    places: &mut Places,
    shape: &Shape<'_>,
    part: HessianPart,
    into: &mut BlockMatrix,
) {
    let (sheet, bending) = (shape.sheet, at.bending);
    let rings = places.rings.for_pattern(into.pattern(), || {
        (0..sheet.vertex_count()).map(|i| {
            let mut vertices = Vec::new();
            ring(sheet, i, &mut vertices);
            vertices
        })
    });
    let local = places.local.get_or_insert_with(|| Local::new(sheet));
    let full = part == HessianPart::Full;
    let second_order = full && bending.weight == BendingWeight::Paper;
    let outer = OuterPart { at: *at, shape: *shape, local, second_order };
    let inner = InnerPart { at: *at, shape: *shape };
    let triangles = full.then(|| {
        places.triangles.for_pattern(into.pattern(), || {
            sheet.triangles().iter().map(|t| {
                let mut t = *t;
                t.sort_unstable();
                t
            })
        })
    });
    match (at.is_shaped(), triangles) {
        (false, triangles) => {
            let triangles = triangles.map(|places| (places, &inner));
            Stencils::assemble_wide(into, (rings, &outer), triangles);
        }
        (true, Some(places)) => {
            Stencils::assemble_wide(into, (places, &inner), None::<(&Stencils, &InnerPart<'_>)>);
        }
        (true, None) => {}
    }
    if let Some(curved) = at.curved
        && (full || at.is_shaped())
    {
        curved::add(at, curved, (shape, full), rings, into);
    }
    if part == HessianPart::Positive && bending.has_boundary && !at.is_shaped() {
        let boundary = places.boundary.get_or_insert_with(|| BoundaryHinges::new(sheet));
        boundary.add(&bending.gaussian, bending.weight, shape, into);
    }
}
