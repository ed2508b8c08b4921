//! Thin elastic sheets whose shape and chemistry drive one another.
//!
//! A sheet is a triangle mesh with rest positions `X_i` and current positions `x_i`; chemistry is
//! a set of species carried on its material points. One coupled system is solved,
//!
//! ```text
//! drag · dx/dt = -∂U/∂x (x; c) + other forces          (mechanics)
//!        dc/dt = D Δ_x c + R(c, signals(x, c), t)      (chemistry)
//! ```
//!
//! where the energy `U` is the sum of the effects that a scene lists and the kinetics `R` come
//! from a plugin. Data flows one way: [`scene`] → [`model`] → [`solve`] → trial state → evaluation →
//! [`effects`] and [`kinetics`] → accepted state → [`output`].

pub mod cli;
mod document;
pub mod effects;
pub mod kit;
pub mod model;
pub mod registry;
pub mod run;
pub mod scene;
pub mod solve;
pub mod study;

#[doc(inline)]
pub use rumple_geometry as geometry;
#[doc(inline)]
pub use rumple_kinetics as kinetics;
#[doc(inline)]
pub use rumple_output as output;
#[doc(inline)]
pub use rumple_sheet as sheet;

pub use rumple_numerics::{Vec3, checked_number, num, tally};
pub use run::{Error, Result, Simulation};

pub(crate) use rumple_numerics::{linear, ode, parallel};
