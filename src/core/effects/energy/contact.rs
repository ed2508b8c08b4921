//! What contact adds to an energy.

use super::Energy;
use crate::Vec3;
use crate::effects::Pins;
use crate::geometry::Shape;

/// Which of the questions of [`Contact`] an energy answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Interaction {
    /// It couples pairs of vertices that depend on the shape: [`Contact::pairs`].
    pub pairs: bool,
    /// It is infinite beyond, and limits steps: [`Contact::largest_step`], [`Contact::allows_path`],
    /// [`Contact::refusal`], [`Contact::separate`].
    pub limits_steps: bool,
    /// Its forces are those of contact: the ledger has [`Contact::touching`], and frames can have its pressure.
    pub touches: bool,
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

/// An energy of parts that are near one another, as a barrier or adhesion is. It goes into a model by
/// [`Effect::contact`](super::super::Effect::contact).
pub trait Contact: Energy {
    /// Which of the methods here are asked.
    fn interaction(&self) -> Interaction;

    /// Adds the pairs of vertices that are coupled at `shape` though they are further apart than
    /// [`Coupling::rings`](super::Coupling::rings).
    fn pairs(&self, _shape: &Shape<'_>, _work: &mut Self::Work, _pairs: &mut Vec<[u32; 2]>) {}

    /// The largest fraction of the step `direction` from `from` that it allows, up to 1.
    fn largest_step(&self, _from: &Shape<'_>, _work: &mut Self::Work, _direction: &[Vec3]) -> f64 {
        1.0
    }

    /// Whether the shape `from`, which it allows at its own time, may be led along straight lines to the positions `to` at
    /// the time `at`: for energies that move in time.
    fn allows_path(
        &self,
        _from: &Shape<'_>,
        _work: &mut Self::Work,
        (_to, _at): (&[Vec3], f64),
    ) -> bool {
        true
    }

    /// What touches at `shape`.
    fn touching(&self, _shape: &Shape<'_>, _work: &mut Self::Work) -> Touching {
        Touching { pairs: 0, gap: f64::INFINITY }
    }

    /// Why `shape` can be no start, with the place, if it cannot: where the energy is infinite, or of no use.
    fn refusal(&self, _shape: &Shape<'_>, _work: &mut Self::Work) -> Option<String> {
        None
    }

    /// A start near `shape` that it does not refuse, with vertices kept along the directions of `pins`; `None` where `shape` is
    /// one, no such start is found, or none is asked for.
    fn separate(
        &self,
        _shape: &Shape<'_>,
        _work: &mut Self::Work,
        _pins: &Pins,
    ) -> Option<SeparatedStart> {
        None
    }
}
