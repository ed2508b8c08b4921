//! Stretching: parameters of the effect, and its discrete models.
//!
//! At ν = 1/3 both models have the same second derivatives in the flat rest state of an equilateral
//! lattice: that of a sheet with two-dimensional Young's modulus Y.

mod bond;
mod stvk;

pub use bond::{BondStretching, StretchingWeight};
pub use stvk::{StretchingModulus, StvkStretching};

use serde::{Deserialize, Serialize};

use super::{
    Effect, EffectContext, EffectError, EffectSpec, Material, Needs, SceneSummary, misplaced,
};

/// Parameters of stretching in a scene.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "Given", into = "Given")]
pub struct Stretching {
    /// The discrete model.
    pub model: StretchingModel,
    /// The weight of a bond; only `model = "bond"` has it.
    pub weight: StretchingWeight,
    /// The two-dimensional Young's modulus; only `model = "stvk"` has it.
    pub modulus: StretchingModulus,
    #[serde(skip)]
    misplaced: Option<&'static str>,
}

/// The keys as they are written.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Given {
    #[serde(default)]
    model: StretchingModel,
    #[serde(skip_serializing_if = "Option::is_none")]
    weight: Option<StretchingWeight>,
    #[serde(skip_serializing_if = "Option::is_none")]
    modulus: Option<StretchingModulus>,
}

impl From<Given> for Stretching {
    fn from(given: Given) -> Self {
        let misplaced = match given.model {
            StretchingModel::Bond => given.modulus.map(|_| "modulus"),
            StretchingModel::Stvk => given.weight.map(|_| "weight"),
        };
        Self {
            model: given.model,
            weight: given.weight.unwrap_or_default(),
            modulus: given.modulus.unwrap_or_default(),
            misplaced,
        }
    }
}

impl From<Stretching> for Given {
    fn from(it: Stretching) -> Self {
        let bond = it.model == StretchingModel::Bond;
        Self {
            model: it.model,
            weight: bond.then_some(it.weight),
            modulus: (!bond).then_some(it.modulus),
        }
    }
}

#[typetag::serialize(name = "stretching")]
impl EffectSpec for Stretching {
    fn needs(&self) -> Needs {
        Needs { material: true, ..Needs::default() }
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        match (self.misplaced, self.model) {
            (Some(key @ "weight"), _) => {
                Err(misplaced(key, "stvk", "is a constant-strain triangle, not a bond", "bond"))
            }
            (Some(key), _) => Err(misplaced(key, "bond", "always has Y = E h/(1-ν²)", "stvk")),
            (None, StretchingModel::Bond) => {
                Ok(Effect::energy(BondStretching::new(context.elasticity()?, self.weight)))
            }
            (None, StretchingModel::Stvk) => {
                Ok(Effect::energy(StvkStretching::new(context.elasticity()?, self.modulus)))
            }
        }
    }

    fn notes(&self, context: &EffectContext<'_>, _: &SceneSummary<'_>) -> Vec<String> {
        let Some(Material { poisson, .. }) = context.material else { return Vec::new() };
        if self.model == StretchingModel::Stvk || (poisson - 1.0 / 3.0).abs() < NEAR_A_THIRD {
            return Vec::new();
        }
        vec![format!(
            "bonds stretch with ν = 1/3 whatever material.poisson = {poisson} says, which enters \
             only Y and B; model = \"stvk\" has any ν"
        )]
    }
}

/// 0.33 is meant to be a third.
const NEAR_A_THIRD: f64 = 5e-3;

crate::register_kind!(dyn EffectSpec, "stretching", Stretching);

/// Discrete models of stretching.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StretchingModel {
    /// Springs along the edges.
    #[default]
    Bond,
    /// Constant-strain triangles of a Saint Venant-Kirchhoff material, any ν.
    Stvk,
}
