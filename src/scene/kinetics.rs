//! `[kinetics]`: which plugin or which law, its parameters, and how the species start; `[[kinetics]]`
//! several times for several laws on one sheet.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::initial::{FieldFile, Initial, is_by_region};
use crate::document::{DocumentError, Node, Value, read};
use crate::effects::{Field, Measure};
use crate::kinetics::{Location, search};
use crate::model::{AtBoundary, TensionReading};
use crate::num::checked::{Finite, Positive};

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
    /// The signals of curvature at the boundary.
    #[serde(default)]
    pub boundary: AtBoundary,
    /// Parameters that differ from the plugin's defaults, or all of a law.
    #[serde(skip_deserializing)]
    pub parameters: BTreeMap<String, ParameterSpec>,
    /// Other names for the species and observables of a plugin.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub rename: BTreeMap<String, String>,
    /// Species that are those of an earlier law.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shared: Vec<String>,
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
    /// A law's length factor across a fibre.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length_factor_across: Option<String>,
    /// A law's spontaneous curvature.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curvature: Option<String>,
    /// Observables of a law.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub observables: BTreeMap<String, String>,
    /// Start of every species that does not start at 0.
    #[serde(skip_deserializing)]
    pub initial: BTreeMap<String, Initial>,
}

/// The value of a parameter: one number, or a field over the rest positions.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ParameterSpec {
    /// The same everywhere.
    Uniform(Finite),
    /// A formula of the rest position `x`, `y`, `z`.
    Formula(PositionFormula),
    /// An array of a mesh file.
    File(FieldFile),
    /// A number for each of several regions.
    Regions(Field),
}

/// A formula of the rest position.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PositionFormula {
    /// Its text.
    pub formula: String,
}

impl ParameterSpec {
    /// The number, if it is one.
    #[must_use]
    pub fn uniform(&self) -> Option<f64> {
        match self {
            Self::Uniform(value) => Some(value.get()),
            Self::Formula(_) | Self::File(_) | Self::Regions(_) => None,
        }
    }

    fn read(node: Node) -> Result<Self, DocumentError> {
        match &node.value {
            Value::Integer(_) | Value::Float(_) => read(node).map(Self::Uniform),
            Value::Table(_) if node.get("file").is_some() && node.get("formula").is_some() => {
                Err(DocumentError::plain("a parameter has a formula or a file, not both"))
            }
            Value::Table(_) if is_by_region(&node) => read(node).map(Self::Regions),
            Value::Table(_) if node.get("file").is_some() => read(node).map(Self::File),
            Value::Table(_) => read(node)
                .map(Self::Formula)
                .map_err(|p: DocumentError| p.also_allowed(&["file", "regions"])),
            other => {
                let expected = "a number or a table such as { formula = \"1 + 0.1*x\" }";
                Err(DocumentError::mismatch(expected, other.describe())
                    .help("allowed: a number, { formula = … }, { file = …, array = … }, { default = …, regions = … }"))
            }
        }
    }
}

impl KineticsSpec {
    /// Whether `plugin` is the path of a library, not a name to look up.
    #[must_use]
    pub fn plugin_is_path(&self) -> bool {
        self.plugin.as_deref().is_some_and(search::is_path)
    }
}

/// Reads `[kinetics]`, or every `[[kinetics]]`. All laws of a scene share location, measure,
/// reading of the tension and rule at the boundary: a later table takes over what it does not give.
pub(crate) fn read_kinetics(node: Node) -> Result<Vec<KineticsSpec>, DocumentError> {
    let Node { value: Value::Array(items), .. } = node else { return Ok(vec![read_one(node)?]) };
    let mut all: Vec<KineticsSpec> = Vec::new();
    for (number, item) in items.into_iter().enumerate() {
        let place = item.place.clone();
        let written =
            ["location", "measure", "tension", "boundary"].map(|key| item.get(key).is_some());
        let wrong = |p: DocumentError| p.placed(&place).under_index(number);
        let mut one = read_one(item).map_err(wrong)?;
        if let Some(first) = all.first() {
            let same = [
                !written[0] || one.location == first.location,
                !written[1] || one.measure == first.measure,
                !written[2] || one.tension == first.tension,
                !written[3] || one.boundary == first.boundary,
            ];
            let keys = ["location", "measure", "tension", "boundary"];
            if let Some((key, _)) = keys.iter().zip(same).find(|(_, same)| !same) {
                let message = format!("{key} is the same for all laws of a scene");
                let problem =
                    DocumentError::plain(message).help("give it in the first [[kinetics]]");
                return Err(wrong(problem.under(key)));
            }
            (one.location, one.measure) = (first.location, first.measure);
            (one.tension, one.boundary) = (first.tension, first.boundary);
        }
        all.push(one);
    }
    Ok(all)
}

