//! Bending: parameters of the effect, and its discrete models.

mod meyer;

pub use meyer::MeyerBending;

use serde::{Deserialize, Serialize};

use super::{Effect, EffectContext, EffectError, EffectSpec};
use crate::geometry::AreaRule;

/// Parameters of bending in a scene.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bending {
    /// The discrete model.
    #[serde(default)]
    pub model: BendingModel,
    /// Whether the sum over vertices carries their areas.
    #[serde(default)]
    pub weight: BendingWeight,
    /// The area of a vertex.
    #[serde(default)]
    pub area: AreaRule,
}

#[typetag::serde(name = "bending")]
impl EffectSpec for Bending {
    fn name(&self) -> String {
        "bending".into()
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let BendingModel::Meyer = self.model;
        let energy = MeyerBending::new(context.sheet, context.material, self.weight, self.area);
        Ok(Effect::Energy(Box::new(energy)))
    }
}

crate::register_kind!(dyn EffectSpec, "bending", Bending);

/// Discrete models of bending.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BendingModel {
    /// Cotangent mean curvature at the vertices (the paper's).
    #[default]
    Meyer,
}

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
