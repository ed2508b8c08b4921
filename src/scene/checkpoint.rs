//! `[checkpoint]`: when a run writes all state that a resumed run needs.

use serde::{Deserialize, Serialize};

use crate::num::checked::{AtLeast, Positive};

/// The table `[checkpoint]`; without it a run that takes long has checkpoints by the defaults of `wall` and
/// `keep`, the first one after a minute.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CheckpointSpec {
    /// A checkpoint with the first step that reaches every multiple of this time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every: Option<Positive>,
    /// A checkpoint every so many seconds of wall time; longer where writing one takes more than a hundredth
    /// of that.
    pub wall: Positive,
    /// How many are kept; the last one but one serves where the last one is damaged.
    pub keep: AtLeast<1>,
}

impl Default for CheckpointSpec {
    fn default() -> Self {
        Self {
            every: None,
            wall: const { Positive::constant(600.0) },
            keep: const { AtLeast::constant(2) },
        }
    }
}
