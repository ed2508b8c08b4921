//! `[material]`: the elastic constants of the sheet and its drag.

use serde::{Deserialize, Serialize};

use super::DragSpec;
use crate::checked_number;
use crate::effects::Field;
use crate::num::checked::Positive;

checked_number!(
    PoissonRatio,
    "Poisson's ratio ν of a stable isotropic material, -1 < ν ≤ 1/2.",
    "a number above -1 and up to 0.5",
    |x| x > -1.0 && x <= 0.5
);

/// The table `[material]`.
///
/// The 2-D modulus is Y = E h/(1-ν²), the bending rigidity B = E h³/(12(1-ν²)). E, ν and h are fields over the triangles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Young's modulus E, force per area.
    pub young: Field<Positive>,
    /// Poisson's ratio ν. A lattice of bonds has ν = 1/3 whatever stands here; in Y and B this
    /// value enters.
    pub poisson: Field<PoissonRatio>,
    /// Thickness h, length.
    pub thickness: Field<Positive>,
    /// What resists the motion of the sheet.
    #[serde(default)]
    pub drag: DragSpec,
}
