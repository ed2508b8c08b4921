//! The key of a scene along which a branch is followed: a number that is not of the sheet.

use std::path::Path;

use toml::Value;

use super::refusals;
use crate::run::follow::refusals::OPTION_NAME;
use crate::run::{Error, Result};
use crate::scene::{Scene, path_to};

/// A number of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    /// Its path as the user gives it.
    pub path: String,
    /// The same with list elements by their numbers.
    pub target: String,
    /// Its value in the scene, if that has one.
    pub value: Option<f64>,
    /// Whether it is the time at which ramps and growth are evaluated, in place of a key.
    pub is_time: bool,
}

/// The time, as a parameter.
const TIME_KEY: &str = "time";

impl Key {
    /// The override that sets it to `value`; none of the time.
    pub(super) fn set(&self, value: f64) -> Vec<String> {
        let set = (!self.is_time).then(|| format!("{}={value:?}", self.path));
        set.into_iter().collect()
    }

    /// The key `path` of the scene file `file` after the overrides `set`; `value` is one that it is to take.
    ///
    /// # Errors
    /// A key that the scene cannot have, one that is not a number, and one of the sheet; each with what is meant.
    pub(super) fn read(file: &Path, set: &[String], path: &str, value: f64) -> Result<Self> {
        if path.contains('=') {
            let message = format!(
                "{OPTION_NAME} {path}: expected a key alone, as material.thickness; --from and --to give its values"
            );
            return Err(Error::Refused(message));
        }
        let target = path.to_owned();
        let mut key =
            Self { path: path.to_owned(), target, value: None, is_time: path == TIME_KEY };
        if key.is_time {
            return Ok(Self { value: Some(0.0), ..key });
        }
        let scene = Scene::load(file, set)?;
        if let Some(error) = refusals::misplaced(&scene, path) {
            return Err(error);
        }
        let over = key.set(value);
        let target =
            Scene::overridden_keys_by(file, set, &over, OPTION_NAME)?.pop().unwrap_or_default();
        if target == "sheet" || target.starts_with("sheet.") {
            let message = "it makes another mesh or another start, and a branch is one of equilibria on one mesh";
            let help = "rumple sweep runs the scene over such a key";
            return Err(scene.error_at(&target, message, Some(help)).into());
        }
        refusals::check_key(&scene, &target)?;
        key.target.clone_from(&target);
        let found = leaves(&scene)?;
        let own = found.iter().find(|(path, _)| *path == target);
        match own {
            Some((_, Value::Float(value))) => key.value = Some(*value),
            Some((_, other)) => {
                return Err(not_a_number(&scene, &target, &describe(other), &found));
            }
            None => {
                let inside = |path: &str| path.strip_prefix(&target).is_some_and(is_inside);
                if found.iter().any(|(path, _)| inside(path)) {
                    return Err(not_a_number(&scene, &target, "a table or a list", &found));
                }
                // A key that the scene can have, and leaves out; or one that it cannot have.
                Scene::varied_by(file, set, &over, OPTION_NAME)?;
            }
        }
        Ok(key)
    }
}

/// Whether a path continues into a part of its prefix.
fn is_inside(rest: &str) -> bool {
    rest.starts_with(['.', '['])
}

fn describe(value: &Value) -> String {
    match value {
        Value::Integer(value) => {
            format!("{value}, a whole number that cannot change little by little")
        }
        Value::String(text) => format!("the text {text:?}"),
        other => format!("{other}"),
    }
}

/// That `target` is `what` and not a number, with those that there are.
fn not_a_number(scene: &Scene, target: &str, what: &str, found: &[(String, Value)]) -> Error {
    let numbers = found.iter().filter(|(path, value)| value.is_float() && is_usual(path));
    let numbers: Vec<&str> = numbers.map(|(path, _)| path.as_str()).collect();
    let within = |path: &&&str| path.strip_prefix(target).is_some_and(is_inside);
    let nearest = numbers.iter().find(within).copied();
    let help = match nearest {
        Some(part) => format!("name one of its numbers, as {part}"),
        None => format!("numbers of material and effects: {}", numbers.join(", ")),
    };
    let message = format!("it is {what}; a branch is followed along a number");
    scene.error_at(target, &message, Some(&help)).into()
}

/// Whether a path is one that branches are followed along: of the material or of an effect, and not of a region.
fn is_usual(path: &str) -> bool {
    (path.starts_with("material.") || path.starts_with("effect[")) && !path.contains(".where.")
}

/// Every value of `scene` that is neither a table nor a list, with its path.
fn leaves(scene: &Scene) -> Result<Vec<(String, Value)>> {
    fn collect(value: Value, path: &str, found: &mut Vec<(String, Value)>) {
        match value {
            Value::Table(entries) => {
                for (key, value) in entries {
                    let path = if path.is_empty() { key } else { path_to(path, &key) };
                    collect(value, &path, found);
                }
            }
            Value::Array(items) => {
                for (k, item) in items.into_iter().enumerate() {
                    collect(item, &format!("{path}[{k}]"), found);
                }
            }
            other => found.push((path.to_owned(), other)),
        }
    }
    let mut found = Vec::new();
    if let Ok(value) = toml::from_str::<Value>(&scene.resolved()?) {
        collect(value, "", &mut found);
    }
    Ok(found)
}
