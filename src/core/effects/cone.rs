//! What pressure and volume have in common: the tetrahedra between triangles and a point O.
//!
//! ```text
//! u_T = w/6 (x₀ - O)·[(x₁ - O) × (x₂ - O)],     ∂u_T/∂x_k → w/6 N_T,   N_T = (x₁ - x₀) × (x₂ - x₀)
//! ```
//!
//! The derivative is that around interior vertices, where it does not depend on O; for boundaries
//! see the effect `pressure`. Block (k, m) of the derivative of this gradient is `(w/6) [e_m]×`, e_m
//! the edge opposite corner m; its symmetric part is `(w/12) [e_m - e_k]×`. Summed over the
//! ring of an interior vertex the two are the same.

use super::element::{self, Element, Mesh};
use super::{Block, BlockMatrix, EffectError, HessianPart};
use crate::Vec3;
use crate::geometry::Shape;
use crate::linear::LazyStencils;
use crate::sheet::Sheet;

/// Refuses a periodic sheet: the volume beside it depends on where the period is cut.
pub(super) fn check_not_periodic(sheet: &Sheet) -> Result<(), EffectError> {
    if sheet.reduction().periods().is_empty() {
        return Ok(());
    }
    let message = "a periodic sheet has no volume beside it".to_owned();
    let help = Some("push it by kind = \"load\" with a force per area".to_owned());
    Err(EffectError { key: "kind", message, help })
}

/// The tetrahedron between a triangle and O, times a weight.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cone {
    /// w, energy per volume.
    pub weight: f64,
    /// O.
    pub apex: Vec3,
}

/// Memory of evaluations.
#[derive(Debug, Default)]
pub struct ConeWork {
    pull: Vec<[Vec3; 3]>,
    places: LazyStencils,
}

impl Cone {
    /// w times the volume at `shape`; with `gradient` given, its derivatives are added there.
    pub(super) fn evaluate(
        &self,
        shape: &Shape<'_>,
        work: &mut ConeWork,
        gradient: Option<&mut [Vec3]>,
    ) -> f64 {
        let mesh = Mesh::triangles(shape.sheet);
        element::evaluate(&mesh, |_| self, shape.x, &mut work.pull, gradient)
    }

    /// Adds its second derivatives. They are indefinite: the positive part has nothing of them.
    pub(super) fn add_hessian(
        &self,
        shape: &Shape<'_>,
        work: &mut ConeWork,
        part: HessianPart,
        into: &mut BlockMatrix,
    ) {
        if part == HessianPart::Full {
            let mesh = Mesh::triangles(shape.sheet);
            element::add_hessian(&mesh, |_| self, shape.x, part, &mut work.places, into);
        }
    }
}

impl Element<3> for Cone {
    fn gradient(&self, x: &[Vec3; 3]) -> (f64, [Vec3; 3]) {
        let [a, b, c] = x.map(|x| x - self.apex);
        let sixth = self.weight / 6.0;
        let normal = (x[1] - x[0]).cross(&(x[2] - x[0]));
        (sixth * a.dot(&b.cross(&c)), [sixth * normal; 3])
    }

    fn hessian(&self, x: &[Vec3; 3], _: HessianPart) -> [[Block; 3]; 3] {
        let e = [x[2] - x[1], x[0] - x[2], x[1] - x[0]];
        std::array::from_fn(|k| {
            std::array::from_fn(|m| (self.weight / 12.0) * (e[m] - e[k]).cross_matrix())
        })
    }
}
