//! What an energy is.

mod contact;
mod term;

pub use contact::{Contact, Interaction, SeparatedStart, Touching};
pub use term::EnergyTerm;
pub(crate) use term::{AnyContact, AnyEnergy, Work};

use serde::{Deserialize, Serialize};

use crate::Vec3;
use crate::geometry::{Conditions, Shape};
use crate::linear::BlockMatrix;

/// Which second derivatives are wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HessianPart {
    /// A positive semi-definite approximation: what remains when compressive geometric stiffness
    /// and terms linear in the curvature are dropped. The metric of descent methods.
    Positive,
    /// Everything; indefinite where the sheet buckles.
    Full,
}

/// Which vertices the second derivatives of an energy couple.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Coupling {
    /// Vertices up to so many edges apart.
    pub rings: usize,
    /// All with all, by terms of low rank: [`Energy::low_rank`].
    pub low_rank: bool,
}

impl Coupling {
    /// No vertex with another.
    pub const NONE: Self = Self { rings: 0, low_rank: false };
    /// Neighbours: the corners of a triangle.
    pub const ONE_RING: Self = Self { rings: 1, ..Self::NONE };
    /// Neighbours of neighbours: two triangles at an edge, or all triangles at a vertex.
    pub const TWO_RINGS: Self = Self { rings: 2, ..Self::NONE };
}

/// Conditions that an energy depends on besides the optimal lengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Reads<'a> {
    /// Numbers of species ([`Conditions::species`]): values at the vertices, as constant in a relaxation as optimal
    /// lengths are. [`EffectContext::species`](super::EffectContext::species) has the number of a name.
    pub species: &'a [usize],
    /// Whether it depends on time other than through the optimal lengths.
    pub time: bool,
    /// Whether it depends on the spontaneous curvature that a law gives.
    pub curvature: bool,
}

impl Reads<'_> {
    /// The time, if `time`, and nothing else.
    #[must_use]
    pub fn time(time: bool) -> Self {
        Self { time, ..Self::default() }
    }
}

/// A field of the conditions by which forces are differentiated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterField {
    /// The optimal lengths l̄ of the edges.
    OptimalLength,
    /// The spontaneous curvature C₀ that a law gives the vertices.
    SpontaneousCurvature,
    /// The species of this number at the vertices.
    Species(usize),
}

/// Sizes of forces on a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ForceScales {
    /// At unit strain, for tolerances; 0 if it has none.
    pub unit_strain: f64,
    /// The largest external force in the reference configuration; 0 if none is.
    pub applied: f64,
}

/// The second derivatives `stiffness · d ⊗ d`, d one vector a vertex.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RankOneTerm {
    /// Energy per squared unit of d·x.
    pub stiffness: f64,
    /// d, a gradient.
    pub direction: Vec<Vec3>,
}

/// An effect with an energy `U(x; l̄, c, t)`: positions x, optimal lengths l̄, species c that it reads, time t.
///
/// It is immutable. An evaluation hands it `work`, memory of a type of its own that it may use as it
/// likes; what [`Energy::prepare`] has left there belongs to the conditions (l̄, c, t) of all calls until it
/// is called again. An energy that is a sum over small elements is most easily made of an
/// [`Element`](super::Element); one that depends on which parts are near one another is a [`Contact`] as well.
pub trait Energy: Send + Sync + 'static {
    /// Memory of evaluations; `()` for none.
    type Work: Default + Send + 'static;

    /// Name under which the ledger and `inspect` list it; they number those that share one.
    fn name(&self) -> &str;

    /// Which vertices its second derivatives couple; a block outside of that is an error.
    fn coupling(&self) -> Coupling;

    /// Conditions that it depends on besides the optimal lengths.
    fn reads(&self) -> Reads<'_> {
        Reads::default()
    }

    /// Whether it is right on a part of a sheet, of a periodic one or on a rank: energies that count what is owned
    /// ([`Sheet::counts`](crate::sheet::Sheet::counts)), gradients and blocks that are complete there. Where it does not
    /// declare that, such sheets are refused.
    fn supports_ranks(&self) -> bool {
        false
    }

    /// Evaluates what depends on optimal lengths, species and time alone. Called before the first evaluation, and
    /// whenever these change.
    fn prepare(&self, _conditions: &Conditions<'_>, _work: &mut Self::Work) {}

    /// The energy at `shape`; with `gradient` given, `∂U/∂x_i` is **added** to `gradient[i]`.
    fn evaluate(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        gradient: Option<&mut [Vec3]>,
    ) -> f64;

    /// Adds second derivatives (blocks `∂²U/∂x_i∂x_j`, j ≥ i) to `into`, those of low rank left out.
    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        work: &mut Self::Work,
        part: HessianPart,
        into: &mut BlockMatrix,
    );

    /// Adds second derivatives that couple all vertices; for [`Coupling::low_rank`]. The
    /// positive part has those with a positive stiffness alone.
    fn low_rank(
        &self,
        _shape: &Shape<'_>,
        _work: &mut Self::Work,
        _part: HessianPart,
        _terms: &mut Vec<RankOneTerm>,
    ) {
    }

    /// Hands all `∂²U/∂x_i∂q_j` that can be different from zero to `emit` as (i, j, vector), q the field `by` at edge or
    /// vertex j: how the forces change with it. Which pairs come in which order depends on the sheet alone; a pair may
    /// come more than once, and then counts as the sum. Nothing for a field that the energy does not depend on. The
    /// conditions are those of the last [`Energy::prepare`].
    fn mixed_derivatives(
        &self,
        _shape: &Shape<'_>,
        _conditions: &Conditions<'_>,
        _work: &mut Self::Work,
        _by: ParameterField,
        _emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
    }

    /// Sizes of its forces on a sheet of this mean rest edge, of which the applied one is independent.
    fn force_scales(&self, _edge: f64) -> ForceScales {
        ForceScales::default()
    }
}
