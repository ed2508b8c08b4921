//! All that a user-defined effect needs: `use rumple::effects::prelude::*;`.
//!
//! `typetag` is part of it, so that its version is the one of the trait [`EffectSpec`]. The guide is
//! `docs/book/manual/effects.md`, a whole crate `examples/indenter`.

#[doc(no_inline)]
pub use nalgebra;
#[doc(no_inline)]
pub use typetag;

pub use super::{
    Block, BlockMatrix, Contact, Coupling, Effect, EffectContext, EffectError, EffectSpec, Element,
    Elements, Energy, Field, FieldValues, ForceScales, HessianPart, Interaction, InternalVariables,
    Material, MaterialField, Measure, Needs, ParameterField, Pins, Ramp, RampFactor, RankOneTerm,
    Reads, Region, SceneSummary, SeparatedStart, Touching, Transport, VertexField,
};
pub use crate::Vec3;
pub use crate::geometry::{Conditions, Shape, lumped_areas};
pub use crate::kinetics::Location;
pub use crate::num::checked::{Finite, Fraction, NonNegative, Positive};
pub use crate::sheet::Sheet;
