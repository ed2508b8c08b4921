//! Integration tests, one binary.
//!
//! * `mechanics`: energies, gradients and Hessians against differences, invariants, known answers.

#![allow(missing_docs, clippy::cast_precision_loss)]

mod common;
mod mechanics;
