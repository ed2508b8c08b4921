//! Integration tests, one binary.
//!
//! * `chebyshev`: order, stability, error control and failures of the stabilised integrator.
//! * `diffusion`: decay rates, order, conservation, maximum principle; faults of the paper's scheme.
//! * `mechanics`: energies, gradients and Hessians against differences, invariants, known answers.
//! * `output`: frames, series, ledger, provenance, result directories, progress.
//! * `sheet`: generated meshes, their quality and topology; readers; checks.

#![allow(missing_docs, clippy::cast_precision_loss)]

mod chebyshev;
mod common;
mod diffusion;
mod mechanics;
mod output;
mod sheet;
