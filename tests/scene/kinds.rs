//! Kinds registered from outside the engine, as any crate could. They are read, never run.

use rumple::effects::{Effect, EffectContext, EffectError, EffectSpec};
use rumple::num::checked::{Finite, Fraction, Positive};
use rumple::register_kind;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weight {
    #[default]
    OptimalArea,
    Paper,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spring {
    stiffness: Positive,
    #[serde(default)]
    weight: Weight,
    share: Option<Fraction>,
    #[serde(default)]
    anchors: Vec<[Finite; 3]>,
}

#[typetag::serialize(name = "test-spring")]
impl EffectSpec for Spring {
    fn name(&self) -> String {
        format!("spring {}", self.stiffness.get())
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        Ok(Effect::pins(vec![[false; 3]; context.sheet.vertex_count()]))
    }
}
register_kind!(dyn EffectSpec, "test-spring", Spring);

#[derive(Debug, Serialize, Deserialize)]
pub struct Weightless;

#[typetag::serialize(name = "test-weightless")]
impl EffectSpec for Weightless {
    fn name(&self) -> String {
        "weightless".to_owned()
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        Ok(Effect::pins(vec![[false; 3]; context.sheet.vertex_count()]))
    }
}
register_kind!(dyn EffectSpec, "test-weightless", Weightless);
