//! `[kinetics]`: which plugin, its parameters, and how the species start.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::effects::Measure;
use crate::kinetics::{Location, search};
use crate::num::checked::Finite;
use crate::system::TensionReading;

use super::deserialize::read;
use super::document::{Node, Value};
use super::initial::Initial;
use super::problem::Problem;

/// The table `[kinetics]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KineticsSpec {
    /// Name of a plugin, or path of its library.
    pub plugin: String,
    /// Where species live; without it, where the plugin says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub location: Option<Location>,
    /// What the numbers of a species count.
    #[serde(default)]
    pub measure: Measure,
    /// How the tension signal is read.
    #[serde(default)]
    pub tension: TensionReading,
    /// Parameters that differ from the plugin's defaults.
    #[serde(default)]
    pub parameters: BTreeMap<String, Finite>,
    /// Start of every species that does not start at 0.
    #[serde(skip_deserializing)]
    pub initial: BTreeMap<String, Initial>,
}

impl KineticsSpec {
    /// Whether `plugin` is the path of a library, not a name to look up.
    #[must_use]
    pub fn plugin_is_path(&self) -> bool {
        search::is_path(&self.plugin)
    }
}

/// Reads the table `[kinetics]`.
pub(crate) fn read_kinetics(mut node: Node) -> Result<KineticsSpec, Problem> {
    let initial = match node.take("initial") {
        None => BTreeMap::new(),
        Some((_, Node { value: Value::Table(entries), .. })) => {
            let mut initial = BTreeMap::new();
            for (key, value) in entries {
                let place = value.place.clone();
                let start = Initial::read(value)
                    .map_err(|problem| problem.placed(&place).under(&key.name).under("initial"))?;
                initial.insert(key.name, start);
            }
            initial
        }
        Some((_, Node { value, place })) => {
            let problem = Problem::mismatch("a table of species", value.describe());
            return Err(problem.placed(&place).under("initial"));
        }
    };
    let kinetics: KineticsSpec = read(node).map_err(|p: Problem| p.also_allowed(&["initial"]))?;
    Ok(KineticsSpec { initial, ..kinetics })
}
