//! Integration tests, one binary.
//!
//! * `chebyshev`: the stabilised explicit integrator.
//! * `diffusion`: decay of known modes, conservation, convergence, the Green-Gauss scheme.
//! * `examples`: the numbered examples.
//! * `house`: who may know whom.
//! * `mechanics`: energies, gradients and Hessians against differences, invariants, known answers.
//! * `output`: frames, series, ledger, provenance, result directories, progress.
//! * `plugins`: the C boundary with good and faulty plugins; the shipped models.
//! * `run`: coupled runs, `inspect`, and the program from the outside.
//! * `scene`: what is accepted, what is refused and how that is said.
//! * `sheet`: generated meshes, their quality and topology; readers; checks.

#![allow(missing_docs, clippy::cast_precision_loss)]

mod common;
mod examples;
mod house;
mod mechanics;
mod output;
mod plugins;
mod run;
mod scene;
mod sheet;
