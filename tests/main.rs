//! Integration tests, one binary.
//!
//! * `mechanics`: energies, gradients and Hessians against differences, invariants, known answers.
//! * `output`: frames, series, ledger, provenance, result directories, progress.
//! * `sheet`: generated meshes, their quality and topology; readers; checks.

#![allow(missing_docs, clippy::cast_precision_loss)]

mod common;
mod mechanics;
mod output;
mod sheet;
