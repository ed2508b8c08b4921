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
//! from a plugin. Data flows one way: [`scene`] → [`system`] → [`solve`] → [`state`] → [`effects`]
//! → accepted state → [`output`].

pub mod cli;
pub mod effects;
pub mod error;
pub mod geometry;
mod growing;
pub mod kinetics;
pub mod num;
pub mod output;
pub mod parallel;
pub mod scene;
pub mod sheet;
pub mod simulation;
pub mod solve;
pub mod state;
pub mod system;
pub mod timescale;

pub use error::{Error, Result};

/// A point or vector in space, in units of length unless said otherwise.
pub type Vec3 = nalgebra::Vector3<f64>;
