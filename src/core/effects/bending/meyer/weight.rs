//! Weight of a vertex in the bending energy.

use serde::{Deserialize, Serialize};

/// Weight of a vertex in the bending energy.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BendingWeight {
    /// Its area, so that the sum is an integral.
    #[default]
    Area,
    /// 1, as printed in the paper: a sum of energy densities.
    Paper,
}
