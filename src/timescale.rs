//! Timescale policies: which of the two time derivatives is kept.
//!
//! ```text
//! w_x · drag · dx/dt = -∂U/∂x          w_c · dc/dt = D Δ_x c + R
//!
//! quasi-static     (0, 1)    the shape follows the chemistry at once
//! simultaneous     (1, 1)    both take their time
//! chemistry-fast   (1, 0)    the chemistry follows the shape at once
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

macro_rules! policy {
    ($(#[$doc:meta])* $type:ident, $name:literal, $mechanics:literal, $chemistry:literal) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $type {}

        #[typetag::serde(name = $name)]
        impl PolicySpec for $type {
            fn name(&self) -> String {
                $name.into()
            }

            fn storage(&self) -> Storage {
                Storage { mechanics: $mechanics, chemistry: $chemistry }
            }
        }

        crate::register_kind!(dyn PolicySpec, $name, $type);
    };
}

policy!(
    /// Mechanics without storage: equilibrium at every time.
    QuasiStatic,
    "quasi-static",
    0.0,
    1.0
);
policy!(
    /// Both rows keep their derivatives.
    Simultaneous,
    "simultaneous",
    1.0,
    1.0
);
policy!(
    /// Chemistry without storage: steady at every time.
    ChemistryFast,
    "chemistry-fast",
    1.0,
    0.0
);
