//! What the positive part of the second derivatives has at the boundary.
//!
//! ```text
//! (B/2) [ (2H)² - 2(1-ν) K ] = (B/2) [ ν (2H)² + (1-ν) (κ₁² + κ₂²) ]
//! ```
//!
//! is positive, but its two parts on the left are not: the Gaussian curvature is indefinite, and `|J|²`
//! alone vanishes for discrete harmonic displacements, whose L_i is zero at every interior vertex. There
//! are as many of these as boundary vertices: waves along the boundary that fade within one wavelength. Their
//! stiffness is that of the Gaussian term, about `B(1-ν) k⁴` in the strip where they live. A metric
//! without it moves the boundary wildly.
//!
//! So the hinges with a corner on the boundary get `¾ B(1-ν) l²/(A₁+A₂) ∂θ ⊗ ∂θ`: on an equilateral
//! lattice hinges cost `(B/2)[(2H)² - (8/3) K]` (see the hinge model), so this share of them has the
//! modulus of the Gaussian term. It is right for the shortest waves, and too soft in proportion to
//! the wavelength for longer ones, which reach beyond these hinges. It is a metric only: forces
//! and the whole Hessian know nothing of it.

use super::super::super::dihedral;
use super::super::weight::BendingWeight;
use crate::effects::{FieldValues, element};
use crate::geometry::Shape;
use crate::linear::{BlockMatrix, LazyStencils};
use crate::sheet::Sheet;

/// Share of the hinge energy whose Gaussian modulus is that of a plate, by 1 - ν.
const HINGE_SHARE: f64 = 0.75;

/// The hinges with a corner on the boundary.
#[derive(Debug)]
pub(in super::super) struct BoundaryHinges {
    corners: Vec<[u32; 4]>,
    places: LazyStencils,
}

impl BoundaryHinges {
    pub(super) fn new(sheet: &Sheet) -> Self {
        let on_boundary =
            |corners: &[u32; 4]| corners.iter().any(|&v| sheet.boundary()[v as usize]);
        let corners =
            dihedral::hinges(sheet).map(|(_, corners)| corners).filter(on_boundary).collect();
        Self { corners, places: LazyStencils::default() }
    }

    /// Adds their stiffness; `gaussian` is B(1-ν) of the vertices, of which the ends of an edge count.
    pub(super) fn add(
        &mut self,
        gaussian: &FieldValues,
        weight: BendingWeight,
        shape: &Shape<'_>,
        into: &mut BlockMatrix,
    ) {
        let rigidity = |gaussian: f64| {
            move |area: f64| match weight {
                BendingWeight::Area => HINGE_SHARE * gaussian,
                // A sum of densities: the area of a vertex, that of two triangles, is missing.
                BendingWeight::Paper => HINGE_SHARE * gaussian / area,
            }
        };
        let corners = &self.corners;
        let of = |[a, b, ..]: [u32; 4]| match gaussian {
            FieldValues::Same(gaussian) => *gaussian,
            FieldValues::Each(all) => 0.5 * (all[a as usize] + all[b as usize]),
        };
        let blocks = |h: usize| {
            dihedral::stiffness_blocks(
                &corners[h].map(|v| shape.x[v as usize]),
                rigidity(of(corners[h])),
            )
        };
        element::add_blocks(corners, blocks, &mut self.places, into);
    }
}
