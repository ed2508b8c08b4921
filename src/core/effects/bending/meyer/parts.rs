//! What Meyer bending consists of, and its memory of evaluations.

use super::hessian::boundary::BoundaryHinges;
use super::weight::BendingWeight;
use crate::Vec3;
use crate::effects::FieldValues;
use crate::effects::bending::HingeBending;
use crate::effects::bending::hinge::HingeWork;
use crate::effects::bending::rest::VariableCurvature;
use crate::geometry::VertexArea;
use crate::linear::LazyStencils;

/// The derivatives of the energy by what a vertex gathers from its triangles.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)] // The first two are read in one go.
pub(super) struct VertexDerivatives {
    /// `∂U/∂L_i`.
    pub(super) by_vector: Vec3,
    /// `∂U/∂A_i`.
    pub(super) by_area: f64,
    /// `∂U/∂(Σθ)_i`.
    pub(super) by_angle: f64,
}

/// Meyer bending of one sheet.
#[derive(Debug)]
pub struct MeyerBending {
    /// B of every vertex.
    pub(super) rigidity: FieldValues,
    /// `B(1-ν)`.
    pub(super) gaussian: FieldValues,
    pub(super) weight: BendingWeight,
    pub(super) area: VertexArea,
    pub(super) has_boundary: bool,
    /// The rest shape, if it is not the plane.
    pub(super) curved: Option<Box<CurvedRest>>,
}

/// Memory of evaluations.
#[derive(Debug, Default)]
pub struct MeyerWork {
    /// `L_i`, `A_i` and `Σθ` of every vertex.
    pub(super) gathered: Vec<[f64; 5]>,
    pub(super) vertex: Vec<VertexDerivatives>,
    pub(super) places: Places,
    pub(super) curved: Option<Box<CurvedWork>>,
}

/// Where the blocks of the two parts go.
#[derive(Debug, Default)]
pub(super) struct Places {
    pub(super) rings: LazyStencils,
    pub(super) local: Option<Local>,
    pub(super) triangles: LazyStencils,
    pub(super) boundary: Option<BoundaryHinges>,
}

/// For every interior vertex and each of its triangles, which members of the ring its corners are.
#[derive(Debug)]
pub(super) struct Local {
    pub(super) start: Vec<u32>,
    pub(super) corners: Vec<[u16; 3]>,
}

/// The energy with what it has gathered at the shape.
#[derive(Clone, Copy)]
pub(super) struct At<'a> {
    pub(super) bending: &'a MeyerBending,
    /// As [`MeyerWork::gathered`].
    pub(super) gathered: &'a [[f64; 5]],
    /// Derivatives by it, for the whole Hessian.
    pub(super) vertex: &'a [VertexDerivatives],
    /// A rest shape that is not flat, or a spontaneous curvature.
    pub(super) curved: Option<CurvedAt<'a>>,
}

/// What a rest shape that is not the plane, or a spontaneous curvature, adds to a sheet.
#[derive(Debug)]
pub(super) struct CurvedRest {
    /// Where it is unbent, if that is not the plane.
    pub(super) shaped: Option<CurvedShape>,
    /// C₀ of every vertex; empty for 0.
    pub(super) spontaneous_curvature: Vec<f64>,
    /// The C₀ that is added and changes in a run.
    pub(super) variable_curvature: VariableCurvature,
    /// `1 - s` of every vertex.
    pub(super) vertices_share: FieldValues,
}

#[derive(Debug)]
pub(super) struct CurvedShape {
    pub(super) positions: Vec<Vec3>,
    pub(super) hinges: HingeBending,
}

/// Memory of evaluations.
#[derive(Debug, Default)]
pub(super) struct CurvedWork {
    /// N of every vertex at the shape.
    pub(super) normals: Vec<Vec3>,
    /// `∂U/∂N` of every vertex.
    pub(super) by_normal: Vec<Vec3>,
    /// 2H of the rest shape, and the same over Φ; empty if it is flat.
    pub(super) reference: Vec<f64>,
    pub(super) grown_reference: Vec<f64>,
    /// C₀ that changes in a run; empty without.
    pub(super) variable_curvature: Vec<f64>,
    pub(super) hinge: HingeWork,
}

/// A rest shape, and the shape at which the second derivatives are wanted.
#[derive(Clone, Copy)]
pub(super) struct CurvedAt<'a> {
    pub(super) rest: &'a CurvedRest,
    pub(super) work: &'a CurvedWork,
}
