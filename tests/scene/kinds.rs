//! Kinds registered from outside the engine, as any crate could. They are read, never run.

use rumple::effects::{Effect, EffectContext, EffectError, EffectSpec};
use rumple::num::checked::{AtLeast, Finite, Fraction, Positive};
use rumple::register_kind;
use rumple::solve::equilibrium::Equilibrium;
use rumple::solve::{EquilibriumSpec, Integrator, IntegratorSpec, SolveError};
use rumple::model::Mechanics;
use rumple::model::{PolicySpec, Storage};
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

#[typetag::serde(name = "test-spring")]
impl EffectSpec for Spring {
    fn name(&self) -> String {
        format!("spring {}", self.stiffness.get())
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        Ok(Effect::Pins(vec![[false; 3]; context.sheet.vertex_count()]))
    }
}
register_kind!(dyn EffectSpec, "test-spring", Spring);

#[derive(Debug, Serialize, Deserialize)]
pub struct Weightless;

#[typetag::serde(name = "test-weightless")]
impl EffectSpec for Weightless {
    fn name(&self) -> String {
        "weightless".to_owned()
    }

    fn build(&self, context: &EffectContext<'_>) -> Result<Effect, EffectError> {
        Ok(Effect::Pins(vec![[false; 3]; context.sheet.vertex_count()]))
    }
}
register_kind!(dyn EffectSpec, "test-weightless", Weightless);

#[derive(Debug, Serialize, Deserialize)]
pub struct Still;

#[typetag::serde(name = "test-still")]
impl PolicySpec for Still {
    fn name(&self) -> String {
        "still".to_owned()
    }

    fn storage(&self) -> Storage {
        Storage { mechanics: 0.0, chemistry: 0.0 }
    }
}
register_kind!(dyn PolicySpec, "test-still", Still);

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Leap {
    rtol: Positive,
    #[serde(default)]
    stages: Option<AtLeast<1>>,
}

#[typetag::serde(name = "test-leap")]
impl IntegratorSpec for Leap {
    fn name(&self) -> String {
        "leap".to_owned()
    }

    fn build(&self, _policy: Storage) -> Result<Box<dyn Integrator>, SolveError> {
        Err(SolveError::Pairing("only read".to_owned()))
    }
}
register_kind!(dyn IntegratorSpec, "test-leap", Leap);

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Descent {
    #[serde(default = "default_tolerance")]
    tolerance: Positive,
}

fn default_tolerance() -> Positive {
    Positive::new(1e-6).unwrap()
}

#[typetag::serde(name = "test-descent")]
impl EquilibriumSpec for Descent {
    fn name(&self) -> String {
        "descent".to_owned()
    }

    fn tolerance(&self) -> f64 {
        self.tolerance.get()
    }

    fn max_iterations(&self) -> usize {
        1
    }

    fn build(&self, _mechanics: &Mechanics) -> Result<Box<dyn Equilibrium>, SolveError> {
        Err(SolveError::Pairing("only read".to_owned()))
    }
}
register_kind!(dyn EquilibriumSpec, "test-descent", Descent);
