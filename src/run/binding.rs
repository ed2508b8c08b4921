//! Binds the effects of a scene to its sheet, and accounts for what they cost.

use super::Result;
use super::prepare::placed;
use super::scale_checks::{check_load, check_transport};
use super::setup_cost::SetupCost;
use crate::Stepper;
use crate::effects::{Effect, EffectContext, EffectSpec};
use crate::problem::Problem;
use crate::scene::Scene;

/// The stepper of `problem`, which `scene` states; counts in `setup` what its effects cost.
///
/// # Errors
/// What does not fit, with its place in the scene.
pub(super) fn stepper(
    scene: &Scene,
    problem: &Problem<'_>,
    setup: &mut SetupCost,
    notes: &mut Vec<String>,
) -> Result<Stepper> {
    setup.begin_effect();
    let mut on_effect =
        |number: usize, spec: &dyn EffectSpec, context: &EffectContext<'_>, effect: &Effect| {
            setup.end_effect(effect);
            let said = spec.notes(context).into_iter();
            notes.extend(said.map(|said| format!("effect[{number}] ({}): {said}", spec.name())));
            for term in &effect.energies {
                check_load(number, term, context.material)?;
            }
            for transport in &effect.transports {
                check_transport(number, transport, context.sheet)?;
            }
            setup.begin_effect();
            Ok(())
        };
    problem.stepper_with(&mut on_effect).map_err(|error| placed(scene, &error))
}
