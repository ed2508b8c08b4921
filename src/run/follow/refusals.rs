//! Scenes and keys that have no branch, with their place.

use crate::effects::EffectParts;
use crate::run::{Error, Simulation};
use crate::scene::Scene;
use crate::solve::{SolveError, continuation};

/// Refuses a scene whose equilibria are not followed.
///
/// # Errors
/// What hinders it, with its place.
pub(super) fn check_scene(scene: &Scene, simulation: &Simulation) -> Result<(), Error> {
    let at = |path: &str, message: &str, help: Option<&str>| -> Result<(), Error> {
        Err(scene.error_at(path, message, help).into())
    };
    if !simulation.model().moves() && scene.kinetics.is_empty() {
        return at("effect", "no effect has an energy: every shape is an equilibrium", None);
    }
    if !simulation.sheet().reduction().periods().is_empty() {
        let message = "branches of equilibria are not followed on a periodic sheet";
        let help =
            "leave it out, for a rectangle of several waves; or run the scene with [stability]";
        return at("sheet.periodic", message, Some(help));
    }
    // The effect that contributed part `k` of those counted by `of`.
    let owner = |of: fn(&EffectParts) -> usize, k: usize| {
        let mut count = 0;
        simulation.effects.iter().position(|parts| {
            count += of(parts);
            count > k
        })
    };
    if !simulation.model().internal().is_empty() {
        let (path, name) = effect(scene, owner(|effect| effect.internal, 0));
        let message = format!(
            "branches are those of elastic equilibria, and {name} changes the shape at rest with its history"
        );
        return at(&path, &message, Some("leave it out"));
    }
    let mechanics = simulation.model().mechanics();
    match continuation::check(mechanics) {
        Err(SolveError::NotFollowed { effect: refused, why }) => {
            let energy = mechanics.names().position(|name| name == refused);
            let constraint = mechanics.constraint_names().position(|name| name == refused);
            let number = energy.and_then(|k| owner(|effect| effect.energies, k));
            let number = number.or_else(|| owner(|effect| effect.constraints, constraint?));
            let (path, name) = effect(scene, number);
            let message = format!("branches of equilibria are not followed with {name}: {why}");
            let help = "give it a stiffness in place of exact = true";
            at(&path, &message, constraint.map(|_| help))
        }
        other => Ok(other?),
    }
}

/// Path and name of the effect of this number.
fn effect(scene: &Scene, number: Option<usize>) -> (String, String) {
    let named = number.and_then(|k| Some((format!("effect[{k}]"), scene.effects.get(k)?.name())));
    named.unwrap_or_else(|| ("effect".to_owned(), "an effect".to_owned()))
}

/// The option that names the key, as errors say.
pub(super) const OPTION_NAME: &str = "--along";

/// That no equilibrium depends on the key at `target`.
pub(super) fn without_effect(scene: &Scene, target: &str) -> Error {
    let message =
        "equilibria do not depend on this key: no force, no pin and no rate depends on it";
    scene.error_at(target, message, Some(HELP)).into()
}

/// What equilibria depend on.
const HELP: &str = "a branch is followed along a load, a modulus, a displacement of pins, a parameter of a law, or along the \
                    time of ramps and growth";
