//! The engine of Rumple: thin elastic sheets whose shape and chemistry drive one another.
//!
//! Data flows one way: [`effects`] and laws ([`kinetics`]) on a [`sheet`] make a [`model`], which [`solve`]
//! steps and relaxes. The crate reads and writes no files, prints nothing, reads no environment and handles no signals:
//! scenes, runs, studies and the program are built on it (crate `rumple`). What a caller is asked for while it works
//! (interruption, progress) goes through [`solve::Control`].

pub mod document;
pub mod effects;
pub mod kit;
pub mod model;
pub mod problem;
pub mod registry;
pub mod solve;
pub mod stepper;

#[doc(inline)]
pub use rumple_geometry as geometry;
#[doc(inline)]
pub use rumple_kinetics as kinetics;
#[doc(inline)]
pub use rumple_sheet as sheet;

pub use problem::Problem;
pub use stepper::{Breakpoints, Stepper};

pub use rumple_numerics::{Vec3, checked_number, num, record, reduction, tally};

pub use rumple_numerics::linear;

pub(crate) use rumple_numerics::{ode, parallel};
