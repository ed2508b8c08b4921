//! The key of a scene along which a branch is followed: a number that is not of the sheet.

use std::path::Path;

use toml::Value;

use super::refusals::OPTION_NAME;
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
        let over = key.set(value);
        let target =
            Scene::overridden_keys(file, set, &over, OPTION_NAME)?.pop().unwrap_or_default();
        if target == "sheet" || target.starts_with("sheet.") {
            let message = "it makes another mesh or another start, and a branch is one of equilibria on one mesh";
            let help = "rumple sweep runs the scene over such a key";
            return Err(scene.error_at(&target, message, Some(help)).into());
        }
        key.target.clone_from(&target);
        let found = leaves(&scene)?;
        let within = |path: &str| {
            path.strip_prefix(&*target).is_some_and(|rest| rest.starts_with(['.', '[']))
        };
        let what = match found.iter().find(|(path, _)| *path == target) {
            Some((_, Value::Float(value))) => {
                key.value = Some(*value);
                return Ok(key);
            }
            Some((_, Value::Integer(value))) => {
                format!("{value}, a whole number that cannot change little by little")
            }
            Some((_, Value::String(text))) => format!("the text {text:?}"),
            Some((_, other)) => other.to_string(),
            None if found.iter().any(|(path, _)| within(path)) => "a table or a list".to_owned(),
            None => {
                // A key that the scene can have, and leaves out; or one that it cannot have.
                Scene::varied(file, set, &over, OPTION_NAME)?;
                return Ok(key);
            }
        };
        let mut numbers = found.iter().filter(|(_, value)| value.is_float()).map(|(path, _)| path);
        let nearest = numbers.find(|path| within(path)).map_or("material.thickness", |path| path);
        let message = format!("it is {what}; a branch is followed along a number");
        let help = format!("name a number, as {nearest}");
        Err(scene.error_at(&target, &message, Some(&help)).into())
    }
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
