//! One sheet over many ranks: the communicator of MPI, and linear solvers of PETSc.
//!
//! * `world`: all ranks of the program, as [`rumple_numerics::reduction::Communicator`];
//! * `equilibrium.preconditioner = "gamg"` or `"mumps"` in a scene: `distributed`.
//!
//! Empty without the feature `mpi`, which needs MPI and PETSc.
#![cfg(feature = "mpi")]

pub mod distributed;
mod petsc;
mod world;

pub use world::{World, end, is_launched, world};
