//! Binds the effects of a scene to its sheet, and accounts for what they cost.

use super::Result;
use super::scale_checks::{check_load, check_transport};
use super::setup_cost::SetupCost;
use crate::effects::{Effect, EffectContext, EffectSpec};
use crate::problem::{Part, Problem, ProblemError};
use crate::scene::Scene;
use crate::{Error, Stepper};

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

/// `error` at its place in `scene`.
pub(super) fn placed(scene: &Scene, error: &ProblemError) -> Error {
    let ProblemError { part, message, help } = error;
    let at = |path: &str| scene.error_at(path, message, help.as_deref());
    let error = match part {
        Part::Material => scene.missing_table("material", message),
        Part::Effects => at("effect"),
        Part::Effect(number, key) if key.is_empty() => at(&format!("effect[{number}]")),
        Part::Effect(number, key) => at(&format!("effect[{number}].{key}")),
        Part::Sheet => at("sheet"),
        Part::Planar => at("sheet.planar"),
        Part::Law => at("kinetics"),
        Part::Integrator => at("time.integrator"),
        Part::Drag => at("material.drag"),
        Part::Equilibrium => at("equilibrium"),
    };
    error.into()
}
