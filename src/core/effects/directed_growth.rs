//! Growth of a law along a fibre: its length factor Φ acts with a direction.
//!
//! ```text
//! Φ_ij² = Φ² cos² θ + Φ_⊥² sin² θ,     θ the angle between the edge and the fibre at rest
//! Φ_⊥ = Φ^p                            of a law with one length factor
//! ```
//!
//! with p the exponent `across`: 0, the default, is growth along the fibre alone, 1 in all directions, -1 growth that keeps
//! the area. A law may give Φ_⊥ itself, `length_factor_across`; p is then left out. Φ at an edge is what the law gives for the means of the species at its ends. Other growth multiplies it.
//! Without a law that has a length factor there is nothing to direct, and the scene is refused.
//!
//! The lengths are those of the metric `Φ² a⊗a + Φ_⊥² (1 - a⊗a)` (`growth.rs`).

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::field::named;
use super::{DirectedLengthFactor, Effect, EffectContext, EffectError, EffectSpec, Fibre, Needs};
use crate::num::checked::Finite;

/// Parameters in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LawGrowthDirectionSpec {
    /// The direction.
    pub fibre: Fibre,
    /// The exponent p of growth across it; 0 without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub across: Option<Finite>,
}

#[typetag::serialize(name = "directed-growth")]
impl EffectSpec for LawGrowthDirectionSpec {
    fn needs(&self) -> Needs {
        Needs { species: true, ..Needs::default() }
    }

    fn files(&self) -> Vec<(&'static str, &Path)> {
        named([("fibre.file", self.fibre.file())])
    }

    fn resolve_paths_against(&mut self, folder: &Path) {
        self.fibre.resolve_path_against(folder);
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        let grows = context.kinetics.is_some_and(|(law, _)| law.capabilities.length_factor);
        if !grows {
            return Err(EffectError {
                key: "kind",
                message: "the law of this scene has no length factor to direct".into(),
                help: Some(
                    "give [kinetics] a length_factor; growth by a formula has keys along and across itself".into(),
                ),
            });
        }
        let refuse = |message: String, help: &str| {
            Err(EffectError { key: "across", message, help: Some(help.into()) })
        };
        if context.kinetics.is_some_and(|(law, _)| law.capabilities.length_factor_across)
            && self.across.is_some()
        {
            let message = "the law gives a length factor across the fibre itself".into();
            return refuse(message, "leave across out, or length_factor_across of [kinetics]");
        }
        let across = self.across.map_or(0.0, Finite::get);
        let cos_squared = self.fibre.cos_squared_of_edges(context)?;
        let direction = DirectedLengthFactor { cos_squared, across };
        Ok(Effect { direction: Some(direction), ..Effect::default() })
    }
}

crate::register_kind!(dyn EffectSpec, "directed-growth", LawGrowthDirectionSpec);
