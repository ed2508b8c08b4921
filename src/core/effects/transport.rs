//! What moves a species about.

use std::any::Any;

use super::signal_factor::SignalFactor;
use super::{FieldValues, WrongCoefficient};
use crate::Vec3;
use crate::kinetics::formula::SpeciesFormula;
use crate::sheet::Sheet;

/// Transport of one species c by another one or itself: `dc/dt = … + L b + s`, with the matrix L and the sources s of
/// a shape, and b the species that it reads.
///
/// It is immutable; its discretisation on a given shape is a [`Transport::Operator`]. Methods take the sheet and the time as `on`.
pub trait Transport: Send + Sync + 'static {
    /// The transport on one shape, and the memory for it.
    type Operator: Default + Send + Sync + 'static;

    /// Its name in results.
    fn name(&self) -> &'static str {
        "transport"
    }

    /// Number of the species in the kinetics' descriptor.
    fn species(&self) -> usize;

    /// Number of the species that it reads: itself, unless this is cross-diffusion or the like.
    fn read_species(&self) -> usize {
        self.species()
    }

    /// Whether it has sources: a rate that is not 0 where the species that it reads is 0.
    fn has_sources(&self) -> bool {
        false
    }

    /// The coefficients of the triangles, length²/time, of a transport that is a coefficient times the Laplacian of the species
    /// that it reads; `None` for others.
    fn diffusivity(&self) -> Option<FieldValues> {
        None
    }

    /// The key of its table in a scene that says how fast it is.
    fn speed_key(&self) -> &'static str {
        "coefficient"
    }

    /// The two points of every boundary edge through which it prescribes a flux (Neumann, Robin); a triangle twice where
    /// species live on faces.
    fn flux_edges(&self) -> Vec<[usize; 2]> {
        Vec::new()
    }

    /// The first point where a rate of it that depends on time is negative or no number, of a transport with sources.
    fn inadmissible(&self, _on: (&Sheet, f64)) -> Option<WrongCoefficient> {
        None
    }

    /// Whether its operator on any shape is that of `other`: one then serves both.
    fn has_operator_of(&self, _other: &Self) -> bool {
        false
    }

    /// Makes `operator` that of the shape `x`.
    fn assemble(&self, sheet: &Sheet, x: &[Vec3], operator: &mut Self::Operator);

    /// Adds the rate of change, `L c + s`, at a time to `out`; `c` is the species that it reads.
    fn add_rate(&self, on: (&Sheet, f64), operator: &Self::Operator, c: &[f64], out: &mut [f64]);

    /// A bound on the row sums of |L| at a time, and so on its decay rates, 1/time.
    fn spectral_bound(&self, on: (&Sheet, f64), operator: &Self::Operator) -> f64;

    /// Hands the matrix L of the transport at a time to `emit` as (point, by point, value); order and pairs
    /// depend on the sheet alone, pairs may come more than once.
    fn entries(
        &self,
        on: (&Sheet, f64),
        operator: &Self::Operator,
        emit: &mut dyn FnMut(usize, usize, f64),
    );

    /// Hands the derivatives of the rate at `c` by positions to `emit` as (point, by vertex, vector),
    /// in an order that depends on the sheet alone; `x` is the shape of `operator`. Nothing for a
    /// transport that leaves them out: implicit methods then see them through the residual alone.
    fn shape_derivatives(
        &self,
        _on: (&Sheet, f64),
        _operator: &Self::Operator,
        _x: &[Vec3],
        _c: &[f64],
        _emit: &mut dyn FnMut(usize, usize, Vec3),
    ) {
    }
}

/// A transport of any type, as a model holds it.
pub struct TransportTerm {
    transport: Box<dyn AnyTransport>,
    /// A factor at the points that reads species (`species_coefficient.rs`).
    pub(super) coefficient: Option<SpeciesFormula>,
    /// A factor at the points that reads signals (`signal_factor.rs`).
    pub(super) factor: Option<SignalFactor>,
    /// Number of the effect that it is part of.
    pub(crate) effect: Option<usize>,
}

impl std::fmt::Debug for TransportTerm {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("TransportTerm").field(&self.name()).field(&self.species()).finish()
    }
}

impl TransportTerm {
    /// Holds `transport`.
    #[must_use]
    pub fn new(transport: impl Transport) -> Self {
        Self {
            transport: Box::new(Boxed(transport)),
            coefficient: None,
            factor: None,
            effect: None,
        }
    }

