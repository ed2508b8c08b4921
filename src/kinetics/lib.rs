//! Reaction kinetics as the engine sees them: one trait for built-in laws and plugins.
//!
//! With n_s species c and n_x signal columns x at every point where species live,
//!
//! ```text
//! R_s(c, x)    rates                          ∂R_s/∂c_j, ∂R_s/∂x_k
//! Φ(c), C₀(c), Φ_⊥(c)  feedback on the sheet  ∂Φ/∂c_j, …   ([`Feedback`])
//! o_k(c, y)    observables, for output; y may be other signals
//! ```
//!
//! A law comes from a shared library ([`Library`], the only place with `unsafe`) or from Rust code
//! that implements [`Kinetics`]. Effects and solvers do not call the trait directly but through
//! [`field::evaluate`], which evaluates a whole field in parallel and lets no bad number pass.

mod batch;
pub mod breakpoints;
mod combined;
pub mod descriptor;
pub mod differences;
mod error;
mod feedback;
pub mod field;
pub mod formula;
mod host_law;
mod library;
mod metadata;
mod parameters;
mod quantity;
pub mod search;
mod signal;
mod site;
pub mod validation;

pub use batch::{Batch, Column};
use breakpoints::TimeDependence;
pub use combined::{JointError, JointKinetics, Member};
pub use descriptor::{
    Capabilities, Descriptor, Location, Observable, Parameter, SignalRead, Species,
};
pub use error::KineticsError;
pub use feedback::Feedback;
pub use host_law::HostLaw;
pub use library::{Library, PluginKinetics};
pub use quantity::Quantity;
pub use rumple_plugin_abi::C_HEADER;
pub use search::PluginSearch;
pub use signal::Signal;
pub use site::{BadValue, Site};

/// A result that was given, but outside the range that the law was made for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unreliable {
    /// What the law says about it.
    pub message: String,
    /// Number of the first point concerned, if the law says which.
    pub point: Option<usize>,
}

/// How an evaluation ended: with results that can be trusted (`None`), with a warning, or without.
pub type Outcome = Result<Option<Unreliable>, KineticsError>;

/// A law for species, evaluated on batches of points.
///
/// Pure: the same inputs give the same outputs, from any number of threads at once. All column
/// slices have the length of the batch.
pub trait Kinetics: Send + Sync + std::fmt::Debug {
    /// Species, parameters, signals read and quantities given.
    fn descriptor(&self) -> &Descriptor;

    /// Parameter values in the order of the descriptor.
    fn parameters(&self) -> &[f64];

    /// Writes a quantity, `values[output][point]`, and its partial derivatives,
    /// `partials[output · inputs + input][point]`, unless `partials` is empty. [`Quantity`] has the numbers of outputs
    /// and inputs, and the signals of the batch.
    ///
    /// [`Quantity::write_neutral`] serves for what a law does not give, [`differences::partials`] for derivatives that it
    /// does not give itself.
    ///
    /// # Errors
    /// If the law fails; the outputs are then unspecified.
    fn evaluate(
        &self,
        quantity: Quantity,
        batch: &Batch<'_>,
        values: &mut [&mut [f64]],
        partials: &mut [&mut [f64]],
    ) -> Outcome;

    /// Takes the typical magnitudes of the species in a run, once. Provided: they do not matter, as to a law that gives
    /// exact derivatives.
    fn set_typical(&self, _typical: &[f64]) {}

    /// The typical magnitudes of the species in a run, by which [`differences`] take steps, if it was given any.
    fn typical(&self) -> Option<&[f64]> {
        None
    }

    /// Adds the times from 0 to `until` at which the rates have a kink or a jump in time, whatever the species, at
    /// the points of `batch`, and their course between these; whether it is all. Provided: nothing is known of a law
    /// that reads the time.
    fn time_dependence(
        &self,
        _batch: &Batch<'_>,
        _until: f64,
        _found: &mut TimeDependence,
    ) -> bool {
        !self.descriptor().signals.iter().any(|read| read.signal == Signal::Time)
    }

    /// What messages call the law that gives bad numbers for a quantity in this batch. Provided: this one.
    fn blamed_law(&self, _quantity: Quantity, _batch: &Batch<'_>) -> String {
        self.descriptor().title()
    }
}
