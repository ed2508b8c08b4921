//! `[stability]`: whether a run watches the stability of its equilibria, and what it does about it.

use serde::{Deserialize, Serialize};

use crate::num::checked::{AtLeast, Positive};

/// The table `[stability]`; without it nothing is watched and nothing is paid.
///
/// After every accepted step the negative-curvature modes are counted by one sparse
/// factorisation, which costs about as much as one factorisation of the relaxation. Modes are only
/// computed at events.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StabilitySpec {
    /// Whether to watch at all.
    pub watch: bool,
    /// Modes written with every event.
    pub modes: AtLeast<1>,
    /// Leave a saddle: displace the sheet along its softest mode by this much where it moves most
    /// (length), and relax again. Without it a saddle is reported and kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub perturb: Option<Positive>,
}

impl Default for StabilitySpec {
    fn default() -> Self {
        Self { watch: true, modes: AtLeast::LEAST, perturb: None }
    }
}
