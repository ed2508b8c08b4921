//! Parameters p: numbers of a scene, and fields by their values at the vertices.
//!
//! A scene is read again with other numbers, and with fields as arrays that are given in memory: no effect and no law knows of
//! derivatives. Where a field is read at the triangles it has there its own value, and the mean of the changes at the corners.

use std::path::PathBuf;

use toml::Value;

use super::measure::species_names;
use super::source::SceneSource;
use crate::kinetics::PluginSearch;
use crate::kinetics::descriptor::Default;
use crate::num::real;
use crate::run::{Error, Result, Simulation, field_values};
use crate::scene::{Scene, path_to};
use crate::sheet::{Array, Sheet, Surface};

/// The option that values come from.
pub(super) const OPTION: &str = "--with";
/// The option of fields.
pub(super) const FIELD_OPTION: &str = "--map";
/// Name of the array of a field in memory.
const ARRAY: &str = "value";

/// A parameter with its value in the scene.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// Its key as the user gives it.
    pub key: String,
    /// Its value: one number, or one a vertex.
    pub value: Vec<f64>,
    /// The same with list elements by their numbers.
    target: String,
    /// Of a field: its values at the triangles.
    at_triangles: Option<Vec<f64>>,
}

impl Parameter {
    /// Whether it is a field.
    #[must_use]
    pub fn is_field(&self) -> bool {
        self.at_triangles.is_some()
    }

    /// The key `key` of `scene`, a number.
    ///
    /// # Errors
    /// A key that the scene does not have, of the sheet, or of another type.
    pub(super) fn number(
        (source, set): (&SceneSource, &[String]),
        (scene, simulation, search): (&Scene, &Simulation, &PluginSearch),
        key: &str,
    ) -> Result<Self> {
        let (target, value) = find((source, set), (scene, simulation, search), key)?;
        let number = match value {
            Value::Float(number) => number,
            // `drag = 10.0` is one number in short.
            Value::Table(table) if target == "material.drag" && table.len() == 1 => {
                match table.get("per-vertex") {
                    Some(Value::Float(number)) => *number,
                    _ => {
                        let help = "--with material.drag.per-area, or how the scene has it";
                        let message = "it is a table";
                        return Err(scene.error_at(&target, message, Some(help)).into());
                    }
                }
            }
            other => {
                let message = format!("it is {}, not a number", described(&other));
                let help = "--map gives the derivative by the values of a field at the vertices";
                return Err(scene.error_at(&target, &message, Some(help)).into());
            }
        };
        let key = key.to_owned();
        Ok(Self { key, value: vec![number], target, at_triangles: None })
    }

    /// The key `key` of `scene`, a field on `sheet`.
    ///
    /// # Errors
    /// A key that the scene does not have, of the sheet, or a field that reads species or time.
    pub(super) fn field(
        (source, set): (&SceneSource, &[String]),
        (scene, simulation, search): (&Scene, &Simulation, &PluginSearch),
        key: &str,
    ) -> Result<Self> {
        let sheet = &**simulation.sheet();
        let (target, value) = find((source, set), (scene, simulation, search), key)?;
        if let Some(values) = initial_species(simulation, &target) {
            return Ok(Self::of_points((key, target), values, sheet));
        }
        let value = match value {
            // Parameters of laws and species have formulas under a key.
            Value::Table(mut table) if table.len() == 1 && table.contains_key("formula") => {
                table.remove("formula").unwrap_or(Value::Boolean(false))
            }
            other => other,
        };
        let what = described(&value);
        let [value, at_triangles] = field_values(scene, sheet, value).map_err(|why| {
            let message = format!("it is {what}, no field of the place alone: {why}");
            Error::from(scene.error_at(&target, &message, None))
        })?;
        let at_triangles = Some(at_triangles);
        Ok(Self { key: key.to_owned(), value, target, at_triangles })
    }

    /// The values of a species at the points of its law.
    fn of_points((key, target): (&str, String), values: &[f64], sheet: &Sheet) -> Self {
        let (value, at_triangles) = match values.len() == sheet.vertex_count() {
            true => (values.to_vec(), means(sheet, values)),
            false => {
                let around = |v: usize| sheet.vertex_triangles().entries(v);
                let mean = |v: usize| {
                    around(v).iter().map(|(t, _)| values[*t as usize]).sum::<f64>()
                        / real(around(v).len().max(1))
                };
                ((0..sheet.vertex_count()).map(mean).collect(), values.to_vec())
            }
        };
        Self { key: key.to_owned(), value, target, at_triangles: Some(at_triangles) }
    }

    /// Refuses parameters of which one is a part of another: a scene has one of the two values.
    ///
    /// # Errors
    /// The two keys.
    pub(super) fn check_apart(all: &[Self]) -> Result<()> {
        for (k, one) in all.iter().enumerate() {
            let inside = |rest: &str| rest.is_empty() || rest.starts_with(['.', '[']);
            let part = |a: &Self, b: &Self| b.target.strip_prefix(&*a.target).is_some_and(inside);
            if let Some(other) = all[..k].iter().find(|other| part(one, other) || part(other, one))
            {
                return Err(Error::Refused(format!(
                    "{} and {} are one parameter: leave one of them out",
                    other.key, one.key
                )));
            }
        }
        Ok(())
    }

