//! What an author writes: a [`Model`], and a [`LengthFactor`] if chemistry changes lengths.

use crate::{Parameter, Scalar, Signal, Species};

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

/// Parameter values by name. Defaults are filled in and bounds checked by the engine.
#[derive(Debug, Clone, Copy)]
pub struct Parameters<'a> {
    pub(crate) names: &'a [&'a str],
    pub(crate) values: &'a [f64],
}

impl Parameters<'_> {
    /// The value of a parameter.
    ///
    /// # Errors
    /// If [`Model::PARAMETERS`] has none of this name.
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

/// Kinetics: rates R(c, signals) of the species at a point.
pub trait Model: Sized + Send + Sync + 'static {
    /// Who wrote what.
    const ABOUT: About;
    /// The species, at least one.
    const SPECIES: &'static [Species];
    /// The parameters.
    const PARAMETERS: &'static [Parameter] = &[];
    /// The signals that the rates read.
    const SIGNALS: &'static [Signal] = &[];

    /// The model with these parameters.
    ///
    /// # Errors
    /// If they do not go together.
    fn new(parameters: &Parameters<'_>) -> Result<Self, Failure>;

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
