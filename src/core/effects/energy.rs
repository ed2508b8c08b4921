//! What an energy is.

mod term;

pub use term::EnergyTerm;
pub(crate) use term::{AnyEnergy, Work};

use serde::{Deserialize, Serialize};

use super::Pins;
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
    /// Pairs that depend on the shape: [`Energy::pairs`].
    pub pairs: bool,
    /// All with all, by terms of low rank: [`Energy::low_rank`].
    pub low_rank: bool,
    /// Whether steps are limited: [`Energy::largest_step`].
    pub limits_steps: bool,
}

impl Coupling {
    /// No vertex with another.
    pub const NONE: Self = Self { rings: 0, pairs: false, low_rank: false, limits_steps: false };
    /// Neighbours: the corners of a triangle.
    pub const ONE_RING: Self = Self { rings: 1, ..Self::NONE };
    /// Neighbours of neighbours: two triangles at an edge, or all triangles at a vertex.
    pub const TWO_RINGS: Self = Self { rings: 2, ..Self::NONE };
}

/// The second derivatives `stiffness · d ⊗ d`, d one vector a vertex.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RankOneTerm {
    /// Energy per squared unit of d·x.
    pub stiffness: f64,
    /// d, a gradient.
    pub direction: Vec<Vec3>,
}

/// What touches at a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touching {
    /// How many pairs of features are within their reach.
    pub pairs: usize,
    /// The smallest distance of such a pair; infinite if there is none.
    pub gap: f64,
}

/// A start whose parts were moved away from one another.
#[derive(Debug, Clone, PartialEq)]
pub struct SeparatedStart {
    /// Its positions.
    pub x: Vec<Vec3>,
    /// Pairs that crossed or were too near.
    pub pairs: usize,
    /// The largest displacement.
    pub moved: f64,
}

/// An effect with an energy `U(x; l̄, c, t)`: positions x, optimal lengths l̄, species c that it reads, time t.
///
/// It is immutable. An evaluation hands it `work`, memory of a type of its own that it may use as it
/// likes; what [`Energy::prepare`] has left there belongs to the conditions (l̄, c, t) of all calls until it
/// is called again. An energy that is a sum over small elements is most easily made of an
/// [`Element`](super::Element).
pub trait Energy: Send + Sync + 'static {
    /// Memory of evaluations; `()` for none.
    type Work: Default + Send + 'static;

    /// Name under which the ledger and `inspect` list it; they number those that share one.
    fn name(&self) -> &str;

    /// Which vertices its second derivatives couple; a block outside of that is an error.
    fn coupling(&self) -> Coupling;

    /// Whether it depends on time other than through the optimal lengths.
    fn depends_on_time(&self) -> bool {
        false
    }

    /// Numbers of the species that it reads ([`Conditions::species`]): values at the vertices, as constant in a relaxation
    /// as optimal lengths are. [`EffectContext::species`](super::EffectContext::species) has the number of a name.
    fn species(&self) -> &[usize] {
        &[]
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

    /// Adds the pairs of vertices that are coupled at `shape` though they are further apart than
    /// [`Coupling::rings`]; for [`Coupling::pairs`].
    fn pairs(&self, _shape: &Shape<'_>, _work: &mut Self::Work, _pairs: &mut Vec<[u32; 2]>) {}

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

    /// The largest fraction of the step `direction` from `from` that it allows, up to 1: for energies
    /// that are infinite beyond, as those of contact; for [`Coupling::limits_steps`].
    fn largest_step(&self, _from: &Shape<'_>, _work: &mut Self::Work, _direction: &[Vec3]) -> f64 {
        1.0
    }

    /// Whether the shape `from`, which it allows at its own time, may be led along straight lines to the positions `to` at
    /// the time `at`: for energies that move in time and are infinite beyond; for [`Coupling::limits_steps`].
    fn allows_path(
        &self,
        _from: &Shape<'_>,
        _work: &mut Self::Work,
        (_to, _at): (&[Vec3], f64),
    ) -> bool {
        true
    }

    /// Whether its forces are those of contact: the ledger then has what touches, and frames can have its pressure.
    fn is_contact(&self) -> bool {
        false
    }

    /// What touches at `shape`, for [`Energy::is_contact`].
    fn touching(&self, _shape: &Shape<'_>, _work: &mut Self::Work) -> Touching {
        Touching { pairs: 0, gap: f64::INFINITY }
    }

    /// Why `shape` can be no start, with the place, if it cannot: where the energy is infinite, or of no use; for
    /// [`Coupling::limits_steps`].
    fn refusal(&self, _shape: &Shape<'_>, _work: &mut Self::Work) -> Option<String> {
        None
    }

    /// A start near `shape` that it does not refuse, with vertices kept along the directions of `pins`; `None` where `shape` is
    /// one, no such start is found, or none is asked for. For [`Coupling::limits_steps`].
    fn separate(
        &self,
        _shape: &Shape<'_>,
        _work: &mut Self::Work,
        _pins: &Pins,
    ) -> Option<SeparatedStart> {
        None
    }

    /// Hands all `∂²U/∂x_i∂l̄_e` that can be different from zero to `emit` as (i, e, vector): how the
    /// forces change with the optimal lengths. Which pairs come in which order depends on the sheet
    /// alone; a pair may come more than once, and then counts as the sum. Nothing for an energy
    /// that knows no optimal lengths.
    fn mixed_metric_derivatives(
        &self,
        _shape: &Shape<'_>,
        _work: &mut Self::Work,
        _emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
    }

    /// Hands all `∂²U/∂x_i∂C₀_v` that can be different from zero to `emit` as (i, v, vector): how the forces change with
    /// the spontaneous curvature that a law gives vertex v. Which pairs come in which order depends on the sheet alone.
    /// Nothing for an energy that knows none.
    fn mixed_curvature_derivatives(
        &self,
        _shape: &Shape<'_>,
        _work: &mut Self::Work,
        _emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
    }

    /// Hands all `∂²U/∂x_i∂c_v` of species that it reads that can be different from zero to `emit` as (i, (species, v),
    /// vector): how the forces change with the value of a species at vertex v. Which come in which order depends on the sheet
    /// alone; one may come more than once, and then counts as the sum. The conditions are those of the last
    /// [`Energy::prepare`].
    fn mixed_species_derivatives(
        &self,
        _shape: &Shape<'_>,
        _conditions: &Conditions<'_>,
        _work: &mut Self::Work,
        _emit: &mut dyn FnMut(usize, (usize, usize), Vec3),
    ) {
    }

    /// Size of the force on a vertex at unit strain, for tolerances; 0 if it has none.
    fn force_scale(&self, _conditions: &Conditions<'_>) -> f64 {
        0.0
    }

    /// Largest external force on a vertex in the reference configuration; 0 if
    /// none is.
    fn largest_applied_force(&self) -> f64 {
        0.0
    }
}
