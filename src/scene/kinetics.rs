//! `[kinetics]`: which plugin or which law, its parameters, and how the species start.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::effects::Measure;
use crate::kinetics::{Location, search};
use crate::num::checked::Finite;
use crate::system::TensionReading;

use super::deserialize::read;
use super::document::{Node, Value};
use super::initial::Initial;
use super::law::SpeciesSpec;
use super::problem::Problem;

/// The table `[kinetics]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KineticsSpec {
    /// Name of a plugin, or path of its library; none where the scene writes the law itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plugin: Option<String>,
    /// Where species live; without it, where the plugin says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub location: Option<Location>,
    /// What the numbers of a species count.
    #[serde(default)]
    pub measure: Measure,
    /// How the tension signal is read.
    #[serde(default)]
    pub tension: TensionReading,
    /// Parameters that differ from the plugin's defaults, or all of a law.
    #[serde(default)]
    pub parameters: BTreeMap<String, Finite>,
    /// Units of a law's parameters, in words.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub units: BTreeMap<String, String>,
    /// A law's species, where they need more than a name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub species: BTreeMap<String, SpeciesSpec>,
    /// Names for parts of a law's formulas.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub r#let: BTreeMap<String, String>,
    /// A law: the rate of every species.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub rates: BTreeMap<String, String>,
    /// A law's length factor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length_factor: Option<String>,
    /// Start of every species that does not start at 0.
    #[serde(skip_deserializing)]
    pub initial: BTreeMap<String, Initial>,
}

impl KineticsSpec {
    /// Whether `plugin` is the path of a library, not a name to look up.
    #[must_use]
    pub fn plugin_is_path(&self) -> bool {
        self.plugin.as_deref().is_some_and(search::is_path)
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
    let law = !kinetics.rates.is_empty();
    let parts = [
        ("units", !kinetics.units.is_empty()),
        ("species", !kinetics.species.is_empty()),
        ("let", !kinetics.r#let.is_empty()),
        ("length_factor", kinetics.length_factor.is_some()),
    ];
    match (&kinetics.plugin, law) {
        (None, false) => {
            return Err(Problem::missing_key("plugin")
                .help("the name of a plugin, or the law itself: rates.c = \"k - beta*c\""));
        }
        (Some(_), true) => {
            let message = "a plugin has its own rates: name a plugin or write rates, not both";
            return Err(Problem::plain(message).under("rates"));
        }
        (Some(_), false) => {
            if let Some((key, _)) = parts.iter().find(|(_, given)| *given) {
                let message = "this is part of a law written as text; a plugin has its own";
                return Err(Problem::plain(message).under(key));
            }
        }
        (None, true) => {}
    }
    Ok(KineticsSpec { initial, ..kinetics })
}
