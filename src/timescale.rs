//! Timescale policies: which of the two time derivatives is kept.
//!
//! ```text
//! w_x · drag · dx/dt = -∂U/∂x          w_c · dc/dt = D Δ_x c + R
//!
//! quasi-static     (0, 1)    the shape follows the chemistry at once
//! ```
//!
//! A policy is nothing but this pair of weights; effects never learn which one runs.

use serde::{Deserialize, Serialize};

/// The policy of a scene that names none.
pub const DEFAULT_POLICY: &str = "quasi-static";

/// Weights of the two rows of the mass matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Storage {
    /// `w_x`, multiplies the drag.
    pub mechanics: f64,
    /// `w_c`.
    pub chemistry: f64,
}

/// A timescale policy as a scene names it.
#[typetag::serde(tag = "kind")]
pub trait PolicySpec: std::fmt::Debug + Send + Sync {
    /// What the policy is called in results.
    fn name(&self) -> String;

    /// Its two weights.
    fn storage(&self) -> Storage;
}

/// Mechanics without storage: equilibrium at every time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct QuasiStatic {}

#[typetag::serde(name = "quasi-static")]
impl PolicySpec for QuasiStatic {
    fn name(&self) -> String {
        "quasi-static".into()
    }

    fn storage(&self) -> Storage {
        Storage { mechanics: 0.0, chemistry: 1.0 }
    }
}

crate::register_kind!(dyn PolicySpec, "quasi-static", QuasiStatic);
