//! What an author writes: [`parameters!`](crate::parameters), a [`Model`], a [`LengthFactor`] if
//! chemistry changes lengths, [`Observables`] for derived quantities.

use crate::{Observable, Parameter, Scalar, Signal, Species};

/// Who wrote what; [`about!`](crate::about) takes most of it from `Cargo.toml`.
#[derive(Debug, Clone, Copy)]
pub struct About {
    /// Reverse domain name, for example `org.example.curvature-feedback`.
    pub id: &'static str,
    /// Short name for people.
    pub name: &'static str,
    /// Version.
    pub version: &'static str,
    /// Authors.
    pub author: &'static str,
    /// Licence, as an SPDX expression.
    pub licence: &'static str,
    /// What is modelled: equation, reference.
    pub doc: &'static str,
}

/// An [`About`] from an id, a doc text and the package's name, version, authors and licence.
#[macro_export]
macro_rules! about {
    ($id:expr, $doc:expr) => {
        $crate::About {
            id: $id,
            name: env!("CARGO_PKG_NAME"),
            version: env!("CARGO_PKG_VERSION"),
            author: env!("CARGO_PKG_AUTHORS"),
            licence: env!("CARGO_PKG_LICENSE"),
            doc: $doc,
        }
    };
}

/// The inputs of a law at one point.
#[derive(Debug, Clone, Copy)]
pub struct Point<'a, S> {
    /// Species, in the order of [`Model::SPECIES`].
    pub species: &'a [S],
    /// Signals, in the order of [`Model::SIGNALS`]; a vector takes three places.
    pub signals: &'a [S],
}

/// Why a law gives no (trustworthy) result.
#[derive(Debug, Clone, PartialEq)]
pub enum Failure {
    /// The result is there, but outside the range that the law was made for.
    Unreliable(String),
    /// No result; a step shorter by the factor (in (0, 1)) may succeed.
    Retry {
        /// By what to multiply the step.
        factor: f64,
        /// Why.
        message: String,
    },
    /// No result, and no other step will help.
    Fatal(String),
}

impl Failure {
    /// A fatal failure with this message.
    pub fn fatal(message: impl Into<String>) -> Self {
        Self::Fatal(message.into())
    }
}

/// Parameter values, in the order of [`Parametric::PARAMETERS`]. Defaults are filled in and bounds
/// checked by the engine.
#[derive(Debug, Clone, Copy)]
pub struct Parameters<'a> {
    pub(crate) names: &'a [&'a str],
    pub(crate) values: &'a [f64],
}

impl<'a> Parameters<'a> {
    /// These values, without names: for calling a law without the engine, as tests do.
    #[must_use]
    pub fn new(values: &'a [f64]) -> Self {
        Self { names: &[], values }
    }

    /// All values.
    #[must_use]
    pub fn values(&self) -> &'a [f64] {
        self.values
    }

    /// The value of a parameter.
    ///
    /// # Errors
    /// If [`Parametric::PARAMETERS`] has none of this name.
    pub fn get(&self, name: &str) -> Result<f64, Failure> {
        self.names
            .iter()
            .zip(self.values)
            .find_map(|(known, value)| (*known == name).then_some(*value))
            .ok_or_else(|| {
                Failure::Fatal(format!(
                    "the plugin asks for its parameter `{name}`, which it does not declare"
                ))
            })
    }
}

/// A law's parameters: written by [`parameters!`](crate::parameters), or by hand where values must
/// be checked together or turned into something else.
pub trait Parametric: Sized + Send + Sync + 'static {
    /// The parameters.
    const PARAMETERS: &'static [Parameter];

    /// The law with these parameters. Called for every range of points with other values
    /// where a scene gives parameters that differ from place to place.
    ///
    /// # Errors
    /// If they do not go together.
    fn from_parameters(parameters: &Parameters<'_>) -> Result<Self, Failure>;
}

/// A struct with one `f64` a parameter, known to scenes under the field's name.
///
/// Every line is `name: default, "unit", "description";`, with any of the bounds of [`Parameter`]
/// behind: `at_least(0.0)`, `above(0.0)`, `at_most(1.0)`, `below(1.0)`, `default_of("other")`.
///
/// ```
/// use rumple_plugin_sdk::prelude::*;
///
/// parameters! {
///     /// Production and decay.
///     pub struct Law {
///         k: 1.0, "1/time", "production", at_least(0.0);
///         tau: 2.0, "time", "lifetime", above(0.0);
///     }
/// }
/// ```
#[macro_export]
macro_rules! parameters {
    (
        $(#[$attribute:meta])*
        $visibility:vis struct $law:ident {
            $($name:ident: $default:expr, $unit:expr, $doc:expr
                $(, $bound:ident($($argument:expr),*))* $(,)?;)*
        }
    ) => {
        $(#[$attribute])*
        #[allow(non_snake_case)]
        #[derive(Debug, Clone, Copy)]
        $visibility struct $law {
            $(#[doc = $doc] $name: f64,)*
        }

        impl $crate::Parametric for $law {
            const PARAMETERS: &'static [$crate::Parameter] = &[
                $($crate::Parameter::new(stringify!($name), $unit, $default, $doc)
                    $(.$bound($($argument),*))*,)*
            ];

            #[allow(non_snake_case)]
            fn from_parameters(
                parameters: &$crate::Parameters<'_>,
            ) -> Result<Self, $crate::Failure> {
                match *parameters.values() {
                    [$($name),*] => Ok(Self { $($name),* }),
                    _ => Err($crate::Failure::fatal("the engine gave other parameters")),
                }
            }
        }
    };
}

/// Kinetics: rates R(c, signals) of the species at a point.
pub trait Model: Parametric {
    /// Who wrote what.
    const ABOUT: About;
    /// The species, at least one.
    const SPECIES: &'static [Species];
    /// The signals that the rates read.
    const SIGNALS: &'static [Signal] = &[];

    /// Writes the rate of each species at one point.
    ///
    /// # Errors
    /// If the law has no value there, or none to be trusted.
    fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure>;
}

/// Active strain: the factor Φ > 0 by which chemistry multiplies rest lengths.
pub trait LengthFactor: Model {
    /// Φ of the species at one point.
    ///
    /// # Errors
    /// If the law has no value there, or none to be trusted.
    fn length_factor<S: Scalar>(&self, species: &[S]) -> Result<S, Failure>;
}

/// The length factor Φ⊥ > 0 across a fibre; [`LengthFactor`] is then the one along it.
pub trait LengthFactorAcross: LengthFactor {
    /// Φ⊥ of the species at one point.
    ///
    /// # Errors
    /// If the law has no value there, or none to be trusted.
    fn length_factor_across<S: Scalar>(&self, species: &[S]) -> Result<S, Failure>;
}

/// The spontaneous curvature C₀ that bending gets from the species, 1/length.
pub trait SpontaneousCurvature: Model {
    /// C₀ of the species at one point; positive on a bump towards the normals.
    ///
    /// # Errors
    /// If the law has no value there, or none to be trusted.
    fn curvature<S: Scalar>(&self, species: &[S]) -> Result<S, Failure>;
}

/// Observables, derived quantities beside the species: a scene lists them in `output.fields`.
pub trait Observables: Model {
    /// Which; names are not those of species or signals.
    const OBSERVABLES: &'static [Observable];

    /// Writes each of them at one point.
    ///
    /// # Errors
    /// The quantity has no value.
    fn observe(&self, at: &Point<'_, f64>, out: &mut [f64]) -> Result<(), Failure>;
}
