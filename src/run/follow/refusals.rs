//! Scenes and keys that have no branch, with their place.

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
    let setup = &simulation.setup;
    if !simulation.model().internal().is_empty() {
        let (path, name) = effect(scene, setup.owner(|effect| effect.internal, 0));
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
            let owner = energy.and_then(|k| setup.owner(|effect| effect.energies, k));
            let owner = owner.or_else(|| setup.owner(|effect| effect.constraints, constraint?));
            let (path, name) = effect(scene, owner);
            let message = format!("branches of equilibria are not followed with {name}: {why}");
            let help = "of an effect volume with a stiffness in place of exact = true they are";
            at(&path, &message, (name == "volume").then_some(help))
        }
        other => Ok(other?),
    }
}

/// Path and name of the effect of this number.
fn effect(scene: &Scene, number: Option<usize>) -> (String, String) {
    let named = number.and_then(|k| Some((format!("effect[{k}]"), scene.effects.get(k)?.name())));
    named.unwrap_or_else(|| ("effect".to_owned(), "an effect".to_owned()))
}

/// Tables and keys that say how a run is made, with what they do.
const OF_RUNS: [(&str, &str); 7] = [
    ("material.drag", "it says how fast a sheet moves, and not where it comes to rest"),
    ("time", "it says how far and in which steps a run goes"),
    ("equilibrium", "it says how equilibria are found"),
    ("output", "it says what is written"),
    ("stability", "it says when stability is judged"),
    ("checkpoint", "it says when the state of a run is stored"),
    ("invariants", "it says what is watched"),
];

/// The option that names it, as errors say.
pub(super) const OPTION_NAME: &str = "--along";

/// Refuses the key at `target` if it is one of those.
///
/// # Errors
/// What it says, in place of changing equilibria.
pub(super) fn check_key(scene: &Scene, target: &str) -> Result<(), Error> {
    let inside = |table: &str| target.strip_prefix(table).is_some_and(is_inside_or_all);
    match OF_RUNS.iter().find(|(table, _)| inside(table)) {
        Some((_, why)) => Err(without_effect(scene, target, why)),
        None => Ok(()),
    }
}

fn is_inside_or_all(rest: &str) -> bool {
    rest.is_empty() || rest.starts_with(['.', '['])
}

/// That no equilibrium depends on the key at `target`, and why.
pub(super) fn without_effect(scene: &Scene, target: &str, why: &str) -> Error {
    let message = format!("equilibria do not depend on this key: {why}");
    scene.error_at(target, &message, Some(HELP)).into()
}

/// What equilibria depend on.
const HELP: &str = "a branch is followed along a load, a modulus, a displacement of pins, a parameter of a law, or along the \
                    time of ramps and growth";

/// That `path` is not a key because it begins with the kind of an effect, if it does.
pub(super) fn misplaced(scene: &Scene, path: &str) -> Option<Error> {
    let first = path.split(['.', '[']).next()?;
    let number = scene.effects.iter().position(|effect| effect.name() == first)?;
    let message = format!("{OPTION_NAME} {path}: {first} is an effect of the scene");
    let help = format!("did you mean effect.{path}?");
    Some(scene.error_at(&format!("effect[{number}]"), &message, Some(&help)).into())
}
