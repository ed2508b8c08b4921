//! Why a model has no value at a state.

use crate::kinetics::{KineticsError, Location};
use crate::linear::LinearError;
use crate::num::Short;
use crate::reduction::Reduction;
use crate::sheet::SheetError;

/// Why a model has no value at a state, or refuses it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// A law failed.
    #[error(transparent)]
    Kinetics(#[from] KineticsError),
    /// Optimal lengths that make no triangle, or a rest state without one.
    #[error(transparent)]
    Sheet(#[from] SheetError),
    /// A matrix that does not fit in memory.
    #[error(transparent)]
    Linear(#[from] LinearError),
    /// An effect whose second derivatives couple vertices that it does not declare.
    #[error(
        "the effect {effect} couples vertices {} and {}, which its declared coupling does not: \
         corners of elements are at most two edges apart, Energy::coupling covers all blocks that an energy adds, and \
         vertices further apart are coupled by terms of low rank",
        pair[0], pair[1]
    )]
    Coupling {
        /// Name of the effect.
        effect: String,
        /// The first such pair.
        pair: [u32; 2],
    },
    /// Growth to a length that is not a positive number.
    #[error(
        "growth gives the edge between vertices {} and {} the length factor {value} at time \
         {time}; it must be a number > 0",
        vertices[0], vertices[1]
    )]
    Growth {
        /// The ends of the edge.
        vertices: [u32; 2],
        /// The factor.
        value: f64,
        /// The time.
        time: f64,
    },
    /// An internal variable of an effect that is not finite, or a length factor that is not positive.
    #[error("the internal variable {name} becomes {value} at {} {place} at time {time}; it must be {range}", location.noun())]
    Internal {
        /// Its name.
        name: &'static str,
        /// Where it lives.
        location: Location,
        /// Number of the place.
        place: usize,
        /// The value there.
        value: f64,
        /// What it has to be.
        range: &'static str,
        /// The time.
        time: f64,
    },
    /// An inadmissible coefficient of diffusion or cross-diffusion, by a formula of species.
    #[error(
        "{key}: the coefficient of {effect} of `{species}` becomes {} at {} {point}; it must be {range}",
        Short(*value), location.noun()
    )]
    Coefficient {
        /// Its key.
        key: String,
        /// Name of the effect.
        effect: &'static str,
        /// What it has to be.
        range: &'static str,
        /// The species that diffuses.
        species: String,
        /// Where species live.
        location: Location,
        /// Number of the point.
        point: usize,
        /// The coefficient.
        value: f64,
    },
    /// A rate of exchange, by a formula of the time, that is negative or no number.
    #[error(
        "{key}: the rate of {effect} of `{species}` becomes {} at {} {point} at time {time}; it must be a number ≥ 0 at all \
         times of the run",
        Short(*value), location.noun()
    )]
    Rate {
        /// Its key.
        key: String,
        /// Name of the effect.
        effect: &'static str,
        /// The species.
        species: String,
        /// Where species live.
        location: Location,
        /// Number of the point.
        point: usize,
        /// The rate.
        value: f64,
        /// The time.
        time: f64,
    },
    /// Another rank has no value; that is its error.
    #[error("another rank has failed")]
    Elsewhere {
        /// Whether a smaller step may do without the failure there.
        recoverable: bool,
    },
    /// An error of the integration made a species negative.
    #[error(
        "species `{species}` becomes {value:e} at {} {point} at time {time}, below 0 by more than the tolerance, and its \
         law does not make it negative: try a smaller time.integrator.atol",
        location.noun()
    )]
    Negative {
        /// The species.
        species: String,
        /// Where species live.
        location: Location,
        /// Number of the point.
        point: usize,
        /// The value there.
        value: f64,
        /// End time of the step.
        time: f64,
    },
    /// A species left its valid range by more than the tolerance.
    #[error(
        "species `{species}` becomes {value:e} at {} {point} at time {time}; it is valid from {} to \
         {}: the step is too large for its kinetics, or the kinetics leave the range",
        location.noun(), Short(range.0), Short(range.1)
    )]
    OutOfRange {
        /// The species.
        species: String,
        /// Where species live.
        location: Location,
        /// Number of the point.
        point: usize,
        /// The value there.
        value: f64,
        /// Valid range.
        range: (f64, f64),
        /// End time of the step.
        time: f64,
    },
}

impl ModelError {
    /// `outcome`, or an error on all ranks where it is one on any.
    pub(crate) fn agreed<T>(reduction: &Reduction, outcome: Result<T, Self>) -> Result<T, Self> {
        if reduction.distribution().is_none() {
            return outcome;
        }
        let fatal = |error: &Self| if error.is_recoverable() { 1.0 } else { 2.0 };
        let worst = reduction.largest_over_ranks(outcome.as_ref().err().map_or(0.0, fatal));
        let recoverable = worst < 2.0;
        match outcome {
            Ok(_) if worst > 0.0 => Err(Self::Elsewhere { recoverable }),
            Err(error) if error.is_recoverable() && !recoverable => {
                Err(Self::Elsewhere { recoverable })
            }
            outcome => outcome,
        }
    }

    /// Whether a smaller step may do without this failure: a chemistry that changed too fast, a law that
    /// asks for it, optimal lengths that make no triangle.
    #[must_use]
    pub fn is_recoverable(&self) -> bool {
        match self {
            Self::Kinetics(error) => error.is_recoverable(),
            Self::Sheet(_)
            | Self::OutOfRange { .. }
            | Self::Negative { .. }
            | Self::Internal { .. }
            | Self::Coefficient { .. } => true,
            Self::Elsewhere { recoverable } => *recoverable,
            Self::Coupling { .. } | Self::Growth { .. } | Self::Rate { .. } | Self::Linear(_) => {
                false
            }
        }
    }
}
