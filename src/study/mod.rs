//! Many runs, and what they say together.

pub mod accuracy;
pub mod choice;
pub mod compare;
mod differences;
mod measures;
mod pictures;
pub mod states;
pub mod sweep;
mod tables;

pub use differences::{Difference, Differences, Norm};
pub use measures::{Measures, measure};