    /// The key of its coefficient, as `effect[2].coefficient`.
    #[must_use]
    pub fn coefficient_key(&self) -> String {
        let table = self.effect.map_or(String::new(), |number| format!("effect[{number}]."));
        table + self.speed_key()
    }

    /// On the shape `x`.
    #[must_use]
    pub fn operator_on(&self, sheet: &Sheet, x: &[Vec3]) -> Operator {
        let mut operator = self.transport.operator();
        self.assemble(sheet, x, &mut operator);
        operator
    }

    /// Whether one operator serves both: [`Transport::has_operator_of`].
    pub(crate) fn has_operator_of(&self, other: &Self) -> bool {
        self.transport.has_operator_of(&*other.transport)
    }

    /// Makes `operator` that of the shape `x`.
    pub(crate) fn assemble(&self, sheet: &Sheet, x: &[Vec3], operator: &mut Operator) {
        self.transport.assemble(sheet, x, operator);
    }

    /// As [`Transport::diffusivity`]; `None` of a coefficient that reads species.
    #[must_use]
    pub fn diffusivity(&self) -> Option<FieldValues> {
        self.transport_diffusivity().filter(|_| self.coefficient.is_none())
    }

    /// As [`Transport::diffusivity`], without the factor that reads species.
    pub(super) fn transport_diffusivity(&self) -> Option<FieldValues> {
        self.transport.diffusivity()
    }
}

/// A transport on one shape.
pub type Operator = Box<dyn Any + Send + Sync>;

struct Boxed<T>(T);

fn own<O: 'static>(operator: &Operator) -> &O {
    operator.downcast_ref().unwrap_or_else(|| unreachable!("operators stay with their transport"))
}

/// Declares [`AnyTransport`], and every boxed [`Transport`] as one: each method is the one of the same name, and `operator` the
/// operator as its own type.
macro_rules! any_transport {
    ($($name:ident($($input:ident: $Input:ty),*) $(-> $Output:ty)?;)*) => {
        /// [`Transport`] with its operator behind a pointer; each method is the one of the same name.
        pub(crate) trait AnyTransport: Send + Sync {
            fn diffusivity(&self) -> Option<FieldValues>;
            fn operator(&self) -> Operator;
            fn transport(&self) -> &dyn Any;
            fn has_operator_of(&self, other: &dyn AnyTransport) -> bool;
            fn assemble(&self, sheet: &Sheet, x: &[Vec3], operator: &mut Operator);
            $(fn $name(&self, $($input: $Input),*) $(-> $Output)?;)*
        }

        impl<T: Transport> AnyTransport for Boxed<T> {
            fn operator(&self) -> Operator {
                Box::new(T::Operator::default())
            }

            fn transport(&self) -> &dyn Any {
                &self.0
            }

            fn diffusivity(&self) -> Option<FieldValues> {
                self.0.diffusivity()
            }

            fn has_operator_of(&self, other: &dyn AnyTransport) -> bool {
                other.transport().downcast_ref().is_some_and(|other| self.0.has_operator_of(other))
            }

            fn assemble(&self, sheet: &Sheet, x: &[Vec3], operator: &mut Operator) {
                if let Some(operator) = operator.downcast_mut() {
                    self.0.assemble(sheet, x, operator);
                }
            }

            $(fn $name(&self, $($input: $Input),*) $(-> $Output)? {
                self.0.$name($(any_transport!(@given $input $input)),*)
            })*
        }

        impl TransportTerm {
            $(
                #[doc = concat!("[`Transport::", stringify!($name), "`].")]
                pub fn $name(&self, $($input: $Input),*) $(-> $Output)? {
                    self.transport.$name($($input),*)
                }
            )*
        }
    };
    (@given operator $operator:ident) => { own($operator) };
    (@given $name:ident $input:ident) => { $input };
}

any_transport! {
    name() -> &'static str;
    species() -> usize;
    read_species() -> usize;
    has_sources() -> bool;
    speed_key() -> &'static str;
    flux_edges() -> Vec<[usize; 2]>;
    inadmissible(on: (&Sheet, f64)) -> Option<WrongCoefficient>;
    add_rate(on: (&Sheet, f64), operator: &Operator, c: &[f64], out: &mut [f64]);
    spectral_bound(on: (&Sheet, f64), operator: &Operator) -> f64;
    entries(on: (&Sheet, f64), operator: &Operator, emit: &mut dyn FnMut(usize, usize, f64));
    shape_derivatives(
        on: (&Sheet, f64),
        operator: &Operator,
        x: &[Vec3],
        c: &[f64],
        emit: &mut dyn FnMut(usize, usize, Vec3)
    );
}
