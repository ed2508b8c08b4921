//! Write a kinetics plugin in Rust: one struct with the parameters, one generic function a law.
//!
//! A law is written once for any [`Scalar`]; the engine then gets its values in `f64` and its
//! exact partial derivatives by forward dual numbers. [`export_plugin!`] makes the library
//! loadable. A complete plugin (crate type `cdylib`):
//!
//! ```
//! use rumple_plugin_sdk::prelude::*;
//!
//! parameters! {
//!     /// dc/dt = k σ⁺ (1 - c) - c/τ, lengths grow by 1 + g c.
//!     pub struct StretchActivated {
//!         k: 1e-3, "length/(force time)", "production", at_least(0.0);
//!         tau: 1.0, "time", "lifetime", above(0.0);
//!         g: 0.1, "1", "growth of lengths at c = 1", at_least(0.0);
//!     }
//! }
//!
//! impl Model for StretchActivated {
//!     const ABOUT: About = about!("org.example.stretch-activated", "Production under tension");
//!     const SPECIES: &'static [Species] =
//!         &[Species::new("c", "1", "activated fraction").range(0.0, 1.0)];
//!     const SIGNALS: &'static [Signal] = &[Signal::TENSION.typical(1e3)];
//!
//!     fn rates<S: Scalar>(&self, at: &Point<'_, S>, rate: &mut [S]) -> Result<(), Failure> {
//!         let (c, tension) = (at.species[0], at.signals[0]);
//!         rate[0] = tension.positive_part() * self.k * (S::one() - c) - c / self.tau;
//!         Ok(())
//!     }
//! }
//!
//! impl LengthFactor for StretchActivated {
//!     fn length_factor<S: Scalar>(&self, species: &[S]) -> Result<S, Failure> {
//!         Ok(species[0] * self.g + 1.0)
//!     }
//! }
//!
//! impl Observables for StretchActivated {
//!     const OBSERVABLES: &'static [Observable] =
//!         &[Observable::new("production", "1/time", "what tension makes")];
//!
//!     fn observe(&self, at: &Point<'_, f64>, out: &mut [f64]) -> Result<(), Failure> {
//!         out[0] = self.k * at.signals[0].max(0.0) * (1.0 - at.species[0]);
//!         Ok(())
//!     }
//! }
//!
//! export_plugin!(StretchActivated);
//! # fn main() {}
//! ```
//!
//! A law must be pure: same inputs, same outputs, from any thread. A panic is caught and reported
//! to the engine as a fatal error; build with the default `panic = "unwind"`.

mod block;
mod c_functions;
mod columns;
mod dual;
mod evaluate;
mod export;
mod guard;
mod law;
mod model;
mod scalar;

pub use dual::Dual;
pub use export::{Calls, Exported, Given, Probe, Without};
pub use model::{
    About, Failure, LengthFactor, LengthFactorAcross, Model, Observables, Parameters, Parametric,
    Point, SpontaneousCurvature,
};
pub use rumple_plugin_abi::Observables as ObservablesTable;
pub use rumple_plugin_abi::{Location, Observable, Parameter, Signal, Species};
pub use scalar::Scalar;

/// Everything that a plugin needs.
pub mod prelude {
    pub use crate::{
        About, Failure, LengthFactor, LengthFactorAcross, Location, Model, Observable, Observables,
        Parameter, Parameters, Parametric, Point, Scalar, Signal, Species, SpontaneousCurvature,
        about, export_plugin, parameters,
    };
}

/// Compiles the plugin of the project's front page.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;

/// Compiles the plugin of the guide.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/book/manual/plugins.md")]
struct Guide;
