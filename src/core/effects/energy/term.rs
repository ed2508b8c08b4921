//! Energies of any type, with their memory behind a pointer.

use std::any::Any;

use super::{Coupling, Energy, HessianPart, RankOneTerm, SeparatedStart, Touching};
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

/// Declares [`AnyEnergy`], and every [`Energy`] as one: each method is the one of the same name, and `work` the memory as its
/// own type.
macro_rules! any_energy {
    ($($name:ident($($input:ident: $Input:ty),*) $(-> $Output:ty)?;)*) => {
        /// [`Energy`] with its memory behind a pointer; each method is the one of the same name.
        #[allow(missing_docs)]
        pub trait AnyEnergy: Send + Sync {
            fn work(&self) -> Work;
            fn name(&self) -> &str;
            fn species(&self) -> &[usize];
            $(fn $name(&self, $($input: $Input),*) $(-> $Output)?;)*
        }

        impl<E: Energy> AnyEnergy for E {
            fn work(&self) -> Work {
                Box::new(E::Work::default())
            }

            fn name(&self) -> &str {
                Energy::name(self)
            }

            fn species(&self) -> &[usize] {
                Energy::species(self)
            }

            $(fn $name(&self, $($input: $Input),*) $(-> $Output)? {
                Energy::$name(self, $(any_energy!(@given $input $input)),*)
            })*
        }
    };
    (@given work $work:ident) => { own($work) };
    (@given $name:ident $input:ident) => { $input };
}

any_energy! {
    coupling() -> Coupling;
    depends_on_time() -> bool;
    prepare(conditions: &Conditions<'_>, work: &mut Work);
    evaluate(shape: &Shape<'_>, work: &mut Work, gradient: Option<&mut [Vec3]>) -> f64;
    add_hessian(shape: &Shape<'_>, work: &mut Work, part: HessianPart, into: &mut BlockMatrix);
    pairs(shape: &Shape<'_>, work: &mut Work, pairs: &mut Vec<[u32; 2]>);
    low_rank(shape: &Shape<'_>, work: &mut Work, part: HessianPart, terms: &mut Vec<RankOneTerm>);
    largest_step(from: &Shape<'_>, work: &mut Work, direction: &[Vec3]) -> f64;
    allows_path(from: &Shape<'_>, work: &mut Work, to: (&[Vec3], f64)) -> bool;
    is_contact() -> bool;
    touching(shape: &Shape<'_>, work: &mut Work) -> Touching;
    refusal(shape: &Shape<'_>, work: &mut Work) -> Option<String>;
    separate(shape: &Shape<'_>, work: &mut Work, pins: &Pins) -> Option<SeparatedStart>;
    mixed_metric_derivatives(shape: &Shape<'_>, work: &mut Work, emit: &mut dyn FnMut(usize, usize, Vec3));
    mixed_curvature_derivatives(shape: &Shape<'_>, work: &mut Work, emit: &mut dyn FnMut(usize, usize, Vec3));
    mixed_species_derivatives(
        shape: &Shape<'_>,
        conditions: &Conditions<'_>,
        work: &mut Work,
        emit: &mut dyn FnMut(usize, (usize, usize), Vec3)
    );
    force_scale(conditions: &Conditions<'_>) -> f64;
    largest_applied_force() -> f64;
}

/// The memory as the type that it was made with. Memory of another energy is replaced by new: it can
/// hold nothing that this one has prepared.
fn own<W: Default + Send + 'static>(work: &mut Work) -> &mut W {
    if !work.is::<W>() {
        *work = Box::new(W::default());
    }
    work.downcast_mut().unwrap_or_else(|| unreachable!("it was just made of this type"))
}
