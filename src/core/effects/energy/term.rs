//! Energies of any type, with their memory behind a pointer.

use std::any::Any;

use super::{Coupling, Energy, HessianPart, LowRank, Separation, Touching};
use crate::Vec3;
use crate::effects::Pins;
use crate::geometry::{Conditions, Shape};
use crate::linear::BlockMatrix;

/// An energy of any type, as a model holds it.
pub struct EnergyTerm(Box<dyn AnyEnergy>);

impl std::fmt::Debug for EnergyTerm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("EnergyTerm").field(&self.name()).finish()
    }
}

impl EnergyTerm {
    /// Holds `energy`.
    #[must_use]
    pub fn new(energy: impl Energy) -> Self {
        Self(Box::new(energy))
    }
}

impl std::ops::Deref for EnergyTerm {
    type Target = dyn AnyEnergy;

    fn deref(&self) -> &Self::Target {
        self.0.as_ref()
    }
}

/// Memory of an [`EnergyTerm`].
pub type Work = Box<dyn Any + Send>;

/// [`Energy`] with its memory behind a pointer; each method is the one of the same name.
#[allow(missing_docs)]
pub trait AnyEnergy: Send + Sync {
    fn work(&self) -> Work;
    fn name(&self) -> &str;
    fn coupling(&self) -> Coupling;
    fn depends_on_time(&self) -> bool;
    fn species(&self) -> &[usize];
    fn prepare(&self, conditions: &Conditions<'_>, work: &mut Work);
    fn evaluate(&self, shape: &Shape<'_>, work: &mut Work, gradient: Option<&mut [Vec3]>) -> f64;
    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        work: &mut Work,
        part: HessianPart,
        into: &mut BlockMatrix,
    );
    fn pairs(&self, shape: &Shape<'_>, work: &mut Work, pairs: &mut Vec<[u32; 2]>);
    fn low_rank(
        &self,
        shape: &Shape<'_>,
        work: &mut Work,
        part: HessianPart,
        terms: &mut Vec<LowRank>,
    );
    fn largest_step(&self, from: &Shape<'_>, work: &mut Work, direction: &[Vec3]) -> f64;
    fn allows_path(&self, from: &Shape<'_>, work: &mut Work, to: (&[Vec3], f64)) -> bool;
    fn is_contact(&self) -> bool;
    fn touching(&self, shape: &Shape<'_>, work: &mut Work) -> Touching;
    fn refusal(&self, shape: &Shape<'_>, work: &mut Work) -> Option<String>;
    fn separate(&self, shape: &Shape<'_>, work: &mut Work, pins: &Pins) -> Option<Separation>;
    fn metric_derivatives(
        &self,
        shape: &Shape<'_>,
        work: &mut Work,
        emit: &mut dyn FnMut(usize, usize, Vec3),
    );
    fn curvature_derivatives(
        &self,
        shape: &Shape<'_>,
        work: &mut Work,
        emit: &mut dyn FnMut(usize, usize, Vec3),
    );
    fn species_derivatives(
        &self,
        shape: &Shape<'_>,
        conditions: &Conditions<'_>,
        work: &mut Work,
        emit: &mut dyn FnMut(usize, (usize, usize), Vec3),
    );
    fn force_scale(&self, conditions: &Conditions<'_>) -> f64;
    fn applied_force(&self) -> f64;
}

/// The memory as the type that it was made with. Memory of another energy is replaced by new: it can
/// hold nothing that this one has prepared.
fn own<W: Default + Send + 'static>(work: &mut Work) -> &mut W {
    if !work.is::<W>() {
        *work = Box::new(W::default());
    }
    work.downcast_mut().unwrap_or_else(|| unreachable!("it was just made of this type"))
}

impl<E: Energy> AnyEnergy for E {
    fn work(&self) -> Work {
        Box::new(E::Work::default())
    }

    fn name(&self) -> &str {
        Energy::name(self)
    }

    fn coupling(&self) -> Coupling {
        Energy::coupling(self)
    }

    fn depends_on_time(&self) -> bool {
        Energy::depends_on_time(self)
    }

    fn species(&self) -> &[usize] {
        Energy::species(self)
    }

    fn prepare(&self, conditions: &Conditions<'_>, work: &mut Work) {
        Energy::prepare(self, conditions, own(work));
    }

    fn evaluate(&self, shape: &Shape<'_>, work: &mut Work, gradient: Option<&mut [Vec3]>) -> f64 {
        Energy::evaluate(self, shape, own(work), gradient)
    }

    fn add_hessian(
        &self,
        shape: &Shape<'_>,
        work: &mut Work,
        part: HessianPart,
        into: &mut BlockMatrix,
    ) {
        Energy::add_hessian(self, shape, own(work), part, into);
    }

    fn pairs(&self, shape: &Shape<'_>, work: &mut Work, pairs: &mut Vec<[u32; 2]>) {
        Energy::pairs(self, shape, own(work), pairs);
    }

    fn low_rank(
        &self,
        shape: &Shape<'_>,
        work: &mut Work,
        part: HessianPart,
        terms: &mut Vec<LowRank>,
    ) {
        Energy::low_rank(self, shape, own(work), part, terms);
    }

    fn largest_step(&self, from: &Shape<'_>, work: &mut Work, direction: &[Vec3]) -> f64 {
        Energy::largest_step(self, from, own(work), direction)
    }

    fn allows_path(&self, from: &Shape<'_>, work: &mut Work, to: (&[Vec3], f64)) -> bool {
        Energy::allows_path(self, from, own(work), to)
    }

    fn is_contact(&self) -> bool {
        Energy::is_contact(self)
    }

    fn touching(&self, shape: &Shape<'_>, work: &mut Work) -> Touching {
        Energy::touching(self, shape, own(work))
    }

    fn refusal(&self, shape: &Shape<'_>, work: &mut Work) -> Option<String> {
        Energy::refusal(self, shape, own(work))
    }

    fn separate(&self, shape: &Shape<'_>, work: &mut Work, pins: &Pins) -> Option<Separation> {
        Energy::separate(self, shape, own(work), pins)
    }

    fn metric_derivatives(
        &self,
        shape: &Shape<'_>,
        work: &mut Work,
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        Energy::metric_derivatives(self, shape, own(work), emit);
    }

    fn curvature_derivatives(
        &self,
        shape: &Shape<'_>,
        work: &mut Work,
        emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
        Energy::curvature_derivatives(self, shape, own(work), emit);
    }

    fn species_derivatives(
        &self,
        shape: &Shape<'_>,
        conditions: &Conditions<'_>,
        work: &mut Work,
        emit: &mut dyn FnMut(usize, (usize, usize), Vec3),
    ) {
        Energy::species_derivatives(self, shape, conditions, own(work), emit);
    }

    fn force_scale(&self, conditions: &Conditions<'_>) -> f64 {
        Energy::force_scale(self, conditions)
    }

    fn applied_force(&self) -> f64 {
        Energy::applied_force(self)
    }
}
