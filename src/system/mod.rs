//! The coupled system of a scene: effects, kinetics and policy put together.

mod mechanics;

pub use mechanics::{Mechanics, Pins};
