//! The effects a scene can list: each file holds one, from its equation to its derivatives.
//!
//! An effect is a description ([`EffectSpec`], what a scene writes) that builds an [`Effect`]: any of
//! energies ([`Energy`], most easily as a sum over [`Element`]s), fixed directions, and
//! transports of a species ([`Transport`]). All of these are immutable; what an evaluation needs besides is
//! in memory that the evaluation owns. What a scene does not list is not built.

mod active;
mod advection;
mod bending;
mod cone;
mod contact;
mod context;
mod cotan;
mod cross_diffusion;
mod diffusion;
mod directed_growth;
mod element;
mod energy;
mod error;
mod exchange;
mod fibre;
mod fibre_diffusion;
mod field;
mod flow_rule;
mod flux;
mod foundation;
mod green_gauss;
mod growth;
mod hold;
mod inflow;
mod internal_variables;
mod length_factor;
mod load;
mod material;
mod pin;
pub mod prelude;
mod prescribed;
mod pressure;
mod ramp;
mod region;
mod remodelling;
mod signal_factor;
mod spec;
mod species_coefficient;
mod stretching;
mod timed_field;
mod transport;
mod vertex_field;
mod volume;

pub use active::ActiveTension;
pub use advection::{Advection, AdvectionScheme};
pub use bending::{
    Bending, BendingModel, BendingRest, BendingWeight, HingeBending, MeyerBending, RestShape,
    SPONTANEOUS_CURVATURE,
};
pub use contact::{
    Adhesion, Contacts, NO_CROSSINGS_ADVICE, ObstacleShape, ObstacleSpec, SelfContact, Side,
};
pub use context::{EffectContext, Measure};
pub use cotan::{Cotan, CotanOperator};
pub use cross_diffusion::CrossDiffusion;
pub use diffusion::{Diffusion, DiffusionMetric, DiffusionScheme};
pub use directed_growth::LawGrowthDirectionSpec;
pub use element::{Element, Elements};
pub(crate) use energy::{AnyContact, AnyEnergy, Work};
pub use energy::{
    Contact, Coupling, Energy, EnergyTerm, ForceScales, HessianPart, Interaction, ParameterField,
    RankOneTerm, Reads, SeparatedStart, Touching,
};
pub use error::{EffectError, WrongCoefficient};
pub use exchange::Exchange;
pub use fibre::Fibre;
pub use field::{Field, FieldValues, ReadSurface, RegionValue, formula_on, formula_values};
pub use flow_rule::FlowRule;
pub use flux::Flux;
pub use foundation::{Foundation, FoundationTarget};
pub use green_gauss::GreenGauss;
pub use growth::Growth;
pub use hold::DirichletSpec;
pub use inflow::FluxPer;
pub use internal_variables::InternalVariables;
pub use length_factor::{DirectedLengthFactor, LengthFactor};
pub use load::{DeadLoad, Load, LoadForce};
pub use material::{Material, MaterialField};
pub use pin::{Axes, Pin};
pub use prescribed::{DirichletValues, Pins, PrescribedDisplacement};
pub use pressure::{FollowerPressure, Pressure};
pub use ramp::{Ramp, RampFactor};
pub use region::Region;
pub use remodelling::{LengthRemodelling, Remodelling};
pub use signal_factor::{SignalFactor, SignalValues, TransportInputs};
pub use spec::{Effect, EffectParts, EffectSpec, Needs, SceneSummary, kinds};
pub use stretching::{
    BondStretching, Stretching, StretchingModel, StretchingModulus, StretchingWeight,
    StvkStretching,
};
pub(crate) use transport::Operator;
pub use transport::{Transport, TransportTerm};
pub use vertex_field::VertexField;
pub use volume::{EnclosedVolume, Volume, VolumeTarget};

pub use crate::linear::{Block, BlockMatrix};

use spec::misplaced;
