//! Many runs, and what they say together.

pub mod compare;
mod differences;
mod measures;
mod pictures;
pub mod sweep;

pub use differences::{Difference, Differences, differences};
pub use measures::{Measures, measure};
