//! Scenes and keys that have no branch, with their place.

use super::key::OPTION;
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
    if let Some(term) = simulation.model().internal().first() {
        let message = "branches are those of elastic equilibria, and this effect changes the shape at rest with its history";
        return at(&effect_path(scene, term.name()), message, Some("leave it out"));
    }
    match continuation::check(simulation.model().mechanics()) {
        Err(SolveError::NotFollowed { effect, why }) => {
            let message =
                format!("branches of equilibria are not followed with this effect: {why}");
            let help = "of an effect volume with a stiffness in place of exact = true they are";
            at(&effect_path(scene, &effect), &message, (effect == "volume").then_some(help))
        }
        other => Ok(other?),
    }
}

/// The path of the effect that results call `name`, where several of one kind have a number behind it.
fn effect_path(scene: &Scene, name: &str) -> String {
    let kind = name.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end();
    let named = scene.effects.iter().position(|effect| [name, kind].contains(&&*effect.name()));
    named.map_or("effect".to_owned(), |k| format!("effect[{k}]"))
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
    let message = format!("{OPTION} {path}: {first} is an effect of the scene");
    let help = format!("did you mean effect.{path}?");
    Some(scene.error_at(&format!("effect[{number}]"), &message, Some(&help)).into())
}