/// Writes one law as `[kinetics]`, several as `[[kinetics]]`.
pub(super) fn one_or_all<S: serde::Serializer>(
    all: &[KineticsSpec],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    match all {
        [one] => one.serialize(serializer),
        all => all.serialize(serializer),
    }
}

/// Takes the table at a key apart, entry by entry.
fn entries<T>(
    node: &mut Node,
    key: &str,
    expected: &str,
    read: impl Fn(Node) -> Result<T, DocumentError>,
) -> Result<BTreeMap<String, T>, DocumentError> {
    match node.take(key) {
        None => Ok(BTreeMap::new()),
        Some((_, Node { value: Value::Table(entries), .. })) => entries
            .into_iter()
            .map(|(name, value)| {
                let place = value.place.clone();
                let wrong = |p: DocumentError| p.placed(&place).under(&name.name).under(key);
                Ok((name.name.clone(), read(value).map_err(wrong)?))
            })
            .collect(),
        Some((_, Node { value, place })) => {
            Err(DocumentError::mismatch(expected, value.describe()).placed(&place).under(key))
        }
    }
}

fn read_one(mut node: Node) -> Result<KineticsSpec, DocumentError> {
    let initial = entries(&mut node, "initial", "a table of species", Initial::read)?;
    let parameters = entries(&mut node, "parameters", "a table of numbers", ParameterSpec::read)?;
    let kinetics: KineticsSpec =
        read(node).map_err(|p: DocumentError| p.also_allowed(&["initial", "parameters"]))?;
    let law = !kinetics.rates.is_empty();
    let parts = [
        ("units", !kinetics.units.is_empty()),
        ("species", !kinetics.species.is_empty()),
        ("let", !kinetics.r#let.is_empty()),
        ("length_factor", kinetics.length_factor.is_some()),
        ("length_factor_across", kinetics.length_factor_across.is_some()),
        ("curvature", kinetics.curvature.is_some()),
        ("observables", !kinetics.observables.is_empty()),
    ];
    match (&kinetics.plugin, law) {
        (None, false) => {
            return Err(DocumentError::missing_key("plugin")
                .help("the name of a plugin, or the law itself: rates.c = \"k - beta*c\""));
        }
        (Some(_), true) => {
            let message = "a plugin has its own rates: name a plugin or write rates, not both";
            return Err(DocumentError::plain(message).under("rates"));
        }
        (Some(_), false) => {
            if let Some((key, _)) = parts.iter().find(|(_, given)| *given) {
                let message = "this is part of a law written as text; a plugin has its own";
                return Err(DocumentError::plain(message).under(key));
            }
        }
        (None, true) if !kinetics.rename.is_empty() => {
            let message = "this is for plugins: a law written as text uses its own names";
            return Err(DocumentError::plain(message).under("rename"));
        }
        (None, true) => {}
    }
    Ok(KineticsSpec { initial, parameters, ..kinetics })
}

/// What a species of a law is, where that is not the default.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SpeciesSpec {
    /// Unit, in words.
    pub unit: String,
    /// Description.
    pub doc: String,
    /// Magnitude that matters; from the start of the run if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub typical: Option<Positive>,
    /// Least value that makes sense.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lower: Option<Finite>,
    /// Greatest value that makes sense.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub upper: Option<Finite>,
}

impl Default for SpeciesSpec {
    fn default() -> Self {
        let unit = "1".to_owned();
        Self { unit, doc: String::new(), typical: None, lower: None, upper: None }
    }
}
