//! Energies of any type, with their memory behind a pointer.

use std::any::Any;
use std::sync::Arc;

use super::{
    Contact, Coupling, Energy, ForceScales, HessianPart, Interaction, ParameterField, RankOneTerm,
    Reads, SeparatedStart, Touching,
};
use crate::Vec3;
use crate::effects::Pins;
use crate::geometry::{Conditions, Shape};
use crate::linear::BlockMatrix;

/// An energy of any type, as a model holds it.
pub struct EnergyTerm {
    pub(crate) energy: Arc<dyn AnyEnergy>,
    /// The same, if it is one of contact.
    contact: Option<Arc<dyn AnyContact>>,
}

impl std::fmt::Debug for EnergyTerm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("EnergyTerm").field(&self.name()).finish()
    }
}

impl EnergyTerm {
    /// Holds `energy`, of which nothing is asked that only [`Contact`] answers.
    #[must_use]
    pub fn new(energy: impl Energy) -> Self {
        Self { energy: Arc::new(energy), contact: None }
    }

    /// Holds the contact `energy`.
    #[must_use]
    pub fn contact(energy: impl Contact) -> Self {
        let energy = Arc::new(energy);
        Self { contact: Some(Arc::clone(&energy) as _), energy }
    }

    /// [`Energy::name`].
    #[must_use]
    pub fn name(&self) -> &str {
        self.energy.name()
    }

    /// [`Energy::coupling`].
    #[must_use]
    pub fn coupling(&self) -> Coupling {
        self.energy.coupling()
    }

    /// [`Energy::reads`].
    #[must_use]
    pub fn reads(&self) -> Reads<'_> {
        self.energy.reads()
    }

    /// [`Energy::supports_ranks`].
    #[must_use]
    pub fn supports_ranks(&self) -> bool {
        self.energy.supports_ranks()
    }

    /// [`ForceScales::applied`].
    #[must_use]
    pub fn applied_force(&self) -> f64 {
        self.energy.force_scales(1.0).applied
    }

    /// [`Contact::interaction`]; none of other energies.
    #[must_use]
    pub fn interaction(&self) -> Interaction {
        self.contact.as_ref().map(|contact| contact.interaction()).unwrap_or_default()
    }

    /// The contact that it is, where that answers what `asked` names.
    pub(crate) fn answering(&self, asked: fn(Interaction) -> bool) -> Option<&dyn AnyContact> {
        self.contact.as_deref().filter(|contact| asked(contact.interaction()))
    }
}

/// Memory of an [`EnergyTerm`]; made when it is first used.
pub type Work = Box<dyn Any + Send>;

/// Declares a trait whose methods are those of the same name of a trait with memory of its own type, and every one of
/// that trait as one of this: `work` is the memory as its own type.
macro_rules! erased {
    ($Erased:ident of $Typed:ident { $(
        fn $name:ident($($input:ident: $Input:ty),*) $(-> $Output:ty)?;
    )* }) => {
        pub(crate) trait $Erased: Send + Sync {
            $(fn $name(&self, $($input: $Input),*) $(-> $Output)?;)*
        }

        impl<E: $Typed> $Erased for E {
            $(fn $name(&self, $($input: $Input),*) $(-> $Output)? {
                $Typed::$name(self, $(erased!(@given $input $input)),*)
            })*
        }
    };
    (@given work $work:ident) => { own($work) };
    (@given $name:ident $input:ident) => { $input };
}

erased! {
    AnyEnergy of Energy {
        fn name() -> &str;
        fn coupling() -> Coupling;
        fn reads() -> Reads<'_>;
        fn supports_ranks() -> bool;
        fn prepare(conditions: &Conditions<'_>, work: &mut Work);
        fn evaluate(shape: &Shape<'_>, work: &mut Work, gradient: Option<&mut [Vec3]>) -> f64;
        fn add_hessian(shape: &Shape<'_>, work: &mut Work, part: HessianPart, into: &mut BlockMatrix);
        fn low_rank(shape: &Shape<'_>, work: &mut Work, part: HessianPart, terms: &mut Vec<RankOneTerm>);
        fn mixed_derivatives(
            shape: &Shape<'_>,
            conditions: &Conditions<'_>,
            work: &mut Work,
            by: ParameterField,
            emit: &mut dyn FnMut(usize, usize, Vec3)
        );
        fn force_scales(edge: f64) -> ForceScales;
    }
}

erased! {
    AnyContact of Contact {
        fn interaction() -> Interaction;
        fn pairs(shape: &Shape<'_>, work: &mut Work, pairs: &mut Vec<[u32; 2]>);
        fn largest_step(from: &Shape<'_>, work: &mut Work, direction: &[Vec3]) -> f64;
        fn allows_path(from: &Shape<'_>, work: &mut Work, to: (&[Vec3], f64)) -> bool;
        fn touching(shape: &Shape<'_>, work: &mut Work) -> Touching;
        fn refusal(shape: &Shape<'_>, work: &mut Work) -> Option<String>;
        fn separate(shape: &Shape<'_>, work: &mut Work, pins: &Pins) -> Option<SeparatedStart>;
    }
}

/// The memory as this type. Memory of another energy is replaced by new: it can hold nothing that this one has prepared.
fn own<W: Default + Send + 'static>(work: &mut Work) -> &mut W {
    if !work.is::<W>() {
        *work = Box::new(W::default());
    }
    work.downcast_mut().unwrap_or_else(|| unreachable!("it was just made of this type"))
}
