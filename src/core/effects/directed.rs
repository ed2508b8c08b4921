//! Growth of a law along a fibre: its length factor Φ acts with a direction.
//!
//! ```text
//! Φ_ij² = Φ² cos² θ + Φ^(2p) sin² θ,     θ the angle between the edge and the fibre at rest
//! ```
//!
//! with p the exponent `across`: 0, the default, is growth along the fibre alone, 1 in all directions, -1 growth that keeps
//! the area. Φ at an edge is what the law gives for the means of the species at its ends. Other growth multiplies it.
//! Without a law that has a length factor there is nothing to direct, and the scene is refused.
//!
//! The lengths are those of the metric `Φ² a⊗a + Φ^(2p) (1 - a⊗a)` (`growth.rs`).

use serde::{Deserialize, Serialize};

use super::{Effect, EffectContext, EffectError, EffectSpec, Fibre, Needs};

/// Parameters in a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DirectedGrowth {
    /// The direction, three numbers or formulas of `x`, `y` and `z`.
    pub fibre: Fibre,
    /// The exponent p of growth across it.
    #[serde(default)]
    pub across: f64,
}

#[typetag::serialize(name = "directed-growth")]
impl EffectSpec for DirectedGrowth {
    fn needs(&self) -> Needs {
        Needs { species: true, ..Needs::default() }
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
        if !self.across.is_finite() {
            let message = format!("the exponent is {}", self.across);
            return Err(EffectError {
                key: "across",
                message,
                help: Some("a finite number".into()),
            });
        }
        let square = self.fibre.along_edges(context.sheet)?;
        let direction = Direction { square, across: self.across };
        Ok(Effect { direction: Some(direction), ..Effect::default() })
    }
}

crate::register_kind!(dyn EffectSpec, "directed-growth", DirectedGrowth);

/// How the length factor of a law acts at every edge.
#[derive(Debug, Clone)]
pub struct Direction {
    /// cos² θ.
    square: Vec<f64>,
    /// p.
    across: f64,
}

impl Direction {
    /// The factor of an edge at which the law has `factor`, and its derivative by that.
    #[must_use]
    #[inline]
    pub fn at(&self, edge: usize, factor: f64) -> (f64, f64) {
        let (square, p) = (self.square[edge], self.across);
        let across = factor.powf(p);
        let all = (factor * factor * square + across * across * (1.0 - square)).sqrt();
        let slope = factor * square + p * across * across / factor * (1.0 - square);
        (all, slope / all)
    }
}
