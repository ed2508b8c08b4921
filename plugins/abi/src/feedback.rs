//! The extension `rumple.feedback/1`: what species do to the sheet besides the length factor.
//!
//! ```text
//! C₀(c)      spontaneous curvature of bending, 1/length, of either sign
//! Φ⊥(c) > 0  length factor across a fibre
//! ```
//!
//! A plugin answers only for what its capabilities declare. Functions get batches without signals, as those of the length
//! factor do, and write one column.

use crate::call::{Evaluate, EvaluatePartials};

/// The id to give to [`GetExtension`](crate::GetExtension); it answers with a [`Feedback`].
pub const FEEDBACK: &str = "rumple.feedback/1";

/// What a plugin answers to [`FEEDBACK`].
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Feedback {
    /// Bytes of this structure.
    pub size: usize,
    /// C₀. Required with [`SPONTANEOUS_CURVATURE`](crate::Capabilities::SPONTANEOUS_CURVATURE), else null.
    pub curvature: Evaluate,
    /// C₀ and ∂C₀/∂c. May be null: the engine takes differences.
    pub curvature_partials: EvaluatePartials,
    /// Φ⊥. Required with [`LENGTH_FACTOR_ACROSS`](crate::Capabilities::LENGTH_FACTOR_ACROSS), else null.
    pub length_factor_across: Evaluate,
    /// Φ⊥ and ∂Φ⊥/∂c. May be null: the engine takes differences.
    pub length_factor_across_partials: EvaluatePartials,
}
