//! Integrators as users name them: by a name alone, or by a table as in scenes.

use std::path::Path;

use crate::model::Policy;
use crate::num::checked::Positive;
use crate::num::{Short, decimal};
use crate::run::{Error, Result};
use crate::scene::Scene;

/// An integrator for a scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IntegratorChoice {
    /// Its name, with settings that its name does not say.
    pub name: String,
    /// Its table.
    table: String,
    /// The option that gives it.
    option: &'static str,
    /// Whether its steps are fixed, and a tolerance is a step as a share of the whole time.
    pub fixed_steps: bool,
}

impl IntegratorChoice {
    /// The integrator `text`, a name or a table that `option` gives, of the scene file `scene` with `set`.
    ///
    /// # Errors
    /// The scene is not valid, or the integrator does not exist.
    pub fn read(scene: &Path, set: &[String], text: &str, option: &'static str) -> Result<Self> {
        let table = table_of(text);
        let scene = Scene::varied(scene, set, &[key(&table)], option)?;
        let integrator = &scene.time.integrator;
        // Tolerances are varied, but not their ratio.
        let ratio =
            toml::from_str::<toml::Table>(&format!("table = {table}")).ok().and_then(|all| {
                let number = |key: &str| all.get("table")?.get(key)?.as_float();
                Some(format!(", atol = {} rtol", Short(decimal(number("atol")? / number("rtol")?))))
            });
        let name = integrator.name() + &settings(&table, &["rtol", "atol", "step"]);
        let name = name + &ratio.unwrap_or_default();
        Ok(Self { name, fixed_steps: integrator.rtol().is_none(), table, option })
    }

    /// The override that gives a scene this integrator at `tolerance`.
    ///
    /// # Errors
    /// The scene is not valid.
    pub fn setting(&self, scene: &Path, set: &[String], tolerance: Positive) -> Result<String> {
        let mut scene = Scene::varied(scene, set, &[key(&self.table)], self.option)?;
        let until = scene.time.span.until;
        scene.time.integrator = scene.time.integrator.at_tolerance(tolerance, until);
        Ok(key(&inline(&scene)?))
    }

    /// The scene with this integrator at `tolerance`; problems name the option.
    ///
    /// # Errors
    /// The scene is not valid.
    pub fn scene(&self, scene: &Path, set: &[String], tolerance: Positive) -> Result<Scene> {
        let with = self.setting(scene, set, tolerance)?;
        Ok(Scene::varied(scene, set, &[with], self.option)?)
    }
}

fn key(table: &str) -> String {
    format!("time.integrator={table}")
}

/// The integrator of a scene as a table in one line.
fn inline(scene: &Scene) -> Result<String> {
    let value = toml::Value::try_from(&scene.time.integrator);
    let mut value = value.map_err(|error| Error::Refused(error.to_string()))?;
    // Nothing is solved for, so that tolerances mean nothing.
    let blind = scene.time.integrator.explicit_step().is_some();
    if blind
        && scene.time.policy != Policy::ChemistryFast
        && let Some(table) = value.as_table_mut()
    {
        table.remove("rtol");
        table.remove("atol");
    }
    let pairs = value.as_table().into_iter().flatten();
    let pairs = pairs.map(|(key, value)| match value {
        toml::Value::Float(number) => format!("{key} = {}", short(*number)),
        value => format!("{key} = {value}"),
    });
    Ok(format!("{{ {} }}", pairs.collect::<Vec<_>>().join(", ")))
}

/// A number for a scene in few characters: without what a product has in its last digits, and with a power of
/// ten where it would have many zeros.
fn short(number: f64) -> String {
    let rounded = decimal(number);
    let number =
        if (rounded - number).abs() <= ROUNDING_ERROR * number.abs() { rounded } else { number };
    let (plain, power) = (format!("{number:?}"), format!("{number:e}"));
    if plain.len() <= power.len() { plain } else { power }
}

/// Relative rounding error of a product of few factors.
const ROUNDING_ERROR: f64 = 1e-15;

/// Returns overrides as options for a shell.
pub(crate) fn set_options(overrides: &[String]) -> String {
    let set = |text: &String| format!("--set '{}'", text.replace('\'', "'\\''"));
    overrides.iter().map(set).collect::<Vec<_>>().join(" ")
}

/// Returns the settings of an integrator's table that its name does not contain, as in `, linear = "ilu"`, without
/// the keys `but`.
pub(crate) fn settings(table: &str, but: &[&str]) -> String {
    let inner = table.trim().trim_start_matches('{').trim_end_matches('}');
    let said = ["kind", "method", "chemistry"];
    let rest = inner.split(',').map(|pair| pair.split_once('=').unwrap_or((pair, "")));
    let rest = rest.map(|(key, value)| (key.trim(), value.trim()));
    rest.filter(|(key, _)| !key.is_empty() && !said.contains(key) && !but.contains(key))
        .map(|(key, value)| format!(", {key} = {value}"))
        .collect()
}

/// Returns the table of an integrator given by a table or by the name of its kind.
pub(crate) fn table_of(integrator: &str) -> String {
    let table = integrator.trim_start().starts_with('{');
    if table { integrator.to_owned() } else { format!("{{ kind = {} }}", quoted(integrator)) }
}

/// Returns a name in quotes, and a table unchanged.
pub(crate) fn quoted(value: &str) -> String {
    let table = value.trim_start().starts_with(['{', '"']);
    if table { value.to_owned() } else { format!("\"{value}\"") }
}