    /// The override by which a scene has `value`.
    pub(super) fn set(&self, number: usize, value: &[f64]) -> String {
        match self.is_field() {
            true => {
                let file = file(number).display().to_string();
                format!("{}={{file={file:?}, array={ARRAY:?}}}", self.key)
            }
            false => format!("{}={:?}", self.key, value.first().copied().unwrap_or(f64::NAN)),
        }
    }

    /// Gives `scene` the values of a field.
    pub(super) fn give(&self, number: usize, value: &[f64], (scene, sheet): (&mut Scene, &Sheet)) {
        let Some(at_triangles) = &self.at_triangles else { return };
        let change: Vec<f64> = value.iter().zip(&self.value).map(|(new, old)| new - old).collect();
        let changes = means(sheet, &change);
        let on_triangles = at_triangles.iter().zip(changes).map(|(old, change)| old + change);
        let array = |values: Vec<f64>| vec![Array { name: ARRAY.into(), components: 1, values }];
        let surface = Surface {
            points: sheet.rest().to_vec(),
            triangles: sheet.triangles().to_vec(),
            point_arrays: array(value.to_vec()),
            cell_arrays: array(on_triangles.collect()),
            ..Surface::default()
        };
        scene.give_surface(file(number), surface);
    }
}

/// The start of the species whose key `target` is, whatever pattern the scene gives it.
fn initial_species<'a>(simulation: &'a Simulation, target: &str) -> Option<&'a [f64]> {
    let (table, name) = target.rsplit_once(".initial.").unwrap_or_default();
    if !table.starts_with("kinetics") {
        return None;
    }
    let names = species_names(simulation.model());
    let number = names.iter().position(|species| *species == name)?;
    simulation.state().species.get(number).map(Vec::as_slice)
}

/// What stands for the file of a field.
fn file(number: usize) -> PathBuf {
    PathBuf::from(format!("/in memory/{number}.vtu"))
}

/// The mean over the corners of every triangle.
fn means(sheet: &Sheet, values: &[f64]) -> Vec<f64> {
    let mean = |corners: &[u32; 3]| corners.iter().map(|v| values[*v as usize]).sum::<f64>() / 3.0;
    sheet.triangles().iter().map(mean).collect()
}

/// What stands at `key` of `scene`, with list elements by their numbers.
fn find(
    (source, set): (&SceneSource, &[String]),
    (scene, simulation, search): (&Scene, &Simulation, &PluginSearch),
    key: &str,
) -> Result<(String, Value)> {
    if key.contains('=') {
        return Err(Error::Refused(format!(
            "{OPTION} {key}: expected a key alone, as material.thickness"
        )));
    }
    let over = [format!("{key}=1.0")];
    let target = source.overridden_keys(set, &over, OPTION)?.pop().unwrap_or_default();
    let table = target.split(['.', '[']).next().unwrap_or_default();
    if table == "sheet" {
        let message =
            "it makes another mesh or another start: equilibria are differentiated on one mesh";
        return Err(scene.error_at(&target, message, None).into());
    }
    if !["material", "effect", "kinetics"].contains(&table) {
        let message = "it says how the scene is solved: parameters are those of [material], [[effect]] and [kinetics]";
        return Err(scene.error_at(&target, message, None).into());
    }
    let resolved = toml::from_str::<Value>(&scene.resolved()?).ok();
    match resolved.and_then(|value| at(value, "", &target)) {
        Some(value) => Ok((target, value)),
        None if default(simulation, &target).is_some() => {
            Ok((target.clone(), Value::Float(default(simulation, &target).unwrap_or_default())))
        }
        None => {
            // A key that the scene or its law cannot have is refused with the nearest one.
            Simulation::on_sheet(&source.scene(set, &over, OPTION)?, search, simulation.sheet())?;
            let message = "the scene leaves it out, and derivatives are taken at its value";
            let help = format!("--set {key}=VALUE gives it one");
            Err(scene.error_at(&target, message, Some(&help)).into())
        }
    }
}

/// The default of a parameter of the only law, which the scene leaves out.
fn default(simulation: &Simulation, target: &str) -> Option<f64> {
    let name = target.strip_prefix("kinetics.parameters.")?;
    let all = &simulation.model().chemistry()?.descriptor().parameters;
    let mut number = all.iter().position(|parameter| parameter.name == name)?;
    loop {
        match all.get(number)?.default {
            Default::Value(value) => return Some(value),
            Default::SameAs(earlier) if earlier < number => number = earlier,
            Default::SameAs(_) => return None,
        }
    }
}

/// The part of `value`, which stands at `path`, that stands at `target`.
fn at(value: Value, path: &str, target: &str) -> Option<Value> {
    if path == target {
        return Some(value);
    }
    let within = |path: &str| {
        target == path || target.strip_prefix(path).is_some_and(|rest| rest.starts_with(['.', '[']))
    };
    let (path, value) = match value {
        Value::Table(entries) => entries
            .into_iter()
            .map(|(key, value)| (if path.is_empty() { key } else { path_to(path, &key) }, value))
            .find(|(path, _)| within(path))?,
        Value::Array(items) => items
            .into_iter()
            .enumerate()
            .map(|(k, item)| (format!("{path}[{k}]"), item))
            .find(|(path, _)| within(path))?,
        _ => return None,
    };
    at(value, &path, target)
}

/// A value in words.
fn described(value: &Value) -> String {
    match value {
        Value::Table(_) | Value::Array(_) => "a table or a list".to_owned(),
        Value::String(text) => format!("the text {text:?}"),
        other => other.to_string(),
    }
}
