//! The algebra that Rumple stands on; it knows no sheet and no physics.
//!
//! * [`num`]: conversions of numbers, and numbers checked where they are read;
//! * [`parallel`]: loops and sums that give the same bits on any number of threads;
//! * [`linear`]: sparse matrices of 3×3 blocks, their factors, multigrid, Krylov methods;
//! * [`tally`]: what work costs, counted;
//! * [`ode`]: implicit integrators of `M dy/dt = F(t, y)`; the one room that knows diffsol;
//! * [`reduction`]: sums, maxima and decisions over the whole sheet;
//! * [`record`]: what solvers remember, as bytes and back.
//!
//! A crate of its own, so that the instances of the generic libraries below are compiled once and
//! not with every change of an effect.

pub mod linear;
pub mod num;
pub mod ode;
pub mod parallel;
pub mod record;
pub mod reduction;
pub mod tally;

/// A point or vector in space, in units of length unless said otherwise.
pub type Vec3 = nalgebra::Vector3<f64>;
